// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/octree/files-inl.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>
#include <orbis/octree/scan-inl.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

TEST_CASE("the masks of a scan are disjoint, and applied to a map they are the integrated scan") {
  random_bits random{3};
  scan_marker marker;
  scan voxels;
  CHECK(voxels.empty());
  occupancy_octree<> integrated{0.05}, applied{0.05};
  for (int frame = 0; frame != 4; ++frame) {
    const vec3f origin = 0.2F * static_cast<float>(frame) * vec3f::Ones();
    const auto points = test::shell_scan(random, 300, origin);
    const auto marked = marker.mark(seq, applied.grid(), points, origin, {}, voxels);
    std::size_t free = 0, occupied = 0;
    std::uint64_t last = 0;
    for (const scan::part& p : voxels.parts()) {
      CHECK((free + occupied == 0 || p.name > last));
      last = p.name;
      const scan::brick_masks masks = voxels.masks(p);
      std::size_t octants = 0;
      voxels.for_each_octant(p, [&](unsigned octant, std::uint64_t f, std::uint64_t o) {
        CHECK((f & o) == 0);
        CHECK((f | o) != 0);
        CHECK((masks.free[octant] == f && masks.occupied[octant] == o));
        free += static_cast<std::size_t>(std::popcount(f));
        occupied += static_cast<std::size_t>(std::popcount(o));
        ++octants;
      });
      CHECK(octants > 0);
    }
    CHECK(voxels.counts() == std::pair{free, occupied});
    CHECK((marked.free == free && marked.occupied == occupied));
    integrated.integrate(points, origin);
    applied.apply(voxels);
    CHECK(ot_bytes(applied) == ot_bytes(integrated));
  }
}

TEST_CASE("a cleared scan keeps its memory and is equal to an empty one") {
  random_bits random{4};
  scan_marker marker;
  scan voxels;
  const occupancy_octree<> map{0.05};
  marker.mark(seq, map.grid(), test::shell_scan(random, 300, vec3f::Zero()), vec3f::Zero(), {}, voxels);
  CHECK_FALSE(voxels.empty());
  const scan copy = voxels;
  CHECK(copy == voxels);
  const std::size_t bytes = voxels.bytes();
  voxels.clear();
  CHECK(voxels == scan{});
  CHECK_FALSE(copy == voxels);
  CHECK(voxels.bytes() == bytes);
  CHECK(voxels.counts() == std::pair<std::size_t, std::size_t>{0, 0});
}
