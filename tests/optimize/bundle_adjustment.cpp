// SPDX-License-Identifier: BSD-3-Clause
#include <cstring>

#include <orbis/camera/pinhole.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::bundle_observation;
using optimize::bundle_status;

namespace {

const camera::pinhole pinhole_camera{640, 480, 525, 525, 319.5, 239.5};
const optimize::reprojection model{pinhole_camera, 40.0};

struct problem {
  std::vector<se3> poses, true_poses;
  std::vector<vec3> points, true_points;
  std::vector<bundle_observation> observations;
  std::vector<std::uint8_t> fixed;
};

/// Cameras along a curve that look at a cloud of points; the estimate is off by centimetres.
problem make_problem(double sigma, std::uint64_t seed) {
  random_bits random(seed);
  problem p;
  for (int i = 0; i < 8; ++i) {
    p.true_poses.emplace_back(so3::exp(vec3(0, -0.03 * i, 0.01 * i)), vec3(0.1 * i, 0.02 * i, 0.01 * i));
    vec6 xi;
    xi << test::random_vector(random, 0.03), test::random_vector(random, 0.02);
    p.fixed.push_back(i < 2 ? 1 : 0);
    p.poses.push_back(i < 2 ? p.true_poses.back() : p.true_poses.back() * se3::exp(xi));
  }
  for (std::uint32_t j = 0; j < 150; ++j) {
    p.true_points.push_back(test::random_point_in_view(random));
    p.points.push_back(p.true_points.back() + test::random_vector(random, 0.05));
    for (std::uint32_t i = 0; i < 8; ++i) {
      const vec3 seen = p.true_poses[i].inverse() * p.true_points[j];
      const auto pixel = pinhole_camera.project(seen);
      if (!pixel) continue;
      bundle_observation o{.pose = i, .point = j};
      o.pixel = *pixel + sigma * vec2(random.normal(), random.normal());
      if (random.uniform() < 0.6) o.right = model.right(pixel->x(), seen.z()) + sigma * random.normal();
      p.observations.push_back(o);
    }
  }
  return p;
}

template <class Loss, class Policy>
optimize::bundle_summary solve(problem& p, Loss loss, const Policy& policy, int iterations = 30,
                               std::span<const std::uint8_t> ignored = {}) {
  optimize::bundle_adjuster ba{model, loss};
  return ba.solve(
      policy, std::span<se3>(p.poses), std::span<vec3>(p.points), std::span<const bundle_observation>(p.observations),
      {.max_iterations = iterations, .relative_tolerance = 0.0, .fixed_poses = p.fixed, .ignored = ignored});
}

}  // namespace

TEST_CASE("Bundle adjustment recovers poses and points exactly from exact observations") {
  problem p = make_problem(0.0, 1);
  const auto summary = solve(p, optimize::huber{2.45}, seq);
  CHECK(summary.observations == p.observations.size());
  CHECK(summary.initial_cost > 1e3);
  CHECK(summary.final_cost < 1e-12);
  for (std::size_t i = 0; i < p.poses.size(); ++i) {
    CHECK(test::distance_between(p.poses[i], p.true_poses[i]) < 1e-7);
    CHECK(test::angle_between(p.poses[i], p.true_poses[i]) < 1e-7);
  }
  for (std::size_t j = 0; j < p.points.size(); ++j) CHECK((p.points[j] - p.true_points[j]).norm() < 1e-6);
}

