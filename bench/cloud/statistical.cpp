// SPDX-License-Identifier: BSD-3-Clause
//
// The statistical filter beside a plain nanoflann loop and PCL, all with the same result.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#ifdef ORBIS_BENCH_WITH_PCL
#include <pcl/filters/statistical_outlier_removal.h>
#endif

#include <orbis/cloud/statistical.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/simd.hpp>

#include "cloud/peers.hpp"

namespace orbis::bench {
namespace {

using indices = std::vector<std::uint32_t>;

/// As a user of nanoflann would write it, with the search in parallel where asked for.
[[nodiscard]] indices by_nanoflann(const points& cloud, std::size_t k, unsigned threads) {
  const nanoflann_points data{&cloud};
  const nanoflann_tree index(3, data, nanoflann::KDTreeSingleIndexAdaptorParams(10));
  std::vector<float> means(cloud.size());
  for_each_chunk(par.with(threads), cloud.size(), 4096, [&](std::size_t begin, std::size_t end) {
    std::vector<std::uint32_t> found(k + 1);
    std::vector<float> squared(k + 1);
    for (std::size_t i = begin; i != end; ++i) {
      const std::size_t n = index.knnSearch(cloud[i].data(), k + 1, found.data(), squared.data());
      double d = 0;
      for (std::size_t j = 1; j < n; ++j) d += std::sqrt(static_cast<double>(squared[j]));
      means[i] = static_cast<float>(d / static_cast<double>(n - 1));
    }
  });
  double sum = 0;
  double squares = 0;
  for (const float d : means) {
    sum += d;
    squares += d * d;
  }
  const auto n = static_cast<double>(cloud.size());
  const double threshold = sum / n + std::sqrt((squares - sum * sum / n) / (n - 1));
  indices inliers;
  for (std::size_t i = 0; i != means.size(); ++i) {
    if (!(means[i] > threshold)) inliers.push_back(static_cast<std::uint32_t>(i));
  }
  return inliers;
}

/// The filter with the inner loops for one instruction set.
[[nodiscard]] indices at_level(simd::level level, const points& cloud, std::size_t k) {
  const simd::level_limit limit{level};
  const auto decided = cloud::statistical_decision(cloud::all_mean_knn_distance(seq, cloud, k), {.neighbors = k});
  indices inliers;
  for (std::size_t i = 0; i != cloud.size(); ++i) {
    if (!(decided.mean_distance[i] > decided.threshold)) inliers.push_back(static_cast<std::uint32_t>(i));
  }
  return inliers;
}

#ifdef ORBIS_BENCH_WITH_PCL
[[nodiscard]] indices by_pcl(const points& cloud, std::size_t k) {
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(pcl_cloud(cloud));
  filter.setMeanK(static_cast<int>(k));
  filter.setStddevMulThresh(1.0);
  std::vector<int> kept;
  filter.filter(kept);
  return {kept.begin(), kept.end()};
}
#endif

enum class who { all, ours, every_level };

/// One cloud and one k, everyone's filter.
void add_statistical(const std::string& name, const std::function<const points&()>& cloud, std::size_t n, std::size_t k,
                     who asked) {
  const auto add = [&](const std::string& row, const std::function<indices(const points&)>& filter) {
    auto* const added = add_cloud_row<indices>(name + "/k:" + std::to_string(k) + "/" + row, cloud, filter,
                                               [k](const points& in, const indices& kept) {
                                                 return kept == cloud::statistical_inliers(par, in, {.neighbors = k});
                                               });
    if (n > 500'000) added->Iterations(1);
    if (n > 500'000 && !row.starts_with("orbis")) added->Repetitions(1);  // half a minute each
  };
  add("orbis", [k](const points& in) { return cloud::statistical_inliers(seq, in, {.neighbors = k}); });
  add("orbis_par2", [k](const points& in) { return cloud::statistical_inliers(par.with(2), in, {.neighbors = k}); });
  if (asked == who::ours) return;
  if (asked == who::every_level) {
    add("orbis_avx2", [k](const points& in) { return at_level(simd::level::avx2, in, k); });
    add("orbis_portable", [k](const points& in) { return at_level(simd::level::portable, in, k); });
  }
  add("nanoflann", [k](const points& in) { return by_nanoflann(in, k, 1); });
  add("nanoflann_par2", [k](const points& in) { return by_nanoflann(in, k, 2); });
#ifdef ORBIS_BENCH_WITH_PCL
  add("pcl", [k](const points& in) { return by_pcl(in, k); });
#endif
}

[[maybe_unused]] const bool registered = [] {
  const auto sorted = [](std::size_t n, std::size_t k, who asked) {
    add_statistical(
        "statistical_filter/n:" + std::to_string(n), [n]() -> const points& { return room_cloud(n); }, n, k, asked);
  };
  const auto shuffled = [](std::size_t n, std::size_t k, who asked) {
    add_statistical(
        "statistical_filter_shuffled/n:" + std::to_string(n), [n]() -> const points& { return shuffled_cloud(n); }, n,
        k, asked);
  };
  for (const std::size_t k : {5U, 20U, 100U, 200U}) sorted(100'000, k, who::every_level);
  for (const std::size_t k : {10U, 50U}) {
    for (const std::size_t n : {10'000U, 100'000U, 300'000U}) sorted(n, k, who::every_level);
    sorted(1'000'000, k, who::all);
    sorted(10'000'000, k, who::ours);
    if (have_kitchen_cloud())
      add_statistical(
          "statistical_filter/kitchen", []() -> const points& { return kitchen_cloud(); }, 0, k, who::every_level);
  }
  for (const std::size_t n : {10'000U, 100'000U, 300'000U, 1'000'000U}) shuffled(n, 50, who::all);
  add_statistical(
      "statistical_filter/identical:20000", []() -> const points& { return identical_cloud(20'000); }, 0, 50, who::all);
  add_statistical(
      "statistical_filter/identical:1000000", []() -> const points& { return identical_cloud(1'000'000); }, 1'000'000,
      50, who::ours);
  return true;
}();

}  // namespace
}  // namespace orbis::bench
