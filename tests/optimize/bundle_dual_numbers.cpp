// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/reprojection.hpp>

#include "bundle_instances.hpp"
#include "dual_numbers.hpp"
#include "support.hpp"
#include "support/catch.hpp"
#include "templated_residuals.hpp"

using namespace orbis;
using optimize::lie_group;

namespace {

const camera::pinhole plain{640, 480, 517.3, 510.5, 318.6, 255.3};

struct reprojection_by_definition {
  template <class S>
  matrix<3, 1, S> operator()(const test::rigid<S>& T_world_camera, const matrix<3, 1, S>& point,
                             const optimize::bundle_observation& o) const {
    return test::reproject<S>(plain, 40.0, T_world_camera.inverse() * point, o.pixel, o.right);
  }
};

}  // namespace

TEST_CASE("Bundle adjustment with Jacobians of dual numbers ends where the analytic one does") {
  random_bits random(67);
  std::vector<se3> truth;
  std::vector<vec3> points;
  for (int i = 0; i != 4; ++i) truth.push_back(se3(so3::exp(test::random_vector(random, 0.05)), vec3(0.2 * i, 0, 0)));
  for (int i = 0; i != 60; ++i) points.push_back(test::random_point_in_view(random));
  std::vector<optimize::bundle_observation> observations;
  for (std::uint32_t c = 0; c != truth.size(); ++c)
    for (std::uint32_t i = 0; i != points.size(); ++i) {
      const vec3 q = truth[c].inverse() * points[i];
      const auto pixel = plain.project(q);
      if (!pixel) continue;
      observations.push_back({c, i, *pixel + 0.5 * vec2(random.normal(), random.normal()), pixel->x() - 40.0 / q.z()});
    }
  for (std::size_t c = 1; c != truth.size(); ++c) {
    vec6 off;
    off << test::random_vector(random, 0.02), test::random_vector(random, 0.01);
    truth[c] = truth[c] * se3::exp(off);
  }
  const std::vector<std::uint8_t> fixed{1, 0, 0, 0};
  const optimize::bundle_options options{.max_iterations = 20, .relative_tolerance = 1e-12, .fixed_poses = fixed};
  const auto solve = [&](auto adjuster, std::vector<se3>& poses) {
    poses = truth;
    std::vector<vec3> map = points;
    return adjuster.solve(seq, std::span<se3>(poses), std::span<vec3>(map),
                          std::span<const optimize::bundle_observation>(observations), options);
  };
  std::vector<se3> a, b;
  const auto analytic = solve(optimize::bundle_adjuster{optimize::reprojection{plain, 40.0}, optimize::huber{2.45}}, a);
  const auto by_dual_numbers =
      solve(optimize::bundle_adjuster{test::automatic_bundle_residual{reprojection_by_definition{}, lie_group<se3>{}},
                                      optimize::huber{2.45}},
            b);
  REQUIRE_FALSE(is_failure(analytic.status));
  REQUIRE_FALSE(is_failure(by_dual_numbers.status));
  CHECK(by_dual_numbers.initial_cost == Approx(analytic.initial_cost).epsilon(1e-12));
  CHECK(by_dual_numbers.final_cost == Approx(analytic.final_cost).epsilon(1e-9));
  CHECK(analytic.final_cost < 0.5 * analytic.initial_cost);
  for (std::size_t c = 0; c != a.size(); ++c) CHECK(test::distance_between(a[c], b[c]) < 1e-6);
}
