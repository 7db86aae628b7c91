// SPDX-License-Identifier: BSD-3-Clause
//
// The filters against PCL itself, where it is installed; and one answer of PCL's that is known without.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/statistical.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

TEST_CASE("the number of points that PCL keeps of a known cloud, which never counts a point as its own neighbour") {
  // Made by arithmetic that is the same everywhere. PCL 1.13 keeps 20,653 of it. Who searches for 50
  // neighbours and lets the point be one of them keeps what 49 neighbours keep: two fewer.
  const auto cloud = orbis::test::uniform_cloud(23'760, 15);
  const auto kept = [&](std::size_t k) {
    return orbis::cloud::statistical_inliers(orbis::par, cloud, {.neighbors = k, .sigma_multiplier = 1.0}).size();
  };
  CHECK(kept(50) == 20'653);
  CHECK(kept(49) == 20'651);
}

#ifdef ORBIS_TEST_WITH_PCL
#include <pcl/console/print.h>
#include <pcl/filters/radius_outlier_removal.h>
#include <pcl/filters/statistical_outlier_removal.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <orbis/camera/cloud.hpp>
#include <orbis/io/pcd.hpp>
#include <orbis/io/recording.hpp>

#include "support/data.hpp"

namespace {

using orbis::test::points;
using indices = std::vector<std::uint32_t>;

/// An unorganised cloud: PCL searches organised ones in another way, with another result.
[[nodiscard]] pcl::PointCloud<pcl::PointXYZ>::Ptr to_pcl(const points& from) {
  auto cloud = std::make_shared<pcl::PointCloud<pcl::PointXYZ>>();
  for (const auto& p : from) cloud->push_back({p.x(), p.y(), p.z()});
  cloud->is_dense = std::all_of(from.begin(), from.end(), [](const auto& p) { return orbis::is_finite(p); });
  return cloud;
}

[[nodiscard]] indices pcl_inliers(const pcl::PointCloud<pcl::PointXYZ>::Ptr& cloud, std::size_t k, double alpha) {
  pcl::StatisticalOutlierRemoval<pcl::PointXYZ> filter;
  filter.setInputCloud(cloud);
  filter.setMeanK(static_cast<int>(k));
  filter.setStddevMulThresh(alpha);
  std::vector<int> kept;
  filter.filter(kept);
  return {kept.begin(), kept.end()};
}

void check_statistical(const std::string& name, const points& cloud, const std::vector<std::size_t>& neighbors,
                       const std::vector<double>& alphas = {0.0, 0.5, 1.0, 2.0}) {
  const auto theirs = to_pcl(cloud);
  for (const std::size_t k : neighbors) {
    for (const double alpha : alphas) {
      INFO(name << ", " << cloud.size() << " points, k " << k << " alpha " << alpha);
      const bool same =
          orbis::cloud::statistical_inliers(
              orbis::par, cloud,
              {.neighbors = k, .sigma_multiplier = alpha, .non_finite = orbis::cloud::non_finite::keep}) ==
          pcl_inliers(theirs, k, alpha);
      CHECK(same);
    }
  }
}

/// With one point in ten, in a row or alone, not a number.
[[nodiscard]] points with_holes(points cloud, std::uint64_t seed) {
  orbis::random_bits random{seed};
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (random.below(20) != 0) continue;
    for (std::uint32_t n = random.below(4) + 1; n != 0 && i < cloud.size(); --n, ++i)
      cloud[i][static_cast<Eigen::Index>(random.below(3))] = std::numeric_limits<float>::quiet_NaN();
  }
  return cloud;
}

}  // namespace

TEST_CASE("the statistical filter selects the points that PCL selects") {
  auto clouds = orbis::test::all_clouds();
  clouds.emplace_back("large room", orbis::test::room_cloud(160, 120, 0.002, 3));
  clouds.emplace_back("large uniform", orbis::test::uniform_cloud(20'000, 4, 10.0));
  clouds.emplace_back("the known cloud", orbis::test::uniform_cloud(23'760, 15));
  for (const auto& [name, cloud] : clouds) {
    if (cloud.empty() || name == "none finite") continue;  // PCL's search has nothing to search
    check_statistical(name, cloud, {1, 2, 10, 50, 100});
  }
}

TEST_CASE("the statistical filter selects what PCL selects of clouds of every small size") {
  for (const std::size_t k : {1U, 2U, 5U, 16U}) {
    for (const std::size_t n : {std::size_t{1}, std::size_t{2}, k, k + 1, k + 2, 2 * k + 1, 3 * k + 16})
      for (std::uint64_t seed = 1; seed != 4; ++seed)
        check_statistical("tiny", orbis::test::uniform_cloud(n, 1000 * n + seed), {k}, {0.0, 1.0});
  }
}

TEST_CASE("the statistical filter selects what PCL selects of many random clouds") {
  orbis::random_bits random{17};
  for (std::uint64_t seed = 1; seed != 25; ++seed) {
    const std::size_t n = 100 + random.below(4000);
    const std::size_t k = 1 + random.below(80);
    points cloud = orbis::test::uniform_cloud(n, seed, 0.01 + random.uniform() * 20, random.uniform() * 100);
    check_statistical("uniform", cloud, {k});
    check_statistical("with holes", with_holes(cloud, seed), {k});
    const auto axis = static_cast<Eigen::Index>(random.below(3));
    for (auto& p : cloud) p[axis] = 1.25F;
    check_statistical("planar", cloud, {k});
    for (auto& p : cloud) p[(axis + 1) % 3] = -0.5F;
    check_statistical("collinear", cloud, {k});
    for (auto& p : cloud) p = cloud[random.below(static_cast<std::uint32_t>(1 + n / 7))];
    check_statistical("duplicates", cloud, {k});
    points clusters;
    while (clusters.size() < n) {
      const points part = orbis::test::uniform_cloud(1 + random.below(300), seed + clusters.size(),
                                                     random.uniform() * 0.2, random.uniform() * 5);
      clusters.insert(clusters.end(), part.begin(), part.end());
    }
    check_statistical("clusters", clusters, {k});
    check_statistical("huge coordinates", orbis::test::uniform_cloud(n, seed, 1000.0, 1e7), {k});
  }
}

TEST_CASE("the statistical filter selects what PCL selects of real clouds") {
  ORBIS_NEEDS_DATA("clouds/fragment.pcd");
  for (const std::string name : {"fragment.pcd", "table_scene_mug_stereo_textured.pcd"}) {
    const auto read = orbis::io::read_pcd(orbis::test::data_dir() / "clouds" / name);
    REQUIRE(read.has_value());
    check_statistical(name, read->points, {8, 50}, {1.0, 2.5});
  }
}

TEST_CASE("the statistical filter selects what PCL selects of a real recording") {
  const std::string name = GENERATE("kitchen", "livingroom", "fr1_desk_9");
  ORBIS_NEEDS_DATA(name);
  const auto recording = orbis::io::open_recording(orbis::test::data_dir() / name);
  REQUIRE(recording.has_value());
  points merged;
  for (std::size_t i = 0; i < recording->size(); i += std::max<std::size_t>(1, recording->size() / 8)) {
    const auto frame = recording->frame(i).value();
    if (!frame.T_world_camera) continue;
    const auto seen = orbis::camera::unproject_depth(orbis::par, frame.depth_metres(), recording->camera().model,
                                                     {.stride = 4, .max_depth = 6.0F}, *frame.T_world_camera);
    merged.insert(merged.end(), seen.points.begin(), seen.points.end());
  }
  REQUIRE(merged.size() > 50'000);
  check_statistical(name, merged, {8, 50}, {1.0});
  check_statistical(name, merged, {20}, {0.5});
}

TEST_CASE("the radius filter selects the points that PCL selects") {
  for (std::uint64_t seed = 1; seed != 8; ++seed) {
    const points cloud = orbis::test::uniform_cloud(400 * seed, seed);
    const auto theirs = to_pcl(cloud);
    for (const std::size_t least : {1U, 4U, 20U}) {
      for (const double radius : {0.03, 0.11, 0.3}) {
        pcl::RadiusOutlierRemoval<pcl::PointXYZ> filter;
        filter.setInputCloud(theirs);
        filter.setRadiusSearch(radius);
        filter.setMinNeighborsInRadius(static_cast<int>(least));
        std::vector<int> kept;
        filter.filter(kept);
        INFO(cloud.size() << " points, at least " << least << " within " << radius);
        CHECK(orbis::cloud::radius_inliers(orbis::par, cloud, {.radius = radius, .min_neighbors = least}) ==
              indices(kept.begin(), kept.end()));
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
