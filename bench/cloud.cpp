// SPDX-License-Identifier: BSD-3-Clause
//
// The statistical filter beside a plain nanoflann loop and PCL, all with the same result.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <benchmark/benchmark.h>
#include <nanoflann.hpp>

#ifdef ORBIS_BENCH_WITH_PCL
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#endif

#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>

namespace {

using points = std::vector<orbis::vec3f>;

/// A room seen by a depth camera from several places, image after image: walls, floor, boxes, noise
/// that grows with range, one point in a hundred anywhere.
const points& room(std::size_t n) {
  static std::deque<points> made;
  for (const points& p : made) {
    if (p.size() == n) return p;
  }
  orbis::random_bits random{n};
  constexpr std::size_t views = 6;
  const auto width = static_cast<int>(std::sqrt(static_cast<double>(n) / views * 4 / 3)) + 1;
  points out;
  out.reserve(n);
  for (std::size_t view = 0; out.size() != n; ++view) {
    const double angle = 0.35 * static_cast<double>(view);
    const orbis::vec3 origin{0.2 * std::cos(angle), 0.1 * std::sin(2 * angle), 0.2 * std::sin(angle)};
    for (int i = 0; i < width * width * 3 / 4 && out.size() != n; ++i) {
      const double u = (i % width - 0.5 * width) / (0.82 * width);
      const double v = (static_cast<double>(i) / width - 0.375 * width) / (0.82 * width);
      orbis::vec3 ray{u * std::cos(angle) + std::sin(angle), v, std::cos(angle) - u * std::sin(angle)};
      double t = 1e9;
      const orbis::vec3 half{2.5, 1.3, 2.0};
      for (int a = 0; a != 3; ++a) {
        if (ray[a] != 0) t = std::min(t, (std::copysign(half[a], ray[a]) - origin[a]) / ray[a]);
      }
      if (std::sin(5 * angle + 9 * u) > 0.8 && v > 0) t *= 0.7;  // furniture
      t += 0.002 * t * t * random.normal();
      if (random.below(100) == 0) t *= random.uniform();
      out.emplace_back((origin + t * ray).cast<float>());
    }
  }
  return made.emplace_back(std::move(out));
}

/// The same points in no order, as a k-d tree or a hash may hand them out.
const points& shuffled_room(std::size_t n) {
  static std::deque<points> made;
  for (const points& p : made) {
    if (p.size() == n) return p;
  }
  points out = room(n);
  orbis::random_bits random{n + 1};
  for (std::size_t i = n; i-- > 1;) std::swap(out[i], out[random.below(static_cast<std::uint32_t>(i + 1))]);
  return made.emplace_back(std::move(out));
}

struct adaptor {
  const points* cloud;
  std::size_t kdtree_get_point_count() const { return cloud->size(); }
  float kdtree_get_pt(std::size_t i, std::size_t a) const { return (*cloud)[i][static_cast<Eigen::Index>(a)]; }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// As a user of nanoflann would write it.
std::vector<std::uint32_t> plain_nanoflann(const points& cloud, std::size_t k, double alpha) {
  const adaptor data{&cloud};
  using tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, adaptor>, adaptor, 3>;
  const tree index(3, data, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  std::vector<std::uint32_t> found(k + 1);
  std::vector<float> squared(k + 1);
  std::vector<float> means(cloud.size());
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    const std::size_t n = index.knnSearch(cloud[i].data(), k + 1, found.data(), squared.data());
    double d = 0;
    for (std::size_t j = 1; j < n; ++j) d += std::sqrt(static_cast<double>(squared[j]));
    means[i] = static_cast<float>(d / static_cast<double>(n - 1));
    sum += means[i];
    squares += means[i] * means[i];
  }
  const auto n = static_cast<double>(cloud.size());
  const double threshold = sum / n + alpha * std::sqrt((squares - sum * sum / n) / (n - 1));
  std::vector<std::uint32_t> inliers;
  for (std::size_t i = 0; i != means.size(); ++i) {
    if (!(means[i] > threshold)) inliers.push_back(static_cast<std::uint32_t>(i));
  }
  return inliers;
}

#ifdef ORBIS_BENCH_WITH_PCL
std::vector<std::uint32_t> by_pcl(const pcl::PointCloud<pcl::PointXYZ>::Ptr& cloud, std::size_t k, double alpha) {
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setMeanK(static_cast<int>(k));
  filter.setStddevMulThresh(alpha);
  std::vector<int> kept;
  filter.filter(kept);
  return {kept.begin(), kept.end()};
}
#endif

/// Measures `filter()`, after checking that it selects what ours selects.
template <class Filter>
void measure(benchmark::State& state, const points& cloud, std::size_t k, Filter&& filter) {
  if (filter() != orbis::cloud::statistical_inliers(orbis::par, cloud, {.neighbors = k})) {
    state.SkipWithError("selects other points");
    return;
  }
  for (auto _ : state) benchmark::DoNotOptimize(filter());
}

/// One size of cloud and neighbourhood, everyone's filter.
void add_statistical(std::size_t n, std::size_t k, bool shuffled) {
  auto* const make = shuffled ? shuffled_room : room;
  const std::string group = std::string{shuffled ? "statistical_filter_shuffled" : "statistical_filter"} +
                            "/n:" + std::to_string(n) + "/k:" + std::to_string(k) + "/";
  const auto add = [&](const std::string& who, auto filter) {
    benchmark::RegisterBenchmark(
        (group + who).c_str(),
        [=](benchmark::State& state) { measure(state, make(n), k, [&] { return filter(make(n)); }); })
        ->Unit(benchmark::kMillisecond)
        ->UseRealTime();
  };
  add("orbis",
      [k](const points& cloud) { return orbis::cloud::statistical_inliers(orbis::seq, cloud, {.neighbors = k}); });
  add("orbis_par2", [k](const points& cloud) {
    return orbis::cloud::statistical_inliers(orbis::par.with(2), cloud, {.neighbors = k});
  });
  add("nanoflann", [k](const points& cloud) { return plain_nanoflann(cloud, k, 1.0); });
#ifdef ORBIS_BENCH_WITH_PCL
  add("pcl", [k](const points& cloud) {
    static const points* copied = nullptr;
    static pcl::PointCloud<pcl::PointXYZ>::Ptr copy;
    if (copied != &cloud) {
      copied = &cloud;
      copy = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
      for (const auto& p : cloud) copy->push_back({p.x(), p.y(), p.z()});
    }
    return by_pcl(copy, k, 1.0);
  });
#endif
}

const bool registered = [] {
  for (const std::size_t n : {10'000U, 100'000U, 300'000U, 1'000'000U}) {
    for (const std::size_t k : {8U, 20U, 50U, 100U}) add_statistical(n, k, false);
    add_statistical(n, 50, true);
  }
  for (const std::size_t k : {5U, 200U}) add_statistical(100'000, k, false);
  benchmark::RegisterBenchmark("select_filter/n:300000/orbis",
                               [](benchmark::State& state) {
                                 for (auto _ : state)
                                   benchmark::DoNotOptimize(orbis::cloud::select_filter(orbis::seq, room(300'000)));
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
  benchmark::RegisterBenchmark("voxel_grid/n:300000/5cm/orbis",
                               [](benchmark::State& state) {
                                 for (auto _ : state)
                                   benchmark::DoNotOptimize(orbis::cloud::voxel_grid(room(300'000), {.size = 0.05}));
                               })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
  return true;
}();

}  // namespace
