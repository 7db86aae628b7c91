// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numeric>
#include <span>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>
#include <orbis/optimize/robust_loss.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using camera::parameters_of;
using optimize::posed_camera;
using optimize::reprojection_with_intrinsics;

TEST_CASE("Bundle adjustment recovers the intrinsics of every camera along with its pose") {
  // Of fx, fy, cx, cy, k1, k2 and of each camera its own; p1 to k6 known. Every image sees all depths.
  using model_type = reprojection_with_intrinsics<camera::radial_tangential, 0, 1, 2, 3, 4, 5>;
  using state = model_type::camera_state;
  using parameters = parameters_of<camera::radial_tangential>;
  const model_type model{.bf = 40.0};
  random_bits random(23);
  constexpr std::size_t cameras = 6, points = 250;
  std::vector<state> truth, start;
  for (std::size_t c = 0; c != cameras; ++c) {
    const double s = static_cast<double>(c);
    const camera::intrinsics own{640, 480, 500.0 + 9.0 * s, 505.0 + 8.0 * s, 318.0 + s, 243.0 - s};
    const camera::radial_tangential lens{own, {.k1 = -0.2 + 0.02 * s, .k2 = 0.06, .p1 = 0.001, .p2 = -0.0005}};
    truth.push_back({se3{so3::exp(vec3(0.02, -0.04 * s, 0.02 * s)), vec3(0.15 * s, 0.03 * s, 0.0)}, lens});
    auto off = parameters::get(lens);
    vec6 xi;
    xi << test::random_vector(random, 0.03), test::random_vector(random, 0.02);
    for (int i = 0; i != 2; ++i) off[i] *= 1.0 + 0.04 * random.uniform(-1.0, 1.0);
    for (int i = 2; i != 4; ++i) off[i] += 6.0 * random.uniform(-1.0, 1.0);
    for (int i = 4; i != 6; ++i) off[i] = 0.0;
    if (c == 0)
      start.push_back(truth[0]);
    else
      start.push_back({truth[c].T_world_camera * se3::exp(xi), *parameters::with(lens, off)});
  }
  std::vector<vec3> true_points, near;
  std::vector<optimize::bundle_observation> observations;
  for (std::uint32_t p = 0; p != points; ++p) {
    true_points.push_back(test::random_point_in_view(random));
    near.push_back(true_points.back() + test::random_vector(random, 0.04));
    for (std::uint32_t c = 0; c != cameras; ++c) {
      const vec3 q = truth[c].T_world_camera.inverse() * true_points.back();
      const auto pixel = truth[c].camera.project(q);
      if (!pixel) continue;
      observations.push_back({.pose = c, .point = p, .pixel = *pixel});
      if (p % 3 != 0) observations.back().right = model.right(pixel->x(), q.z());
    }
  }
  const std::vector<std::uint8_t> fixed{1, 0, 0, 0, 0, 0};  // with its intrinsics
  optimize::bundle_adjuster adjuster{model, optimize::trivial{}};
  const auto solve = [&](std::vector<state>& estimate, std::vector<vec3>& map) {
    return adjuster.solve(seq, std::span<state>(estimate), std::span<vec3>(map),
                          std::span<const optimize::bundle_observation>(observations),
                          {.max_iterations = 50, .relative_tolerance = 1e-14, .fixed_poses = fixed});
  };
  auto estimate = start;
  auto map = near;
  const auto exact = solve(estimate, map);
  REQUIRE_FALSE(is_failure(exact.status));
  CHECK(exact.final_cost < 1e-12 * exact.initial_cost);
  for (std::size_t c = 0; c != cameras; ++c) {
    const auto p = parameters::get(estimate[c].camera), expected = parameters::get(truth[c].camera);
    for (int i = 0; i != 4; ++i) CHECK(std::abs(p[i] - expected[i]) < 1e-5);
    for (int i = 4; i != 6; ++i) CHECK(std::abs(p[i] - expected[i]) < 1e-7);
    for (int i = 6; i != parameters::count; ++i) CHECK(p[i] == expected[i]);
    CHECK(test::distance_between(estimate[c].T_world_camera, truth[c].T_world_camera) < 1e-7);
  }
  CHECK(estimate[0].camera == truth[0].camera);

  // With half a pixel of noise: what is left is noise, the unknowns explain as much of it as so many may (the
  // distance of the estimate from the truth in units of its own uncertainty), and all intrinsics are better.
  constexpr double sigma = 0.5;
  std::size_t rows = 0;
  for (auto& o : observations) {
    o.pixel += sigma * vec2(random.normal(), random.normal());
    o.right += sigma * random.normal();
    rows += o.has_depth() ? 3 : 2;
  }
  estimate = start;
  map = near;
  const auto noisy = solve(estimate, map);
  REQUIRE_FALSE(is_failure(noisy.status));
  const auto unknowns = static_cast<double>(3 * points + 12 * (cameras - 1));
  const double freedom = static_cast<double>(rows) - unknowns, chi2 = 2.0 * noisy.final_cost / (sigma * sigma);
  CHECK(std::abs(chi2 - freedom) < 4.0 * std::sqrt(2.0 * freedom));
  std::vector<double> at_truth(observations.size());
  adjuster.chi2(truth, true_points, observations, at_truth);
  const double explained = std::accumulate(at_truth.begin(), at_truth.end(), 0.0) / (sigma * sigma) - chi2;
  CHECK(std::abs(explained - unknowns) < 4.0 * std::sqrt(2.0 * unknowns));
  double before[6] = {}, after[6] = {};
  for (std::size_t c = 0; c != cameras; ++c) {
    const auto p = parameters::get(estimate[c].camera), from = parameters::get(start[c].camera),
               expected = parameters::get(truth[c].camera);
    for (int i = 0; i != 6; ++i) {
      before[i] += std::abs(from[i] - expected[i]);
      after[i] += std::abs(p[i] - expected[i]);
    }
  }
  for (int i = 0; i != 6; ++i) CHECK(after[i] < 0.5 * before[i]);
}
