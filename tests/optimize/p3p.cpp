// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <limits>

#include <orbis/optimize/p3p.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("Every P3P solution explains the rays and the true pose is among them") {
  random_bits random(11);
  int missed = 0, unexplained = 0, several = 0;
  constexpr int trials = 20000;
  for (int trial = 0; trial < trials; ++trial) {
    const se3 truth = test::random_pose(random);
    std::array<vec3, 3> world, rays;
    for (std::size_t i = 0; i < 3; ++i) {
      const vec3 p = test::random_point_in_view(random);
      rays[i] = p / p.z();
      world[i] = truth * p;
    }
    const auto solutions = optimize::p3p(world, rays);
    double nearest = std::numeric_limits<double>::infinity();
    for (const se3& s : solutions) {
      nearest = std::min(nearest, test::angle_between(s, truth) + test::distance_between(s, truth));
      for (std::size_t i = 0; i < 3; ++i) {
        const vec3 seen = s.inverse() * world[i];
        if (!(seen.normalized().cross(rays[i].normalized()).norm() < 1e-6 && seen.dot(rays[i]) > 0.0)) ++unexplained;
      }
    }
    missed += !(nearest < 1e-6);
    several += solutions.size() > 1;
  }
  // A few random triangles lie at a double root, where no solver keeps all digits.
  CHECK(missed <= trials / 2000);
  CHECK(unexplained <= trials / 2000);
  CHECK(several > trials / 3);
}

TEST_CASE("P3P finds all four poses over an equilateral triangle") {
  // Fischler and Bolles' example: the camera over the centre of the triangle has four solutions
  // where the angles between the rays are small enough.
  const std::array<vec3, 3> world{vec3(1, 0, 0), vec3(-0.5, std::sqrt(3.0) / 2, 0), vec3(-0.5, -std::sqrt(3.0) / 2, 0)};
  const vec3 centre(0.01, -0.02, 3.0);  // slightly off the symmetric position, where roots coincide
  std::array<vec3, 3> rays;
  for (std::size_t i = 0; i < 3; ++i) rays[i] = world[i] - centre;
  const auto solutions = optimize::p3p(world, rays);
  CHECK(solutions.size() == 4);
  CHECK(std::any_of(solutions.begin(), solutions.end(), [&](const se3& s) {
    return (s.translation() - centre).norm() < 1e-9 && s.rotation().angle() < 1e-9;
  }));
}

TEST_CASE("P3P has no solution for collinear or coincident or non-finite input") {
  const vec3 ray1(0.1, 0.2, 1), ray2(-0.1, 0.2, 1), ray3(0.3, -0.2, 1);
  CHECK(optimize::p3p({vec3(0, 0, 2), vec3(1, 0, 2), vec3(2, 0, 2)}, {ray1, ray2, ray3}).empty());
  CHECK(optimize::p3p({vec3(1, 1, 2), vec3(1, 1, 2), vec3(1, 1, 2)}, {ray1, ray2, ray3}).empty());
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(optimize::p3p({vec3(0, nan, 2), vec3(1, 0, 2), vec3(2, 1, 2)}, {ray1, ray2, ray3}).empty());
  CHECK(optimize::p3p({vec3(0, 1, 2), vec3(1, 0, 2), vec3(2, 1, 2)}, {ray1, vec3(nan, 0, 1), ray3}).empty());
}
