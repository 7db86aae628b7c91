// SPDX-License-Identifier: BSD-3-Clause
//
// Where Open3D is installed.
#ifdef ORBIS_TEST_WITH_OPEN3D
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/interop/open3d.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

using namespace orbis;

static_assert(point_range<decltype(open3d::geometry::PointCloud::points_)>);

namespace {

[[nodiscard]] point_cloud some_cloud(std::size_t n = 2000) {
  point_cloud cloud{test::uniform_cloud(n, 52), {}};
  for (std::size_t i = 0; i != n; ++i)
    cloud.colors.push_back({static_cast<std::uint8_t>(i & 255U), static_cast<std::uint8_t>(i >> 3U & 255U), 9});
  return cloud;
}

}  // namespace

TEST_CASE("Open3D's points go through every filter as they are") {
  const point_cloud ours = some_cloud();
  const auto theirs = interop::to_open3d(ours);
  CHECK(cloud::statistical_inliers(par, theirs.points_, {.neighbors = 12}) ==
        cloud::statistical_inliers(par, ours.points, {.neighbors = 12}));
  CHECK(cloud::radius_inliers(par, theirs.points_, {.radius = 0.1, .min_neighbors = 8}) ==
        cloud::radius_inliers(par, ours.points, {.radius = 0.1, .min_neighbors = 8}));
  CHECK(cloud::filter_automatically(par, theirs.points_).inliers ==
        cloud::filter_automatically(par, ours.points).inliers);
}

TEST_CASE("our filter takes away what Open3D's does") {
  // Theirs counts the point itself among its neighbours, and divides by their number.
  const auto theirs = interop::to_open3d(some_cloud());
  const auto [selected, indices] = theirs.RemoveStatisticalOutliers(13, 1.0);
  const auto keep = cloud::statistical_inliers(par, theirs.points_, {.neighbors = 12, .sigma_multiplier = 1.0});
  CHECK(std::vector<std::size_t>(keep.begin(), keep.end()) == indices);
  CHECK(interop::extract(theirs, keep).points_ == selected->points_);
  CHECK(interop::extract(theirs, keep).colors_ == selected->colors_);
}

TEST_CASE("points and colours go to Open3D and back") {
  const point_cloud ours = some_cloud();
  const auto theirs = interop::to_open3d(ours);
  CHECK((theirs.HasColors() && theirs.points_.size() == ours.size()));
  const point_cloud back = interop::from_open3d(theirs);
  CHECK(back.points == ours.points);
  CHECK(back.colors == ours.colors);
  CHECK_FALSE(interop::to_open3d({ours.points, {}}).HasColors());
  CHECK_FALSE(interop::from_open3d(interop::to_open3d({ours.points, {}})).has_colors());
  CHECK(interop::from_open3d({}).empty());
}

TEST_CASE("every byte of a colour survives, and colours outside are clamped") {
  for (int i = 0; i != 256; ++i) {
    const rgb8 c{static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(255 - i), 7};
    REQUIRE(interop::color_from_open3d(interop::color_to_open3d(c)) == c);
  }
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(interop::color_from_open3d({-0.5, 1.5, nan}) == rgb8{0, 255, 0});
}

TEST_CASE("what a filter keeps keeps its normals and covariances") {
  auto theirs = interop::to_open3d(some_cloud(50));
  for (int i = 0; i != 50; ++i) {
    theirs.normals_.emplace_back(i, 0, 1);
    theirs.covariances_.push_back(Eigen::Matrix3d::Identity() * i);
  }
  const std::vector<std::uint32_t> keep{40, 3};
  const auto kept = interop::extract(theirs, keep);
  REQUIRE((kept.points_.size() == 2 && kept.normals_.size() == 2 && kept.covariances_.size() == 2));
  CHECK(kept.points_[0] == theirs.points_[40]);
  CHECK(kept.colors_[1] == theirs.colors_[3]);
  CHECK(kept.normals_[0].x() == 40.0);
  CHECK(kept.covariances_[1](2, 2) == 3.0);
}
#endif
