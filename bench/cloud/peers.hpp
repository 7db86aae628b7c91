// SPDX-License-Identifier: BSD-3-Clause
//
// What the benchmarks of clouds share: the clouds, and the peers' types.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <benchmark/benchmark.h>
#include <nanoflann.hpp>

#ifdef ORBIS_BENCH_WITH_PCL
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#endif

#include <orbis/core/types.hpp>

#include "support/heap.hpp"

namespace orbis::bench {

using points = std::vector<vec3f>;

/// A room seen by a depth camera from several places, image after image: walls, floor, boxes, noise
/// that grows with range, one point in a hundred anywhere. Clouds are made when first asked for,
/// and kept.
[[nodiscard]] const points& room_cloud(std::size_t n);
/// The same points in no order, as a k-d tree or a hash may hand them out.
[[nodiscard]] const points& shuffled_cloud(std::size_t n);
/// Points anywhere in a box of 5 x 2.6 x 4 m.
[[nodiscard]] const points& uniform_cloud(std::size_t n);
/// One point, n times.
[[nodiscard]] const points& identical_cloud(std::size_t n);
/// Five frames of a real kitchen, merged: about 300,000 points.
[[nodiscard]] const points& kitchen_cloud();
/// Frames of it at full resolution, one after another in the order of their pixels: n points.
[[nodiscard]] const points& kitchen_scans(std::size_t n);
[[nodiscard]] const points& shuffled_kitchen_scans(std::size_t n);
[[nodiscard]] bool have_kitchen_cloud();

/// A cloud for nanoflann.
struct nanoflann_points {
  const points* cloud;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return cloud->size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t i, std::size_t a) const {
    return (*cloud)[i][static_cast<Eigen::Index>(a)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};
using nanoflann_tree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, nanoflann_points>, nanoflann_points, 3>;

#ifdef ORBIS_BENCH_WITH_PCL
/// The cloud as PCL's, a copy that is kept.
[[nodiscard]] const pcl::PointCloud<pcl::PointXYZ>::Ptr& pcl_cloud(const points& cloud);
#endif

/// A row of somebody who computes a `Result` for a cloud. Before the first measurement its result is
/// compared with `is_right`; the heap that this first call takes at its peak is shown per point.
template <class Result>
benchmark::internal::Benchmark* add_cloud_row(const std::string& name, std::function<const points&()> cloud,
                                              std::function<Result(const points&)> compute,
                                              std::function<bool(const points&, const Result&)> is_right);

}  // namespace orbis::bench

template <class Result>
benchmark::internal::Benchmark* orbis::bench::add_cloud_row(
    const std::string& name, std::function<const points&()> cloud, std::function<Result(const points&)> compute,
    std::function<bool(const points&, const Result&)> is_right) {
  struct first_call {
    bool made = false;
    bool right = false;
    double bytes_per_point = 0;
  };
  const auto first = std::make_shared<first_call>();
  return benchmark::RegisterBenchmark(name.c_str(),
                                      [=](benchmark::State& state) {
                                        const points& in = cloud();
                                        if (!first->made) {
                                          Result result;
                                          const std::size_t peak = peak_heap([&] { result = compute(in); });
                                          first->bytes_per_point =
                                              static_cast<double>(peak) / static_cast<double>(in.size());
                                          first->right = is_right(in, result);
                                          first->made = true;
                                        }
                                        if (!first->right) {
                                          state.SkipWithError("has another result");
                                          return;
                                        }
                                        for (auto _ : state) benchmark::DoNotOptimize(compute(in));
                                        state.counters["bytes_per_point"] = first->bytes_per_point;
                                      })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}