TEST_CASE("At the minimum of bundle adjustment no single parameter can be bettered") {
  problem p = make_problem(1.0, 2);
  const auto summary = solve(p, optimize::huber{2.45}, seq, 60);
  const optimize::bundle_adjuster ba{model, optimize::huber{2.45}};
  const auto cost_of = [&](const problem& at) {
    double cost = 0.0;
    for (const auto& o : at.observations)
      cost += 0.5 * optimize::huber{2.45}.cost(ba.chi2(at.poses[o.pose], at.points[o.point], o));
    return cost;
  };
  CHECK(cost_of(p) == Approx(summary.final_cost).epsilon(1e-9));
  const double h = 1e-5;
  for (const std::size_t i : {2UL, 5UL, 7UL})
    for (int k = 0; k < 6; ++k)
      for (const double sign : {-1.0, 1.0}) {
        problem moved = p;
        moved.poses[i] = moved.poses[i] * se3::exp(vec6(sign * h * vec6::Unit(k)));
        CHECK(cost_of(moved) >= summary.final_cost);
      }
  for (const std::size_t j : {0UL, 70UL, 149UL})
    for (int k = 0; k < 3; ++k)
      for (const double sign : {-1.0, 1.0}) {
        problem moved = p;
        moved.points[j](k) += sign * h;
        CHECK(cost_of(moved) >= summary.final_cost);
      }
}

TEST_CASE("Bundle adjustment gives the same bytes with any number of threads") {
  problem a = make_problem(1.0, 3), b = a;
  (void)solve(a, optimize::cauchy{2.0}, seq);
  (void)solve(b, optimize::cauchy{2.0}, par.with(3));
  for (std::size_t i = 0; i < a.poses.size(); ++i)
    CHECK(a.poses[i].to_matrix().cwiseEqual(b.poses[i].to_matrix()).all());
  for (std::size_t j = 0; j < a.points.size(); ++j) CHECK(a.points[j].cwiseEqual(b.points[j]).all());
}

TEST_CASE("Bundle adjustment leaves fixed poses and ignored observations alone") {
  problem p = make_problem(0.0, 4);
  std::vector<std::uint8_t> ignored(p.observations.size(), 0);
  for (std::size_t k = 0; k < p.observations.size(); k += 5) {
    p.observations[k].pixel += vec2(300, -200);  // nonsense, but nobody looks at it
    ignored[k] = 1;
  }
  const auto summary = solve(p, optimize::trivial{}, seq, 30, ignored);
  CHECK(summary.final_cost < 1e-12);
  for (const std::size_t i : {0UL, 1UL}) CHECK(p.poses[i].to_matrix().isApprox(p.true_poses[i].to_matrix(), 0.0));
  CHECK(test::distance_between(p.poses[7], p.true_poses[7]) < 1e-6);
}

TEST_CASE("Bundle adjustment survives what cannot be adjusted and never makes it worse") {
  problem p = make_problem(0.5, 5);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  p.observations[3].pixel.x() = nan;
  p.observations[4].information = 0.0;
  p.points[10] = vec3(0, 0, -4);  // behind every camera
  p.points[11].setConstant(nan);
  std::erase_if(p.observations, [](const auto& o) { return o.point == 20; });                // seen by nobody
  std::erase_if(p.observations, [](const auto& o) { return o.point == 21 && o.pose > 0; });  // seen once
  const auto summary = solve(p, optimize::huber{2.45}, seq, 30);
  CHECK(summary.final_cost < 0.1 * summary.initial_cost);
  CHECK(p.points[10] == vec3(0, 0, -4));
  for (const auto& pose : p.poses) CHECK(pose.to_matrix().allFinite());
  CHECK(test::distance_between(p.poses[7], p.true_poses[7]) < 0.02);

  problem nothing;
  CHECK(solve(nothing, optimize::huber{}, seq).status == bundle_status::nothing_to_do);

  problem free = make_problem(0.5, 6);
  free.fixed.assign(free.fixed.size(), 0);
  const auto gauge_free = solve(free, optimize::huber{2.45}, seq, 30);
  CHECK(gauge_free.final_cost < 0.1 * gauge_free.initial_cost);

  problem stopped = make_problem(0.5, 7);
  const auto before = stopped.points;
  optimize::bundle_adjuster ba{model, optimize::huber{2.45}};
  const auto refuse = [](std::size_t, std::size_t) { return false; };
  const auto cancelled = ba.solve(seq, std::span<se3>(stopped.poses), std::span<vec3>(stopped.points),
                                  std::span<const bundle_observation>(stopped.observations), {.callback = refuse});
  CHECK(cancelled.status == bundle_status::cancelled);
  CHECK(stopped.points == before);
}
