// SPDX-License-Identifier: BSD-3-Clause
//
// The frontier of a recording's map: kept up to date frame by frame, made from nothing, and, beside these, by asking
// for the six neighbours of every free voxel, of our map and of OctoMap's.
#include <cstddef>
#include <cstdint>
#include <ctime>
#include <string>
#include <utility>
#include <vector>

#include <orbis/nav/frontiers.hpp>

#include "octree/insertion.hpp"
#include "octree/peers.hpp"

namespace orbis::bench {
namespace {

void bench_update(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  for (auto _ : state) {
    map m{resolution};
    m.track_changes();
    nav::frontiers frontiers{m};
    std::vector<double> seconds;
    for (const scan& s : scans) {
      m.integrate(s.depth_metres(), s.camera, s.T_world_camera, {.max_range = 5.0});
      const std::clock_t start = std::clock();
      frontiers.update(m);
      seconds.push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }
    state.counters["voxels"] = static_cast<double>(frontiers.size());
    state.counters["MB"] = 1e-6 * static_cast<double>(frontiers.memory_bytes());
    report_frames(state, std::move(seconds));
  }
}
void bench_afresh(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  for (auto _ : state) state.counters["voxels"] = static_cast<double>(nav::frontiers{m}.size());
}
void bench_clusters(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const nav::frontiers frontiers{whole_map(scans, resolution)};
  for (auto _ : state) state.counters["clusters"] = static_cast<double>(frontiers.clusters({.min_size = 10}).size());
}

/// The free voxels with a neighbour of which `is_known(x, y, z)` says no.
template <class IsKnown>
bool is_frontier(std::uint32_t x, std::uint32_t y, std::uint32_t z, IsKnown&& is_known) {
  return !is_known(x - 1, y, z) || !is_known(x + 1, y, z) || !is_known(x, y - 1, z) || !is_known(x, y + 1, z) ||
         !is_known(x, y, z - 1) || !is_known(x, y, z + 1);
}
void bench_brute_force(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  std::size_t found = 0;
  for (auto _ : state) {
    found = 0;
    auto near = m.accessor();
    const auto is_known = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      return near.value(octree::voxel_key{x, y, z}).has_value();
    };
    m.for_each_leaf([&](const auto& leaf) {
      if (leaf.occupied) return;
      const std::uint32_t size = octree::node_cells(m.tree_depth() - leaf.depth);
      for (std::uint32_t z = leaf.key.z; z != leaf.key.z + size; ++z)
        for (std::uint32_t y = leaf.key.y; y != leaf.key.y + size; ++y)
          for (std::uint32_t x = leaf.key.x; x != leaf.key.x + size; ++x) found += is_frontier(x, y, z, is_known);
    });
  }
  if (found != nav::frontiers{m}.size()) state.SkipWithError("not the same frontier");
  state.counters["voxels"] = static_cast<double>(found);
}
void bench_octomap(benchmark::State& state, const std::vector<scan>& scans, double resolution) {
  const map m = whole_map(scans, resolution);
  const octomap::OcTree tree = to_octomap(m);
  std::size_t found = 0;
  for (auto _ : state) {
    found = 0;
    const auto is_known = [&](std::uint32_t x, std::uint32_t y, std::uint32_t z) {
      return tree.search(octomap::OcTreeKey{static_cast<octomap::key_type>(x), static_cast<octomap::key_type>(y),
                                            static_cast<octomap::key_type>(z)}) != nullptr;
    };
    for (auto it = tree.begin_leafs(); it != tree.end_leafs(); ++it) {
      if (tree.isNodeOccupied(*it)) continue;
      const octomap::OcTreeKey low = it.getIndexKey();
      const std::uint32_t size = std::uint32_t{1} << (tree.getTreeDepth() - it.getDepth());
      for (std::uint32_t z = low[2]; z != low[2] + size; ++z)
        for (std::uint32_t y = low[1]; y != low[1] + size; ++y)
          for (std::uint32_t x = low[0]; x != low[0] + size; ++x) found += is_frontier(x, y, z, is_known);
    }
  }
  if (found != nav::frontiers{m}.size()) state.SkipWithError("not the same frontier");
  state.counters["voxels"] = static_cast<double>(found);
}

[[maybe_unused]] const bool registered = [] {
  for_each_world("nav_frontiers", [](const std::string& group, const std::vector<scan>& (*scans)(), double resolution) {
    timed_by_itself(add_row(group + "/update/orbis", [=](auto& s) { bench_update(s, scans(), resolution); }), 3);
    add_row(group + "/afresh/orbis", [=](auto& s) { bench_afresh(s, scans(), resolution); });
    add_row(group + "/afresh/brute_force", [=](auto& s) { bench_brute_force(s, scans(), resolution); });
    add_row(group + "/afresh/octomap", [=](auto& s) { bench_octomap(s, scans(), resolution); });
    add_row(group + "/clusters/orbis", [=](auto& s) { bench_clusters(s, scans(), resolution); });
  });
  return true;
}();

}  // namespace
}  // namespace orbis::bench
