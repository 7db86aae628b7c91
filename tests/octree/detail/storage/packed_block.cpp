// SPDX-License-Identifier: BSD-3-Clause
#include <bit>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>
#include <orbis/octree/detail/storage/palette_kernels.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

template <class T>
octree::detail::block<T> random_block(random_bits& random, std::uint32_t kinds) {
  octree::detail::block<T> b;
  b.known = random.below(4) == 0 ? ~std::uint64_t{0} : random() | random();
  for (unsigned i = 0; i != 64; ++i)
    if ((b.known >> i & 1U) != 0) b.value[i] = static_cast<T>(static_cast<int>(random.below(kinds)) - 7);
  return b;
}

/// The palette of a block, value by value.
template <class T>
void palette_one_by_one(const octree::detail::block<T>& b, palette<T>& p) {
  p.count = 0;
  p.plane.fill(0);
  for (std::uint64_t rest = b.known; rest != 0;) {
    const T v = b.value[static_cast<std::size_t>(std::countr_zero(rest))];
    std::uint64_t same = 0;
    for (std::size_t i = 0; i != 64; ++i)
      same |= std::uint64_t{std::bit_cast<octree::detail::value_bits<T>>(b.value[i]) ==
                            std::bit_cast<octree::detail::value_bits<T>>(v)}
              << i;
    if (p.count == max_palette) {
      ++p.count;
      return;
    }
    p.add(v, same & rest);
    rest &= ~same;
  }
}

template <class T>
void check_round_trip() {
  random_bits random{1};
  for (int i = 0; i != 2000; ++i) {
    const octree::detail::block<T> b = random_block<T>(random, 1 + random.below(40));
    palette<T> p, reference;
    find_palette(b, p);
    palette_one_by_one(b, reference);
    REQUIRE(p.count == reference.count);
    if (p.count > max_palette) continue;
    REQUIRE(p.plane == reference.plane);
    REQUIRE(std::equal(p.value.begin(), p.value.begin() + p.count, reference.value.begin()));
    const auto bits = static_cast<unsigned>(std::bit_width(p.count - 1));
    octree::detail::block<T> back;
    back.known = b.known;
    expand_palette(p.value.data(), p.plane.data(), bits, back);
    REQUIRE(back.value == b.value);
  }
}

}  // namespace

TEST_CASE("A block comes back from its palette at every instruction set") {
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    check_round_trip<float>();
    check_round_trip<double>();
  }
}

TEST_CASE("A palette has the values in the order of their first voxels and every voxel in one place") {
  octree::detail::block<float> b;
  b.known = 0xf0;
  b.value[4] = 2.0F;
  b.value[5] = -1.0F;
  b.value[6] = 2.0F;
  b.value[7] = 0.0F;
  palette<float> p;
  find_palette(b, p);
  REQUIRE(p.count == 3);
  CHECK(p.value[0] == 2.0F);
  CHECK(p.value[1] == -1.0F);
  CHECK(p.value[2] == 0.0F);
  CHECK((voxels_of_index<2>(p.plane.data(), 0) & b.known) == 0x50);
  CHECK((voxels_of_index<2>(p.plane.data(), 1) & b.known) == 0x20);
  CHECK((voxels_of_index<2>(p.plane.data(), 2) & b.known) == 0x80);
}
