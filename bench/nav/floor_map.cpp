// SPDX-License-Identifier: BSD-3-Clause
//
// The floor map of a recording's map, made from nothing, beside the projection of a height band by iterating over an
// OctoMap's leaves, as A. Hornung et al. describe it ("OctoMap", Autonomous Robots 34, 2013): that marks columns that
// hold something, and knows nothing of steps, slopes and holes.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <orbis/nav/floor_cost.hpp>
#include <orbis/nav/floor_map.hpp>

#include "octree/insertion.hpp"
#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

constexpr nav::ground_robot robot{.radius = 0.2, .height = 0.6, .step = 0.05};

/// How high the floor is that rows look at: that of the map, or the most common height if none is found.
double floor_of(const map& m) { return nav::find_floor(m).value_or(0.0); }

void bench_floor_map(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  const nav::floor_map_options options{.floor = floor_of(m)};
  std::size_t cells = 0;
  for (auto _ : state) cells = nav::make_floor_map(m, robot, options).value().states.pixels().size();
  state.counters["cells"] = static_cast<double>(cells);
}
void bench_find_floor(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  for (auto _ : state) benchmark::DoNotOptimize(nav::find_floor(m));
}
void bench_inflate(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  const nav::floor_map floor = nav::make_floor_map(m, robot, {.floor = floor_of(m)}).value();
  for (auto _ : state) benchmark::DoNotOptimize(nav::inflate(floor).data());
}
void bench_projection_octomap(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  const octomap::OcTree tree = to_octomap(m);
  const double low = floor_of(m) + robot.step, high = floor_of(m) + robot.height;
  for (auto _ : state) {
    double x0 = 0, y0 = 0, z0 = 0, x1 = 0, y1 = 0, z1 = 0;
    tree.getMetricMin(x0, y0, z0);
    tree.getMetricMax(x1, y1, z1);
    const octomap::OcTreeKey low_key = tree.coordToKey(x0, y0, z0), high_key = tree.coordToKey(x1, y1, z1);
    image<std::int8_t> cells(high_key[0] - low_key[0] + 1, high_key[1] - low_key[1] + 1, -1);
    for (auto it = tree.begin_leafs(); it != tree.end_leafs(); ++it) {
      const double half = it.getSize() / 2;
      if (it.getZ() + half <= low || it.getZ() - half >= high) continue;
      const bool occupied = tree.isNodeOccupied(*it);
      const int n = 1 << (tree.getTreeDepth() - it.getDepth());
      const octomap::OcTreeKey at = it.getIndexKey();
      for (int y = 0; y != n; ++y)
        for (int x = 0; x != n; ++x) {
          const int u = at[0] - low_key[0] + x, v = at[1] - low_key[1] + y;
          if (!cells.view().contains(u, v)) continue;
          cells(u, v) = std::max(cells(u, v), static_cast<std::int8_t>(occupied ? 100 : 0));
        }
    }
    benchmark::DoNotOptimize(cells.data());
  }
}

[[maybe_unused]] const bool registered = [] {
  for_each_world("nav_floor", [](const std::string& group, const std::vector<scan>& (*scans)(), double resolution) {
    add_row(group + "/map/orbis", [=](auto& s) { bench_floor_map(s, scans(), resolution); });
    add_row(group + "/map/octomap_projection", [=](auto& s) { bench_projection_octomap(s, scans(), resolution); });
    add_row(group + "/find_floor/orbis", [=](auto& s) { bench_find_floor(s, scans(), resolution); });
    add_row(group + "/inflate/orbis", [=](auto& s) { bench_inflate(s, scans(), resolution); });
  });
  return true;
}();

}  // namespace
}  // namespace orbis::bench
