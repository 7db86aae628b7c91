// SPDX-License-Identifier: BSD-3-Clause
//
// Whole problems: the costs that are known of them, the truth where they are generated, and, where Ceres
// is installed, its costs.
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#ifdef ORBIS_TEST_WITH_CERES
#include <optimize/ceres_bundle.hpp>
#endif

#include <orbis/camera/pinhole.hpp>
#include <orbis/io/bal.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "bundle_instances.hpp"
#include "support.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/synthetic/bundle.hpp"

using namespace orbis;
using optimize::bundle_observation;

namespace {

const std::string ladybug = "bal/bal-ladybug-problem-49-7776-pre-shrink-1800.txt";
constexpr double degree = std::numbers::pi / 180.0;
constexpr double gate = 7.815;  // chi-squared of three degrees of freedom at 95 %

/// Leaves the adjusted cameras and points in `problem`.
template <class Damping = optimize::levenberg_marquardt, class Loss = optimize::trivial>
optimize::bundle_summary adjust(io::bal_problem& problem, Damping damping = {}, Loss loss = {},
                                optimize::reduced_solver_options solver = {}, double tolerance = 1e-6) {
  std::vector<optimize::bal_camera> cameras;
  for (const auto& c : problem.cameras) cameras.push_back(optimize::bal_camera::from_parameters(c));
  std::vector<bundle_observation> observations;
  for (const auto& o : problem.observations) observations.push_back({o.camera, o.point, o.pixel});
  optimize::bundle_adjuster ba{optimize::bal_reprojection{}, loss, damping, solver};
  const auto summary =
      ba.solve(seq, std::span{cameras}, std::span{problem.points}, std::span<const bundle_observation>{observations},
               {.max_iterations = 200, .relative_tolerance = tolerance});
  for (std::size_t i = 0; i != cameras.size(); ++i) problem.cameras[i] = cameras[i].parameters();
  return summary;
}

/// Half the sum of squares, by the definition of the format.
double cost_of(const io::bal_problem& p) {
  double sum = 0.0;
  for (const auto& o : p.observations)
    sum += 0.5 * (io::project_bal(p.cameras[o.camera], p.points[o.point]).value() - o.pixel).squaredNorm();
  return sum;
}

io::bal_problem generated(test::bundle_scene scene, std::uint64_t seed = 1) {
  return test::make_bal_problem({.scene = scene, .cameras = 24, .points = 1500, .seed = seed}).measured;
}

/// Two phases, as a SLAM adjusts its local map. Returns the last cost.
double adjust_locally(test::synthetic_local_map& map) {
  optimize::bundle_adjuster ba{optimize::reprojection{map.camera, map.bf}, optimize::huber{std::sqrt(gate)}};
  std::vector<bundle_observation> observations;
  for (const auto& o : map.observations) observations.push_back({o.keyframe, o.point, o.pixel, o.right, o.information});
  const std::span<const bundle_observation> seen{observations};
  (void)ba.solve(seq, std::span{map.poses}, std::span{map.points}, seen,
                 {.max_iterations = 5, .relative_tolerance = 0.0, .fixed_poses = map.fixed});
  std::vector<std::uint8_t> outliers;
  for (const auto& o : seen) outliers.push_back(ba.chi2(map.poses[o.pose], map.points[o.point], o) > gate ? 1 : 0);
  return ba
      .solve_again(seq, std::span{map.poses}, std::span{map.points},
                   {.max_iterations = 10, .relative_tolerance = 0.0, .fixed_poses = map.fixed, .ignored = outliers})
      .final_cost;
}

struct pose_error {
  double metres = 0.0, radians = 0.0;  ///< root mean squares over the keyframes that moved
};
pose_error error_of(const test::synthetic_local_map& map) {
  pose_error e;
  int free = 0;
  for (std::size_t k = 0; k != map.poses.size(); ++k) {
    if (map.fixed[k] != 0) continue;
    e.metres += std::pow(test::distance_between(map.poses[k], map.true_poses[k]), 2);
    e.radians += std::pow(test::angle_between(map.poses[k], map.true_poses[k]), 2);
    ++free;
  }
  return {std::sqrt(e.metres / free), std::sqrt(e.radians / free)};
}

}  // namespace

TEST_CASE("A problem of the BAL collection ends at the cost that is known of it") {
  ORBIS_NEEDS_DATA(ladybug);
  const io::bal_problem start = io::read_bal(test::data_dir() / ladybug).value();
  io::bal_problem p = start;
  const auto summary = adjust(p);
  CHECK(summary.status == optimize::bundle_status::converged);
  CHECK(summary.initial_cost == Approx(cost_of(start)).epsilon(1e-9));
  CHECK(summary.final_cost == Approx(cost_of(p)).epsilon(1e-9));
  CHECK(summary.final_cost <= 3001.3592);
  CHECK(summary.final_cost > 3001.35);
}

