// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cstdint>
#include <optional>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/octant_record.hpp>
#include <orbis/octree/detail/storage/palette_kernels.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

/// An octant of about `kinds` values; unknown voxels hold 0.
octree::detail::block<float> random_block(random_bits& random, std::uint32_t kinds) {
  octree::detail::block<float> b;
  b.known = random() | random();
  for (unsigned i = 0; i != 64; ++i)
    if ((b.known >> i & 1U) != 0) b.value[i] = static_cast<float>(static_cast<int>(random.below(kinds)) - 2);
  return b;
}

/// What a record says of each voxel must be what the block says.
template <class Record>
void check_record(const Record& r, const octree::detail::block<float>& b) {
  REQUIRE(r.known == b.known);
  octree::detail::block<float> back;
  r.unpack(back);
  REQUIRE(back.known == b.known);
  const octant_view<float> view = r.view();
  REQUIRE(view.known == b.known);
  for (std::uint32_t i = 0; i != 64; ++i) {
    if ((b.known >> i & 1U) == 0) continue;
    REQUIRE(back.value[i] == b.value[i]);
    REQUIRE(r.at(i) == b.value[i]);
    REQUIRE(view.at(i) == b.value[i]);
  }
  std::uint64_t negative = 0;
  for (unsigned i = 0; i != 64; ++i) negative |= std::uint64_t{b.value[i] < 0.0F} << i;
  REQUIRE((r.where([](float v) { return v < 0.0F; }) & b.known) == (negative & b.known));

  // Negative values are forgotten, the others grow by one.
  std::uint64_t different = 0;
  const auto changed =
      r.transformed([](float v) { return v < 0.0F ? std::nullopt : std::optional{v + 1.0F}; }, different);
  REQUIRE(different == b.known);
  REQUIRE(changed.known == (b.known & ~negative));
  for (std::uint32_t i = 0; i != 64; ++i)
    if ((changed.known >> i & 1U) != 0) REQUIRE(changed.at(i) == b.value[i] + 1.0F);
}

}  // namespace

TEST_CASE("A packed octant says of every voxel what was packed") {
  random_bits random{401};
  for (int run = 0; run != 300; ++run) {
    const octree::detail::block<float> b = random_block(random, 8);
    palette<float> p;
    find_palette(b, p);
    packed_octant<float, 3> r;
    r.pack(b.known, p);
    check_record(r, b);
  }
}

TEST_CASE("A plain octant says of every voxel what was packed") {
  random_bits random{402};
  for (int run = 0; run != 300; ++run) {
    const octree::detail::block<float> b = random_block(random, 60);
    plain_octant<float> r;
    r.pack(b);
    check_record(r, b);
  }
}
