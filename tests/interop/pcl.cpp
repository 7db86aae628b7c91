// SPDX-License-Identifier: BSD-3-Clause
//
// Where PCL is installed.
#ifdef ORBIS_TEST_WITH_PCL
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/interop/pcl.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

using namespace orbis;
using interop::extract;

static_assert(point_range<pcl::PointCloud<pcl::PointXYZ>> && point_range<const pcl::PointCloud<pcl::PointXYZRGB>&>);
static_assert(point_range<pcl::PointCloud<pcl::PointXYZI>> && point_range<pcl::PointCloud<pcl::PointNormal>>);
static_assert(point_like<pcl::PointXYZRGBA> && point_like<pcl::PointWithRange> && !point_like<pcl::Normal>);
static_assert(interop::colored_pcl_point<pcl::PointXYZRGB> && !interop::colored_pcl_point<pcl::PointXYZI>);

namespace {

[[nodiscard]] point_cloud some_cloud(std::size_t n = 2000) {
  point_cloud cloud{test::uniform_cloud(n, 51), {}};
  for (std::size_t i = 0; i != n; ++i) {
    const auto byte = [&](std::size_t shift) { return static_cast<std::uint8_t>(i >> shift & 255U); };
    cloud.colors.push_back({byte(0), byte(3), byte(6)});
  }
  return cloud;
}

}  // namespace

TEST_CASE("PCL's clouds go through every filter as they are") {
  const point_cloud ours = some_cloud();
  const auto plain = interop::to_pcl<pcl::PointXYZ>(ours);
  const auto colored = interop::to_pcl(ours);
  const auto normals = interop::to_pcl<pcl::PointXYZRGBNormal>(ours);
  const auto filters = [](const auto& points) {
    return std::vector{cloud::statistical_inliers(par, points, {.neighbors = 12}),
                       cloud::radius_inliers(par, points, {.radius = 0.1, .min_neighbors = 8}),
                       cloud::filter_automatically(par, points).inliers};
  };
  const auto expected = filters(ours.points);
  CHECK(expected[0].size() < ours.size());
  CHECK(expected[1].size() < ours.size());
  CHECK(filters(plain) == expected);
  CHECK(filters(colored) == expected);
  CHECK(filters(normals) == expected);
  CHECK(filters(colored.points) == expected);  // the vector within
}

TEST_CASE("PCL's clouds go into a map as they are") {
  const point_cloud ours = some_cloud();
  octree::occupancy_octree<> a{0.1}, b{0.1};
  a.integrate(ours.points, vec3f{3, 3, 3});
  b.integrate(interop::to_pcl(ours), vec3f{3, 3, 3});
  CHECK(a.num_leaves() > 100);
  CHECK(a.size() == b.size());
}

TEST_CASE("points and colours go to PCL and back") {
  const point_cloud ours = some_cloud();
  const auto theirs = interop::to_pcl(ours);
  CHECK((theirs.size() == ours.size() && theirs.width == ours.size() && theirs.height == 1 && theirs.is_dense));
  CHECK(interop::color_of(theirs[700]) == ours.colors[700]);
  const point_cloud back = interop::from_pcl(theirs);
  CHECK(back.points == ours.points);
  CHECK(back.colors == ours.colors);
  CHECK_FALSE(interop::from_pcl(interop::to_pcl<pcl::PointXYZ>(ours)).has_colors());
  CHECK(interop::to_pcl({ours.points, {}})[3].getVector3fMap() == Eigen::Vector3f(ours.points[3]));
  CHECK(interop::from_pcl(interop::to_pcl(point_cloud{})).empty());

  point_cloud holed = ours;
  holed.points[4].x() = std::numeric_limits<float>::quiet_NaN();
  CHECK_FALSE(interop::to_pcl(holed).is_dense);
}

TEST_CASE("what a filter keeps keeps all of its fields") {
  auto theirs = interop::to_pcl<pcl::PointXYZRGBNormal>(some_cloud(100));
  for (std::size_t i = 0; i != 100; ++i) theirs[i].curvature = static_cast<float>(i);
  theirs.header.frame_id = "camera";
  theirs.sensor_origin_ << 1, 2, 3, 0;
  theirs[7].x = std::numeric_limits<float>::quiet_NaN();
  theirs.is_dense = false;
  const std::vector<std::uint32_t> keep{5, 90, 2};
  const auto kept = extract(theirs, keep);
  REQUIRE(kept.size() == 3);
  CHECK((kept.width == 3 && kept.height == 1 && kept.is_dense && kept.header.frame_id == "camera"));
  CHECK(kept.sensor_origin_ == theirs.sensor_origin_);
  for (std::size_t i = 0; i != 3; ++i) {
    CHECK(kept[i].curvature == static_cast<float>(keep[i]));
    CHECK(kept[i].g == theirs[keep[i]].g);
  }
  const std::vector<std::uint32_t> holed{7};
  CHECK_FALSE(extract(theirs, holed).is_dense);
}

TEST_CASE("a PCL cloud's sensor origin is known where somebody said it") {
  static_assert(cloud::cloud_with_sensor_origin<pcl::PointCloud<pcl::PointXYZ>>);
  auto theirs = interop::to_pcl(some_cloud(12));
  CHECK_FALSE(interop::sensor_origin(theirs).has_value());
  theirs.width = 4;
  theirs.height = 3;
  CHECK(interop::sensor_origin(theirs) == vec3{0, 0, 0});  // organised: one sensor's, at the origin
  theirs.sensor_origin_ << 1.0F, -2.0F, 0.5F, 0.0F;
  CHECK(interop::sensor_origin(theirs) == vec3{1, -2, 0.5});
  theirs.height = 1;
  theirs.width = 12;
  CHECK(interop::sensor_origin(theirs) == vec3{1, -2, 0.5});
  const std::vector<float> ranges = cloud::sensor_ranges(seq, theirs);
  CHECK(ranges[5] == Approx((theirs[5].getVector3fMap().cast<double>() - vec3{1, -2, 0.5}).norm()));
  theirs.sensor_origin_.x() = std::numeric_limits<float>::infinity();
  CHECK_FALSE(interop::sensor_origin(theirs).has_value());
  CHECK(std::isnan(cloud::sensor_ranges(seq, theirs)[5]));
}

TEST_CASE("an organised PCL cloud is an image in place") {
  auto theirs = interop::to_pcl(some_cloud(12));
  CHECK_FALSE(interop::as_image(theirs));
  theirs.width = 4;
  theirs.height = 3;
  const auto image = interop::as_image(theirs).value();
  CHECK((image.width() == 4 && image.height() == 3 && image.data() == theirs.points.data()));
  CHECK(&image(1, 2) == &theirs.at(1, 2));
  theirs.width = 5;  // says more than there is
  const auto refused = interop::as_image(theirs);
  REQUIRE_FALSE(refused);
  CHECK(refused.error().message == "is not organised: 12 points, 5x3");
  CHECK(interop::as_image(pcl::PointCloud<pcl::PointXYZ>{})->empty());
}
#endif
