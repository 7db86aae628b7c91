// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>
#include <vector>

#include <orbis/optimize/pose_from_points.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

struct view {
  se3 T_world_camera;
  std::vector<vec3> points, rays;
};

view make_view(random_bits& random, std::size_t n, bool planar, double noise) {
  view v;
  v.T_world_camera = test::random_pose(random);
  const vec3 normal = (vec3::UnitZ() + test::random_vector(random, 0.7)).normalized();
  for (std::size_t i = 0; i != n; ++i) {
    vec3 p = test::random_point_in_view(random);
    if (planar) p *= 3.0 / normal.dot(p);
    v.rays.push_back(p / p.z() + vec3(noise * random.normal(), noise * random.normal(), 0.0));
    v.points.push_back(v.T_world_camera * p);
  }
  return v;
}

double distance(const se3& a, const se3& b) { return test::angle_between(a, b) + test::distance_between(a, b); }

}  // namespace

TEST_CASE("The pose from points is exact without noise, in space and in a plane") {
  random_bits random(5);
  std::vector<double> errors;
  for (int trial = 0; trial != 2000; ++trial) {
    const view v = make_view(random, 6 + static_cast<std::size_t>(trial % 20), trial % 3 == 0, 0.0);
    const auto found = optimize::pose_from_points(v.points, v.rays);
    REQUIRE(found.has_value());
    errors.push_back(distance(*found, v.T_world_camera));
  }
  std::sort(errors.begin(), errors.end());
  CHECK(errors[errors.size() / 2] < 1e-12);
  CHECK(errors.back() < 1e-6);
}

TEST_CASE("The pose from points is near the truth with noise and moves with the points, in whatever order") {
  random_bits random(6);
  for (int trial = 0; trial != 100; ++trial) {
    const view v = make_view(random, 50, trial % 2 == 0, 0.001);
    const auto found = optimize::pose_from_points(v.points, v.rays);
    REQUIRE(found.has_value());
    CHECK(distance(*found, v.T_world_camera) < 0.03);
    const se3 motion = test::random_pose(random, 10.0);
    view moved;
    for (std::size_t i = v.points.size(); i-- != 0;) {
      moved.points.push_back(motion * v.points[i]);
      moved.rays.push_back(3.0 * v.rays[i]);
    }
    const auto again = optimize::pose_from_points(moved.points, moved.rays);
    REQUIRE(again.has_value());
    CHECK(distance(*again, motion * *found) < 1e-7);
  }
}

TEST_CASE("The pose from points says why there is none") {
  random_bits random(7);
  const view v = make_view(random, 10, false, 0.0);
  const auto why = [](const std::vector<vec3>& points, const std::vector<vec3>& rays) {
    const auto found = optimize::pose_from_points(points, rays);
    return found ? orbis::error{} : found.error();
  };
  std::vector<vec3> line, nan = v.points;
  for (int i = 0; i != 10; ++i) line.emplace_back(1.0 + i, 2.0 - i, 3.0 * i);
  nan[4].y() = std::numeric_limits<double>::quiet_NaN();
  CHECK(why(line, v.rays).message == "the points all lie on one line or in one place");
  CHECK(why(std::vector<vec3>(10, vec3(1, 2, 3)), v.rays).message == "the points all lie on one line or in one place");
  CHECK(why(nan, v.rays).message == "point or ray 4 is not finite or has no length");
  CHECK(why(v.points, std::vector<vec3>(10, vec3(0, 0, 1))).message == "the rays all have one direction");
  CHECK(why({3, vec3::Zero()}, {3, vec3::UnitZ()}).code == errc::no_data);
  CHECK(why({3, vec3::Zero()}, v.rays).code == errc::invalid_argument);
}
