// SPDX-License-Identifier: BSD-3-Clause
//
// Neighbours of all points, the radius filter, the voxel grid and the choice of a filter.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#ifdef ORBIS_BENCH_WITH_PCL
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/voxel_grid.h>
#endif

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/core/execution.hpp>

#include "cloud_support.hpp"

namespace orbis::bench {
namespace {

using indices = std::vector<std::uint32_t>;

// -- the k nearest neighbours of every point ----------------------------------------------------------

/// Row after row, nearest first, the point itself left out.
using neighbor_rows = std::vector<cloud::neighbor<float>>;

[[nodiscard]] neighbor_rows neighbors_by_nanoflann(const points& cloud, std::size_t k, unsigned threads) {
  const nanoflann_points data{&cloud};
  const nanoflann_tree index(3, data, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  neighbor_rows rows(cloud.size() * k);
  for_each_chunk(par.with(threads), cloud.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> found(k + 1);
    std::vector<float> squared(k + 1);
    for (std::size_t i = begin; i != end; ++i) {
      index.knnSearch(cloud[i].data(), k + 1, found.data(), squared.data());
      for (std::size_t j = 0; j != k; ++j) rows[i * k + j] = {found[j + 1], std::sqrt(squared[j + 1])};
    }
  });
  return rows;
}

void add_neighbors(std::size_t n, std::size_t k) {
  const auto add = [&](const std::string& row, const std::function<neighbor_rows(const points&)>& search) {
    add_cloud_row<neighbor_rows>(
        "all_knn/n:" + std::to_string(n) + "/k:" + std::to_string(k) + "/" + row,
        [n]() -> const points& { return room_cloud(n); }, search,
        [k](const points& in, const neighbor_rows& rows) {
          const auto ours = cloud::all_knn(par, in, k).rows;  // the same distances; ties may go another way
          bool same = rows.size() == ours.size();
          for (std::size_t i = 0; same && i != rows.size(); ++i) same = rows[i].distance == ours[i].distance;
          return same;
        });
  };
  add("orbis", [k](const points& in) { return cloud::all_knn(seq, in, k).rows; });
  add("orbis_par2", [k](const points& in) { return cloud::all_knn(par.with(2), in, k).rows; });
  add("nanoflann", [k](const points& in) { return neighbors_by_nanoflann(in, k, 1); });
  add("nanoflann_par2", [k](const points& in) { return neighbors_by_nanoflann(in, k, 2); });
}

// -- the radius filter ----------------------------------------------------------------------------------

#ifdef ORBIS_BENCH_WITH_PCL
[[nodiscard]] indices radius_by_pcl(const points& cloud, const cloud::radius_options& options) {
  pcl::RadiusOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(pcl_cloud(cloud));
  filter.setRadiusSearch(options.radius);
  filter.setMinNeighborsInRadius(static_cast<int>(options.min_neighbors));
  std::vector<int> kept;
  filter.filter(kept);
  return {kept.begin(), kept.end()};
}
#endif

void add_radius(std::size_t n, bool shuffled, const cloud::radius_options& options) {
  const auto add = [&](const std::string& row, const std::function<indices(const points&)>& filter) {
    add_cloud_row<indices>(
        std::string{shuffled ? "radius_filter_shuffled" : "radius_filter"} + "/n:" + std::to_string(n) + "/" +
            std::to_string(options.min_neighbors) + "_within_" + std::to_string(std::lround(100 * options.radius)) +
            "cm/" + row,
        [=]() -> const points& { return shuffled ? shuffled_cloud(n) : room_cloud(n); }, filter,
        [options](const points& in, const indices& kept) { return kept == cloud::radius_inliers(par, in, options); });
  };
  add("orbis", [options](const points& in) { return cloud::radius_inliers(seq, in, options); });
  add("orbis_par2", [options](const points& in) { return cloud::radius_inliers(par.with(2), in, options); });
#ifdef ORBIS_BENCH_WITH_PCL
  add("pcl", [options](const points& in) { return radius_by_pcl(in, options); });
#endif
}

// -- the voxel grid -------------------------------------------------------------------------------------

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

// -- the choice of a filter -----------------------------------------------------------------------------

void add_select(std::size_t n) {
  const auto add = [&](const std::string& row, const std::function<cloud::filter_evidence(const points&)>& choose) {
    add_cloud_row<cloud::filter_evidence>(
        "select_filter/n:" + std::to_string(n) + "/" + row, [n]() -> const points& { return room_cloud(n); }, choose,
        [](const points& in, const auto& evidence) { return evidence == cloud::select_filter(seq, in).evidence; });
  };
  add("orbis", [](const points& in) { return cloud::select_filter(seq, in).evidence; });
  add("orbis_par2", [](const points& in) { return cloud::select_filter(par.with(2), in).evidence; });
}

[[maybe_unused]] const bool registered = [] {
  for (const std::size_t k : {1U, 8U, 50U}) add_neighbors(100'000, k);
  for (const bool shuffled : {false, true}) {
    add_radius(300'000, shuffled, {.radius = 0.02, .min_neighbors = 5});
    add_radius(300'000, shuffled, {.radius = 0.05, .min_neighbors = 50});
  }
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
  for (const std::size_t n : {10'000U, 300'000U}) add_select(n);
  return true;
}();

}  // namespace
}  // namespace orbis::bench
