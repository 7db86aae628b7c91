// SPDX-License-Identifier: BSD-3-Clause
//
// The voxel grid beside sorting and PCL's.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#ifdef ORBIS_BENCH_WITH_PCL
#include <pcl/filters/voxel_grid.h>
#endif

#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/core/execution.hpp>

#include "cloud/peers.hpp"

namespace orbis::bench {
namespace {

/// How downsampling by sorting works (as in small_gicp, Koide, JOSS 2024): three cells of 21 bits make a key of 64,
/// keys with their points are sorted, the points of equal keys averaged.
[[nodiscard]] std::size_t voxels_by_sorting(const points& cloud, double size) {
  struct keyed {
    std::uint64_t key;
    std::uint32_t index;
  };
  constexpr int bits = 21;
  std::vector<keyed> order(cloud.size());
  for (std::uint32_t i = 0; i != cloud.size(); ++i) {
    order[i] = {0, i};
    for (int a = 0; a != 3; ++a) {
      const auto cell = static_cast<std::int64_t>(std::floor(cloud[i][a] * (1 / size))) + (1 << (bits - 1));
      order[i].key |= (static_cast<std::uint64_t>(cell) & ((1U << bits) - 1)) << (bits * a);
    }
  }
  std::sort(order.begin(), order.end(), [](const keyed& a, const keyed& b) { return a.key < b.key; });
  points centroids;
  for (std::size_t from = 0, to = 0; from != order.size(); from = to) {
    vec3 sum = vec3::Zero();
    for (; to != order.size() && order[to].key == order[from].key; ++to) sum += cloud[order[to].index].cast<double>();
    centroids.emplace_back((sum / static_cast<double>(to - from)).cast<float>());
  }
  return centroids.size();
}

void add_voxel_grid(const std::string& name, const std::function<const points&()>& cloud, double size) {
  const auto add = [&](const std::string& row, const std::function<std::size_t(const points&)>& count) {
    add_cloud_row<std::size_t>("voxel_grid" + name + "/" + std::to_string(std::lround(100 * size)) + "cm/" + row, cloud,
                               count,
                               // Points within a rounding error of a border may fall to either side of it.
                               [size](const points& in, std::size_t found) {
                                 const auto ours = static_cast<double>(cloud::voxel_grid(in, {.size = size}).size());
                                 return std::abs(static_cast<double>(found) - ours) < 1e-3 * ours;
                               });
  };
  add("orbis", [size](const points& in) { return cloud::voxel_grid(in, {.size = size}).size(); });
  add("orbis_par2", [size](const points& in) { return cloud::voxel_grid(par.with(2), in, {.size = size}).size(); });
  add("sorting", [size](const points& in) { return voxels_by_sorting(in, size); });
#ifdef ORBIS_BENCH_WITH_PCL
  add("pcl", [size](const points& in) {
    pcl::VoxelGrid<pcl::PointXYZ> grid;
    const auto leaf = static_cast<float>(size);
    grid.setLeafSize(leaf, leaf, leaf);
    grid.setInputCloud(pcl_cloud(in));
    pcl::PointCloud<pcl::PointXYZ> out;
    grid.filter(out);
    return out.size();
  });
#endif
}

[[maybe_unused]] const bool registered = [] {
  for (const std::size_t n : {100'000U, 1'000'000U, 3'000'000U}) {
    for (const double size : {0.01, 0.05, 0.1}) {
      const std::string suffix = "/n:" + std::to_string(n);
      add_voxel_grid(
          "_uniform" + suffix, [n]() -> const points& { return uniform_cloud(n); }, size);
      if (!have_kitchen_cloud()) continue;
      add_voxel_grid(
          "_kitchen" + suffix, [n]() -> const points& { return kitchen_scans(n); }, size);
      add_voxel_grid(
          "_kitchen_shuffled" + suffix, [n]() -> const points& { return shuffled_kitchen_scans(n); }, size);
    }
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench
