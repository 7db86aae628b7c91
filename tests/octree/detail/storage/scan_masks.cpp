// SPDX-License-Identifier: BSD-3-Clause
#include <set>
#include <tuple>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

using voxels = std::set<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>>;

[[nodiscard]] voxels listed(const scan_masks& masks, std::array<std::uint64_t, 8> scan_brick::*which) {
  voxels all;
  for (const scan_brick& b : masks.bricks()) {
    const voxel_key base = named_key(b.name);
    for_each_place(b.*which, [&](std::uint32_t place) {
      const voxel_key k = voxel_in_brick(place);
      all.emplace(base.x + k.x, base.y + k.y, base.z + k.z);
    });
  }
  return all;
}

}  // namespace

TEST_CASE("What is marked is listed, once") {
  random_bits random{181};
  scan_masks masks, other;
  voxels free, occupied;
  for (int i = 0; i != 3000; ++i) {
    const auto at = [&] { return 1000 + static_cast<std::uint32_t>(random.below(40)); };
    const voxel_key k{at(), at(), at()};
    (i % 3 == 0 ? free : occupied).emplace(k.x, k.y, k.z);
    scan_masks& into = i % 2 == 0 ? masks : other;
    i % 3 == 0 ? into.mark_free(k) : into.mark_occupied(k);
  }
  masks.merge(other);
  CHECK(listed(masks, &scan_brick::free) == free);
  CHECK(listed(masks, &scan_brick::occupied) == occupied);
  masks.clear();
  CHECK(masks.bricks().empty());
}

TEST_CASE("The memory of a scan is given back once much less is needed") {
  scan_masks masks;
  for (std::uint32_t i = 0; i != 100000; ++i) masks.mark_free({8 * (i % 1000), 8 * (i / 1000), 0});
  const std::size_t much = masks.memory_bytes();
  masks.clear();
  CHECK(masks.memory_bytes() == much);  // the next one may be as large
  masks.mark_free({1, 2, 3});
  masks.clear();
  CHECK(masks.memory_bytes() < much / 100);
  masks.mark_free({1, 2, 3});
  CHECK(listed(masks, &scan_brick::free) == voxels{{1, 2, 3}});
}