TEST_CASE("Every way of stepping and solving ends at the same cost") {
  for (const auto scene : {test::bundle_scene::monument, test::bundle_scene::street}) {
    const io::bal_problem start = generated(scene);
    io::bal_problem p = start;
    const double best = adjust(p, {}, {}, {}, 1e-12).final_cost;
    // What is left is the noise: sigma^2 for every number that no parameter took.
    const double freedom = 2.0 * static_cast<double>(start.observations.size()) -
                           static_cast<double>(9 * start.cameras.size() + 3 * start.points.size()) + 7.0;
    CHECK(best == Approx(0.5 * 0.25 * freedom).epsilon(0.1));
    const auto ends_there = [&](auto damping, optimize::reduced_solver_options solver) {
      io::bal_problem again = start;
      const auto summary = adjust(again, damping, optimize::trivial{}, solver);
      CHECK(summary.final_cost <= best * (1.0 + 1e-5));
      CHECK(summary.final_cost >= best * (1.0 - 1e-9));
    };
    using optimize::levenberg_marquardt;
    ends_there(optimize::dogleg{}, {});
    ends_there(levenberg_marquardt{}, {});
    ends_there(levenberg_marquardt{}, {.dense_limit = 1000});
    ends_there(levenberg_marquardt{}, {.dense_limit = 0});
    ends_there(levenberg_marquardt{}, {.dense_limit = 0, .fill_limit = 0});
  }
}

TEST_CASE("Adjusting a local map in two phases brings its keyframes to where they are") {
  pose_error mean;
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U}) {
    auto map = test::make_local_map({.seed = seed});
    CHECK(error_of(map).metres > 0.01);
    (void)adjust_locally(map);
    const pose_error e = error_of(map);
    CHECK(e.metres < 0.0015);
    CHECK(e.radians < 0.03 * degree);
    mean.metres += e.metres / 4.0;
    mean.radians += e.radians / 4.0;
  }
  CHECK(mean.metres < 0.001);
  CHECK(mean.radians < 0.025 * degree);
}

#ifdef ORBIS_TEST_WITH_CERES
namespace with_ceres = bench::with_ceres;

namespace {
void compare_with_ceres(const io::bal_problem& start, double huber = 0.0) {
  io::bal_problem theirs = start, ours = start;
  const auto reference = with_ceres::solve_bal(theirs, {.huber = huber});
  const auto summary =
      huber > 0.0 ? adjust(ours, optimize::levenberg_marquardt{}, optimize::huber{huber}) : adjust(ours);
  CHECK(summary.initial_cost == Approx(reference.initial_cost).epsilon(1e-9));
  CHECK(summary.final_cost <= reference.final_cost * (1.0 + 1e-5));
}
}  // namespace

TEST_CASE("Costs are no higher than those of Ceres") {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    compare_with_ceres(generated(test::bundle_scene::monument, seed));
    compare_with_ceres(generated(test::bundle_scene::street, seed));
  }
  compare_with_ceres(test::make_bal_problem({.cameras = 20, .points = 800, .outlier_share = 0.05}).measured, 2.0);
}

TEST_CASE("The cost of a problem of the BAL collection is no higher than that of Ceres") {
  ORBIS_NEEDS_DATA(ladybug);
  compare_with_ceres(io::read_bal(test::data_dir() / ladybug).value());
}

TEST_CASE("The cost of an adjusted local map is that of Ceres") {
  for (const std::uint64_t seed : {1U, 2U}) {
    const auto start = test::make_local_map({.seed = seed});
    auto theirs = start, ours = start;
    // One phase: both minimise the same thing.
    const auto reference = with_ceres::adjust_locally(theirs, {.huber = std::sqrt(gate)}, 50, 0);
    optimize::bundle_adjuster ba{optimize::reprojection{ours.camera, ours.bf}, optimize::huber{std::sqrt(gate)}};
    std::vector<bundle_observation> observations;
    for (const auto& o : ours.observations)
      observations.push_back({o.keyframe, o.point, o.pixel, o.right, o.information});
    const auto summary =
        ba.solve(seq, std::span{ours.poses}, std::span{ours.points}, std::span<const bundle_observation>{observations},
                 {.max_iterations = 50, .fixed_poses = ours.fixed});
    CHECK(summary.initial_cost == Approx(reference.initial_cost).epsilon(1e-9));
    CHECK(summary.final_cost <= reference.final_cost * (1.0 + 1e-5));
    for (std::size_t k = 0; k != ours.poses.size(); ++k)
      CHECK(test::distance_between(ours.poses[k], theirs.poses[k]) < 1e-4);
    // Two phases: the same observations are let in, but for some at the gate.
    theirs = ours = start;
    const auto both = with_ceres::adjust_locally(
        theirs,
        {.function_tolerance = 0.0, .gradient_tolerance = 0.0, .parameter_tolerance = 0.0, .huber = std::sqrt(gate)}, 5,
        10);
    CHECK(adjust_locally(ours) == Approx(both.final_cost).epsilon(1e-3));
  }
}
#else
TEST_CASE("Costs are no higher than those of Ceres") { std::printf("[skipped] Ceres is not installed\n"); }
#endif
