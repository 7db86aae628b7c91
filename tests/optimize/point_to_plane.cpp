// SPDX-License-Identifier: BSD-3-Clause
#include <limits>
#include <optional>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#include <orbis/optimize/detail/minimal/descent.hpp>
#include <orbis/optimize/point_to_plane.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::point_to_plane;

namespace {

/// Points on the walls of a corner of a room, as a camera at `T_world_camera` measures them.
std::vector<point_to_plane> measure_corner(const se3& T_world_camera, int walls, double sigma) {
  random_bits random(9);
  std::vector<point_to_plane> seen;
  for (int i = 0; i != 60; ++i) {
    const int axis = i % walls;
    const vec3 normal = vec3::Unit(axis);
    vec3 on_wall = test::random_vector(random, 2.0);
    on_wall[axis] = 3.0;
    vec3 other = test::random_vector(random, 2.0);  // the same wall, known at another point
    other[axis] = 3.0;
    const vec3 noise = sigma * random.normal() * normal;
    seen.push_back({T_world_camera.inverse() * (on_wall + noise), other, normal, 1.0 / (0.01 * 0.01)});
  }
  return seen;
}

/// Gauss-Newton on the distances from the planes, with the slightest damping; the cost at the end.
double align(se3& pose, const std::vector<point_to_plane>& seen) {
  struct equations {
    mat6 h = mat6::Zero();
    vec6 g = vec6::Zero();
    double cost = 0.0;
  };
  const auto sum_up = [&](const se3& at) {
    equations e;
    for (const point_to_plane& o : seen) {
      matrix<1, 6> j;
      const auto r = o.linearize(at, j);
      REQUIRE(r);
      e.h += j.transpose() * j;
      e.g += j.transpose() * *r;
      e.cost += r->squaredNorm();
    }
    return e;
  };
  const auto step = [](const se3& at, const equations& e) -> std::optional<se3> {
    mat6 damped = e.h;
    damped.diagonal().array() += 1e-8 * e.h.diagonal().maxCoeff();
    small_cholesky<6> factors;
    if (!factors.set(damped) || !(factors.factor(0.0) > 0.0)) return std::nullopt;
    return at * se3::exp(-factors.solve(e.g));
  };
  const auto found = optimize::detail::descend(pose, 50, sum_up, step);
  REQUIRE(found);
  pose = *found;
  return sum_up(pose).cost;
}

}  // namespace

TEST_CASE("A camera finds its pose in the corner of a room") {
  random_bits random(6);
  for (int trial = 0; trial != 20; ++trial) {
    const se3 truth = test::random_pose(random, 0.5);
    const auto seen = measure_corner(truth, 3, 0.0);
    vec6 off;
    off << test::random_vector(random, 0.2), test::random_vector(random, 0.15);
    se3 pose = truth * se3::exp(off);
    align(pose, seen);
    CHECK(test::distance_between(pose, truth) < 1e-7);
    CHECK(test::angle_between(pose, truth) < 1e-7);
  }
}

TEST_CASE("Two walls leave the pose free along their edge, and the rest is found") {
  const se3 truth;
  const auto seen = measure_corner(truth, 2, 0.0);
  se3 pose = se3::exp((vec6() << 0.1, 0.05, 0.3, 0.02, 0.03, -0.02).finished());
  CHECK(align(pose, seen) < 2e-9);
  CHECK(test::angle_between(pose, truth) < 1e-6);
  CHECK((pose.translation() - truth.translation()).head<2>().norm() < 1e-6);
  CHECK(std::abs(pose.translation().z()) < 0.5);
}

TEST_CASE("Planes adjust poses while the points they go through are fixed") {
  random_bits random(16);
  const se3 truth = test::random_pose(random, 0.5);
  const auto seen = measure_corner(truth, 3, 0.005);
  std::vector<se3> poses{truth * se3::exp((vec6() << 0.1, -0.1, 0.05, 0.05, 0.02, -0.04).finished())};
  std::vector<vec3> points;
  std::vector<optimize::plane_observation> observations;
  for (std::uint32_t i = 0; i != seen.size(); ++i) {
    points.push_back(seen[i].on_plane);
    observations.push_back({0, i, seen[i].measured, seen[i].normal, seen[i].information});
  }
  se3 alone = poses[0];
  align(alone, seen);
  const std::vector<std::uint8_t> fixed(points.size(), 1);
  optimize::bundle_adjuster adjuster{optimize::point_to_plane_adjustment{}, optimize::trivial{}};
  const auto summary = adjuster.solve(seq, std::span<se3>(poses), std::span<vec3>(points),
                                      std::span<const optimize::plane_observation>(observations),
                                      {.max_iterations = 20, .relative_tolerance = 1e-12, .fixed_points = fixed});
  CHECK_FALSE(is_failure(summary.status));
  CHECK(test::distance_between(poses[0], alone) < 1e-6);
  CHECK(test::distance_between(poses[0], truth) < 0.01);
}

TEST_CASE("A measurement of a plane says whether it can be used") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const point_to_plane good{vec3(0, 0, 1), vec3(0, 0, 2), vec3(0, 0, 1), 4.0};
  CHECK(good.is_usable());
  CHECK((*good.residual(se3{}))[0] == -2.0);
  CHECK_FALSE(point_to_plane{vec3(nan, 0, 1), vec3(0, 0, 2), vec3(0, 0, 1), 4.0}.is_usable());
  CHECK_FALSE(point_to_plane{vec3(0, 0, 1), vec3(0, 0, 2), vec3(0, 0, 2), 4.0}.is_usable());
  CHECK_FALSE(point_to_plane{vec3(0, 0, 1), vec3(0, 0, 2), vec3(0, 0, 1), 0.0}.is_usable());
  CHECK_FALSE(point_to_plane{vec3(nan, 0, 1), vec3(0, 0, 2), vec3(0, 0, 1), 4.0}.residual(se3{}));
  STATIC_REQUIRE(optimize::bundle_residual<optimize::point_to_plane_adjustment>);
}
