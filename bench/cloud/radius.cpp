// SPDX-License-Identifier: BSD-3-Clause
//
// The radius filter beside PCL's.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#ifdef ORBIS_BENCH_WITH_PCL
#include <pcl/filters/radius_outlier_removal.h>
#endif

#include <orbis/cloud/radius.hpp>
#include <orbis/core/execution.hpp>

#include "cloud/peers.hpp"

namespace orbis::bench {
namespace {

using indices = std::vector<std::uint32_t>;

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

[[maybe_unused]] const bool registered = [] {
  for (const bool shuffled : {false, true}) {
    add_radius(300'000, shuffled, {.radius = 0.02, .min_neighbors = 5});
    add_radius(300'000, shuffled, {.radius = 0.05, .min_neighbors = 50});
  }
  return true;
}();

}  // namespace
}  // namespace orbis::bench
