// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <limits>
#include <vector>

#include <Eigen/Geometry>

#include <orbis/optimize/absolute_orientation.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("Absolute orientation finds the rigid transform and agrees with Eigen's umeyama under noise") {
  random_bits random(7);
  for (int trial = 0; trial < 50; ++trial) {
    const se3 truth = test::random_pose(random);
    std::vector<vec3> from, exact, noisy;
    for (int i = 0; i < 20; ++i) {
      from.push_back(test::random_vector(random, 2.0));
      exact.push_back(truth * from.back());
      noisy.push_back(exact.back() + test::random_vector(random, 0.05));
    }
    const auto found = optimize::absolute_orientation(from, exact);
    REQUIRE(found.has_value());
    CHECK(test::angle_between(*found, truth) < 1e-9);
    CHECK(test::distance_between(*found, truth) < 1e-9);

    Eigen::Matrix3Xd a(3, 20), b(3, 20);
    for (int i = 0; i < 20; ++i) {
      a.col(i) = from[static_cast<std::size_t>(i)];
      b.col(i) = noisy[static_cast<std::size_t>(i)];
    }
    const Eigen::Matrix4d rigid = Eigen::umeyama(a, b, false);
    const Eigen::Matrix4d scaled = Eigen::umeyama(a, b, true);
    CHECK((optimize::absolute_orientation(from, noisy)->to_matrix() - rigid).norm() < 1e-9);
    const auto s = optimize::absolute_orientation_with_scale(from, noisy);
    REQUIRE(s.has_value());
    CHECK((s->scale() * s->rotation_matrix() - scaled.topLeftCorner<3, 3>()).norm() < 1e-9);
    CHECK((s->translation() - scaled.topRightCorner<3, 1>()).norm() < 1e-9);
  }
}

TEST_CASE("Absolute orientation takes any point type and planar points") {
  const std::vector<std::array<float, 3>> from{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {1, 1, 0}};
  std::vector<vec3> to;
  for (const auto& p : from) to.emplace_back(-p[1] + 5.0, p[0], p[2]);
  const auto found = optimize::absolute_orientation(from, to);
  REQUIRE(found.has_value());
  CHECK((*found * vec3(1, 1, 1) - vec3(4, 1, 1)).norm() < 1e-9);
}

TEST_CASE("Absolute orientation says what is wrong with degenerate points") {
  std::vector<vec3> line, point, few(2, vec3::Zero());
  for (int i = 0; i < 10; ++i) {
    line.emplace_back(1.0 + i, 2.0 - 3.0 * i, 0.5 * i);
    point.emplace_back(1.0, 2.0, 3.0);
  }
  CHECK(optimize::absolute_orientation(line, line).error().code == errc::degenerate);
  CHECK(optimize::absolute_orientation(point, point).error().code == errc::degenerate);
  CHECK(optimize::absolute_orientation_with_scale(point, line).error().code == errc::degenerate);
  CHECK(optimize::absolute_orientation(few, few).error().code == errc::no_data);
  CHECK(optimize::absolute_orientation(few, line).error().code == errc::invalid_argument);
  std::vector<vec3> nan{vec3(0, 0, 0), vec3(1, 0, 0), vec3(0, 1, 0), vec3(0, 0, 1)};
  nan[2].x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(optimize::absolute_orientation(nan, nan).error().code == errc::degenerate);
}
