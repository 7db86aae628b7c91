// SPDX-License-Identifier: BSD-3-Clause
//
// The statistical filter against PCL itself, where it is installed.
#ifdef ORBIS_TEST_WITH_PCL
#include <cstdint>
#include <vector>

#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <orbis/cloud/statistical.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

namespace {

std::vector<std::uint32_t> pcl_inliers(const orbis::test::points& points, int k, double alpha) {
  const auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const auto& p : points) cloud->push_back({p.x(), p.y(), p.z()});
  cloud->is_dense = false;
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setMeanK(k);
  filter.setStddevMulThresh(alpha);
  std::vector<int> kept;
  filter.filter(kept);
  return {kept.begin(), kept.end()};
}

}  // namespace

TEST_CASE("the statistical filter selects the points that PCL selects") {
  auto clouds = orbis::test::all_clouds();
  clouds.emplace_back("large room", orbis::test::room_cloud(160, 120, 0.002, 3));
  clouds.emplace_back("large uniform", orbis::test::uniform_cloud(20'000, 4, 10.0));
  for (const auto& [name, cloud] : clouds) {
    if (cloud.size() < 2 || name == "none finite") continue;  // PCL's search has nothing to search
    for (const int k : {1, 10, 50}) {
      for (const double alpha : {0.5, 1.0, 2.0}) {
        INFO(name << " k " << k << " alpha " << alpha);
        CHECK(orbis::cloud::statistical_inliers(orbis::par, cloud,
                                                {.neighbors = static_cast<std::size_t>(k),
                                                 .sigma_multiplier = alpha,
                                                 .non_finite = orbis::cloud::non_finite::keep}) ==
              pcl_inliers(cloud, k, alpha));
      }
    }
  }
}

TEST_CASE("PCL's points are filtered in place") {
  pcl::PointCloud<pcl::PointXYZRGB> cloud;
  for (const auto& p : orbis::test::uniform_cloud(400, 9)) {
    pcl::PointXYZRGB q;
    q.x = p.x();
    q.y = p.y();
    q.z = p.z();
    cloud.push_back(q);
  }
  CHECK(orbis::cloud::statistical_inliers(orbis::seq, cloud, {.neighbors = 8}) ==
        orbis::cloud::statistical_inliers(orbis::seq, orbis::test::uniform_cloud(400, 9), {.neighbors = 8}));
}
#endif
