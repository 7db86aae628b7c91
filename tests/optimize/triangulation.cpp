// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <vector>

#include <orbis/optimize/triangulation.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::triangulation_status;

namespace {

/// Cameras that look at a point, and the rays under which they see it, with noise at z = 1.
struct views {
  vec3 point;
  std::vector<se3> poses;
  std::vector<vec3> rays;
};

views make_views(random_bits& random, std::size_t n, double noise) {
  views v;
  v.point = test::random_vector(random, 2.0);
  while (v.poses.size() != n) {
    const vec3 seen = test::random_point_in_view(random);
    const so3 rotation = test::random_pose(random).rotation();
    v.poses.emplace_back(rotation, v.point - rotation * seen);
    v.rays.push_back(seen / seen.z() + vec3(noise * random.normal(), noise * random.normal(), 0.0));
  }
  return v;
}

/// The sum of squared distances at z = 1.
double cost(const views& v, const vec3& p) {
  double sum = 0.0;
  for (std::size_t i = 0; i != v.poses.size(); ++i) {
    const vec3 seen = v.poses[i].inverse() * p;
    sum += (seen / seen.z() - v.rays[i]).squaredNorm();
  }
  return sum;
}

optimize::triangulation of_two(const views& v) {
  return optimize::triangulate(v.poses[0], v.rays[0], v.poses[1], v.rays[1]);
}

}  // namespace

TEST_CASE("Triangulation is exact without noise, for two views and for many") {
  random_bits random(3);
  double worst = 0.0;
  for (int trial = 0; trial != 5000; ++trial) {
    const views v = make_views(random, 2 + static_cast<std::size_t>(trial % 5), 0.0);
    const auto two = of_two(v);
    if (two.parallax > 0.02) {
      REQUIRE(two.ok());
      worst = std::max(worst, (two.point - v.point).norm() * two.parallax);
      CHECK(two.error < 1e-14);
    }
    const auto many = optimize::triangulate(v.poses, v.rays);
    if (many.parallax > 0.02) {
      REQUIRE(many.ok());
      worst = std::max(worst, (many.point - v.point).norm() * many.parallax);
    }
  }
  CHECK(worst < 1e-13);
}

TEST_CASE("Triangulation from two views is the best there is") {
  random_bits random(5);
  int compared = 0;
  for (int trial = 0; trial != 1000; ++trial) {
    const views v = make_views(random, 2, 0.002);
    const auto closed = of_two(v), descended = optimize::triangulate(v.poses, v.rays);
    if (!closed.ok() || closed.parallax < 0.05) continue;
    REQUIRE(descended.ok());
    ++compared;
    const double best = cost(v, closed.point);
    CHECK(best <= cost(v, descended.point) * (1.0 + 1e-6) + 1e-18);
    CHECK(best == Approx(2.0 * closed.error * closed.error).epsilon(1e-3).margin(1e-15));
    for (int k = 0; k != 3; ++k) CHECK(best <= cost(v, closed.point + test::random_vector(random, 1e-3)) + 1e-18);
  }
  CHECK(compared > 800);
}

TEST_CASE("Triangulation from many views is a minimum, whatever the order of views, and moves with them") {
  random_bits random(7);
  for (int trial = 0; trial != 200; ++trial) {
    const views v = make_views(random, 6, 0.002);
    const auto found = optimize::triangulate(v.poses, v.rays);
    REQUIRE(found.ok());
    for (int k = 0; k != 5; ++k)
      CHECK(cost(v, found.point) <= cost(v, found.point + test::random_vector(random, 1e-4)) + 1e-18);
    const views reversed{v.point, {v.poses.rbegin(), v.poses.rend()}, {v.rays.rbegin(), v.rays.rend()}};
    CHECK((optimize::triangulate(reversed.poses, reversed.rays).point - found.point).norm() < 1e-6);
    const se3 motion = test::random_pose(random, 100.0);
    views moved = v;
    for (se3& pose : moved.poses) pose = motion * pose;
    CHECK((optimize::triangulate(moved.poses, moved.rays).point - motion * found.point).norm() < 1e-6);
    CHECK((of_two(moved).point - motion * of_two(v).point).norm() < 1e-6);
  }
}

TEST_CASE("Triangulation says what is wrong") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const se3 here, aside(so3(), vec3(1, 0, 0));
  const vec3 ahead(0, 0, 1);
  const auto two = [](const se3& a, const vec3& x, const se3& b, const vec3& y) {
    const auto closed = optimize::triangulate(a, x, b, y);
    const std::vector<se3> poses{a, b};
    const std::vector<vec3> rays{x, y};
    CHECK(optimize::triangulate(poses, rays).status == closed.status);
    return closed.status;
  };
  CHECK(two(here, ahead, aside, vec3(-0.5, 0, 1)) == triangulation_status::ok);
  CHECK(two(here, ahead, aside, ahead) == triangulation_status::no_parallax);  // a point at infinity
  CHECK(two(here, ahead, here, ahead) == triangulation_status::no_parallax);   // the same camera twice
  CHECK(two(here, ahead, aside, vec3(0.5, 0, 1)) == triangulation_status::behind_camera);
  CHECK(two(here, vec3(nan, 0, 1), aside, ahead) == triangulation_status::not_finite);
  CHECK(optimize::triangulate(std::span<const se3>{}, std::span<const vec3>{}).status ==
        triangulation_status::too_few_views);
  CHECK(two(here, vec3(0.1, 0, 1), here, vec3(-0.1, 0, 1)) == triangulation_status::no_parallax);  // no baseline
  CHECK(optimize::to_string(triangulation_status::behind_camera) == "behind a camera");
}
