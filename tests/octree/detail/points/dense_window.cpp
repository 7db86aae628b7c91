// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/dense_window.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

/// Whether both hold the same free voxels.
[[nodiscard]] bool same_free(scan_masks a, scan_masks b) {
  for (const scan_brick& s : std::vector<scan_brick>(a.bricks()))
    if (b.at(named_key(s.name)).free != s.free) return false;
  for (const scan_brick& s : std::vector<scan_brick>(b.bricks()))
    if (a.at(named_key(s.name)).free != s.free) return false;
  return true;
}

/// The rays of a group, one after the other.
void one_by_one(std::uint8_t* cells, std::int64_t start, const traversal_lanes& r) {
  for (std::size_t i = 0; i != traversal_lanes::width; ++i) {
    double x = r.next[0][i], y = r.next[1][i], z = r.next[2][i];
    for (std::int64_t at = start;;) {
      const bool along_x = x < y && x < z, along_y = !(x < y) && y < z;
      if (along_x) {
        at += r.stride[0][i];
        x += r.delta[0][i];
      } else if (along_y) {
        at += r.stride[1][i];
        y += r.delta[1][i];
      } else {
        at += r.stride[2][i];
        z += r.delta[2][i];
      }
      if (at == r.end[i] || std::min(std::min(x, y), z) > r.reach[i]) break;
      cells[at] = 1;
    }
  }
}

}  // namespace

TEST_CASE("Rays marked in a window cross the voxels that rays walked one by one cross") {
  random_bits random{71};
  dense_window window;
  for (const double resolution : {0.02, 0.05, 0.1}) {
    const voxel_grid grid{resolution};
    for (int run = 0; run != 30; ++run) {
      // Half of the ends on voxel faces, so that ties occur; any number of rays left over.
      auto ends = test::random_points(random, 101 + random.below(16), 1.5);
      vec3f origin = test::random_points(random, 1, 0.5)[0];
      const auto snap = [&](float& c) { c = static_cast<float>(std::round(c / resolution) * resolution); };
      if (run % 3 == 0) snap(origin.x()), snap(origin.y());
      for (std::size_t i = 0; i < ends.size(); i += 2) snap(ends[i].x()), snap(ends[i].y()), snap(ends[i].z());
      ends.push_back(origin);
      ends.emplace_back(origin + vec3f{0.7F, 0.0F, 0.0F});
      ends.emplace_back(origin + vec3f{0.0F, -0.7F, 0.0F});

      const voxel_key from = *grid.key(origin);
      REQUIRE(window.fit(grid, from, *grid.key(vec3f::Constant(-2.0F)), *grid.key(vec3f::Constant(2.0F))));
      scan_masks walked, marked;
      for (const vec3f& end : ends) {
        walked.mark_ray(grid, coordinates<float>(origin), from, coordinates<float>(end), *grid.key(end));
        window.add(grid, coordinates<float>(origin), coordinates<float>(end), *grid.key(end));
      }
      window.flush(marked);
      REQUIRE(same_free(walked, marked));
    }
  }
  scan_masks nothing;
  REQUIRE(window.fit(voxel_grid{0.1}, {32768, 32768, 32768}, {32768, 32768, 32768}, {32768, 32768, 32768}));
  window.flush(nothing);
  CHECK(nothing.bricks().empty());
}

TEST_CASE("Every instruction set marks the same cells") {
  random_bits random{72};
  const voxel_grid grid{0.05};
  for (int run = 0; run != 300; ++run) {
    constexpr std::int64_t n = 128, start = (n * n + n + 1) * (n / 2);
    octree::detail::traversal_lanes lanes{};
    const float3 origin{0.01F, 0.02F, 0.03F};
    const voxel_key from = *grid.key(origin);
    for (std::size_t i = 0; i != octree::detail::traversal_lanes::width; ++i) {
      vec3f end = test::random_points(random, 1, 2.5)[0];
      if (run % 3 == 0) end[static_cast<int>(i % 3)] = origin[i % 3];
      const auto to = *grid.key(end);
      const auto ray = ray_traversal::between(grid, from, origin, coordinates<float>(end));
      REQUIRE(ray);
      const std::array<std::int64_t, 3> stride{1, n, n * n};
      for (std::size_t axis = 0; axis != 3; ++axis) {
        lanes.next[axis][i] = ray->next[axis];
        lanes.delta[axis][i] = ray->delta[axis];
        lanes.stride[axis][i] = ray->step[axis] * stride[axis];
      }
      lanes.reach[i] = ray->reach;
      lanes.end[i] = start + (std::int64_t{to.z} - from.z) * n * n + (std::int64_t{to.y} - from.y) * n +
                     (std::int64_t{to.x} - from.x);
    }
    const auto marks = [&](auto* mark) {
      std::vector<std::uint8_t> cells(n * n * n);
      cells[start] = 1;  // where rays that have ended may mark
      mark(cells.data(), start, lanes);
      return cells;
    };
    const auto expected = marks(one_by_one);
    for (const simd::level level : simd::available_levels())
      REQUIRE(marks(simd::kernel<traverse_lanes_kernel, void(std::uint8_t*, std::int64_t, const traversal_lanes&)>(
                  level)) == expected);
    REQUIRE(expected[start] == 1);
  }
}

TEST_CASE("A window that would be too large or reach the border of the grid is refused") {
  const voxel_grid grid{0.1};
  dense_window window;
  const voxel_key from{32768, 32768, 32768};
  CHECK(window.fit(grid, from, from, {32968, 32968, 32968}));
  CHECK_FALSE(window.fit(grid, from, from, {65535, 32768, 32768}));
  CHECK_FALSE(window.fit(grid, from, {1, 32768, 32768}, from));
  CHECK_FALSE(window.fit(grid, from, {30000, 30000, 30000}, {34000, 34000, 34000}));
}
