// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstring>
#include <utility>

#include <orbis/core/simd/level.hpp>
#include <orbis/io/bal.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "bundle_instances.hpp"
#include "bundles.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"
#include "support/synthetic/bundle.hpp"

using namespace orbis;
using optimize::bundle_observation;
using optimize::bundle_options;
using optimize::bundle_status;
using optimize::bundle_summary;

namespace {

const auto& model = test::bundle_model;
using problem = test::bundle;
problem make_problem(double sigma, std::uint64_t seed) { return test::make_bundle({.sigma = sigma}, seed); }

template <class Loss, class Policy>
optimize::bundle_summary solve(problem& p, Loss loss, const Policy& policy, int iterations = 30,
                               std::span<const std::uint8_t> ignored = {}) {
  optimize::bundle_adjuster ba{model, loss};
  return ba.solve(
      policy, std::span<se3>(p.poses), std::span<vec3>(p.points), std::span<const bundle_observation>(p.observations),
      {.max_iterations = iterations, .relative_tolerance = 0.0, .fixed_poses = p.fixed, .ignored = ignored});
}

template <class Adjuster, class Policy>
bundle_summary run(Adjuster& ba, problem& p, const Policy& policy, bundle_options options = {}) {
  if (options.fixed_poses.empty()) options.fixed_poses = p.fixed;
  return ba.solve(policy, std::span<se3>(p.poses), std::span<vec3>(p.points),
                  std::span<const bundle_observation>(p.observations), options);
}

void check_same_bytes(const problem& a, const problem& b) {
  for (std::size_t i = 0; i < a.poses.size(); ++i)
    CHECK(a.poses[i].to_matrix().cwiseEqual(b.poses[i].to_matrix()).all());
  for (std::size_t j = 0; j < a.points.size(); ++j) CHECK(a.points[j].cwiseEqual(b.points[j]).all());
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

TEST_CASE("Bundle adjustment gives the same bytes with any number of threads and instruction set") {
  const problem start = make_problem(1.0, 3);
  problem a = start;
  (void)solve(a, optimize::cauchy{2.0}, seq);
  for (const unsigned threads : {2U, 3U, 8U}) {
    problem b = start;
    (void)solve(b, optimize::cauchy{2.0}, par.with(threads));
    check_same_bytes(a, b);
  }
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    problem b = start;
    optimize::bundle_adjuster ba{model, optimize::cauchy{2.0}, optimize::levenberg_marquardt{.initial = 1e-4},
                                 optimize::reduced_solver_options{}};
    (void)run(ba, b, seq, {.max_iterations = 30, .relative_tolerance = 0.0});
    check_same_bytes(a, b);
  }
}

TEST_CASE("Bundle adjustment does not depend on the order of observations") {
  problem a = make_problem(1.0, 8), b = a;
  random_bits random(4);
  for (std::size_t k = b.observations.size(); k > 1; --k)
    std::swap(b.observations[k - 1],
              b.observations[static_cast<std::size_t>(random.uniform() * static_cast<double>(k))]);
  CHECK(solve(a, optimize::huber{2.45}, seq).final_cost == solve(b, optimize::huber{2.45}, seq).final_cost);
  check_same_bytes(a, b);
}

TEST_CASE("Bundle adjustment does not depend on where the world's origin is") {
  problem a = make_problem(1.0, 9), b = a;
  random_bits random(5);
  const se3 moved = test::random_pose(random, 10.0);
  for (se3& pose : b.poses) pose = moved * pose;
  for (vec3& point : b.points) point = moved * point;
  const auto first = solve(a, optimize::huber{2.45}, seq), second = solve(b, optimize::huber{2.45}, seq);
  CHECK(second.initial_cost == Approx(first.initial_cost).epsilon(1e-9));
  CHECK(second.final_cost == Approx(first.final_cost).epsilon(1e-9));
  for (std::size_t i = 0; i < a.poses.size(); ++i) CHECK(test::distance_between(moved * a.poses[i], b.poses[i]) < 1e-5);
}

TEST_CASE("Every damping policy and every reduced solver ends at the same cost") {
  const problem start = make_problem(1.0, 10);
  std::vector<double> costs;
  const auto with = [&](auto damping, const optimize::reduced_solver_options& reduced) {
    problem p = start;
    optimize::bundle_adjuster ba{model, optimize::huber{2.45}, damping, reduced};
    const auto summary = run(ba, p, seq, {.max_iterations = 60, .relative_tolerance = 1e-12});
    CHECK(summary.status == bundle_status::converged);
    CHECK((summary.linear_iterations > 0) == (reduced.fill_limit == 0));
    costs.push_back(summary.final_cost);
  };
  with(optimize::levenberg_marquardt{}, {});
  with(optimize::levenberg_marquardt{.initial = 1e-7}, {.dense_limit = 1000});
  with(optimize::dogleg{}, {.dense_limit = 0});
  with(optimize::gauss_newton{}, {.dense_limit = 0, .fill_limit = 0});
  for (const double cost : costs) CHECK(cost == Approx(costs.front()).epsilon(1e-7));
}

TEST_CASE("A second phase without a rebuild is what a fresh start with the same mask would be") {
  problem p = make_problem(0.7, 11);
  for (std::size_t k = 0; k < p.observations.size(); k += 17) p.observations[k].pixel += vec2(35, -20);
  optimize::bundle_adjuster ba{model, optimize::huber{2.45}};
  (void)run(ba, p, seq, {.max_iterations = 5});
  std::vector<double> squared(p.observations.size());
  ba.chi2(p.poses, p.points, p.observations, squared);
  std::vector<std::uint8_t> outliers;
  for (std::size_t k = 0; k < squared.size(); ++k) {
    const auto& o = p.observations[k];
    CHECK(squared[k] == ba.chi2(p.poses[o.pose], p.points[o.point], o));
    outliers.push_back(squared[k] > 7.815 ? 1 : 0);
  }
  problem again = p;
  const bundle_options options{.fixed_poses = p.fixed, .ignored = outliers};
  const auto second = ba.solve_again(seq, std::span<se3>(p.poses), std::span<vec3>(p.points), options);
  optimize::bundle_adjuster fresh{model, optimize::huber{2.45}};
  const auto expected = run(fresh, again, seq, options);
  CHECK(second.final_cost == expected.final_cost);
  CHECK(second.observations == expected.observations);
  CHECK(second.observations < p.observations.size());
  check_same_bytes(p, again);

  // Other fixed poses: the structure follows.
  std::vector<std::uint8_t> others(p.poses.size(), 0);
  others[4] = 1;
  const auto held = p.poses[4].to_matrix();
  const auto free_before = p.poses[0].to_matrix();
  (void)ba.solve_again(seq, std::span<se3>(p.poses), std::span<vec3>(p.points), {.fixed_poses = others});
  CHECK(p.poses[4].to_matrix() == held);
  CHECK(p.poses[0].to_matrix() != free_before);
}

TEST_CASE("A local map is adjusted to a millimetre and a fortieth of a degree") {
  const auto m = test::make_local_map({});
  problem p{m.poses, m.true_poses, m.points, m.true_points, {}, m.fixed};
  for (const auto& o : m.observations) p.observations.push_back({o.keyframe, o.point, o.pixel, o.right, o.information});
  optimize::bundle_adjuster ba{optimize::reprojection{m.camera, m.bf}, optimize::huber{2.8}};
  (void)run(ba, p, seq, {.max_iterations = 5});
  std::vector<double> squared(p.observations.size());
  ba.chi2(p.poses, p.points, p.observations, squared);
  std::vector<std::uint8_t> outliers;
  std::size_t right = 0;
  for (std::size_t k = 0; k < squared.size(); ++k) {
    outliers.push_back(squared[k] > 7.815 ? 1 : 0);
    right += outliers[k] == m.wrong[k];
  }
  CHECK(static_cast<double>(right) > 0.97 * static_cast<double>(squared.size()));
  (void)ba.solve_again(seq, std::span<se3>(p.poses), std::span<vec3>(p.points),
                       {.fixed_poses = p.fixed, .ignored = outliers});
  double distance = 0.0, angle = 0.0, moving = 0.0;
  for (std::size_t i = 0; i < p.poses.size(); ++i) {
    if (p.fixed[i] != 0) continue;
    moving += 1.0;
    distance += std::pow(test::distance_between(p.poses[i], p.true_poses[i]), 2);
    angle += std::pow(test::angle_between(p.poses[i], p.true_poses[i]), 2);
  }
  CHECK(std::sqrt(distance / moving) < 0.001);
  CHECK(std::sqrt(angle / moving) * 180.0 / 3.14159265358979 < 0.025);
}

TEST_CASE("Points can be held, and the gauge by the first camera") {
  problem p = make_problem(0.5, 12);
  std::vector<std::uint8_t> held(p.points.size(), 0);
  for (std::size_t j = 0; j < held.size(); j += 3) {
    held[j] = 1;
    p.points[j] = p.true_points[j];
  }
  const auto before = p.points;
  std::vector<std::uint8_t> none(p.poses.size(), 0);
  optimize::bundle_adjuster ba{model, optimize::huber{2.45}};
  const auto summary = run(ba, p, seq, {.max_iterations = 20, .fixed_poses = none, .fixed_points = held});
  CHECK(summary.final_cost < 0.1 * summary.initial_cost);
  for (std::size_t j = 0; j < held.size(); ++j) CHECK((p.points[j] == before[j]) == (held[j] != 0));
  for (std::size_t i = 0; i < p.poses.size(); ++i) CHECK(test::distance_between(p.poses[i], p.true_poses[i]) < 0.02);

  // Everything held: nothing to do.
  std::vector<std::uint8_t> all_poses(p.poses.size(), 1), all_points(p.points.size(), 1);
  CHECK(run(ba, p, seq, {.fixed_poses = all_poses, .fixed_points = all_points}).status == bundle_status::nothing_to_do);
  CHECK(run(ba, p, seq, {.fixed_poses = all_poses}).final_cost <= summary.final_cost);
}

TEST_CASE("Bundle adjustment says what is wrong with its input and where, and leaves it alone") {
  const problem good = make_problem(0.5, 14);
  const auto refused = [&](problem p, bundle_status status, std::size_t where) {
    const problem before = p;
    optimize::bundle_adjuster ba{model};
    const auto summary = run(ba, p, seq);
    CHECK(summary.status == status);
    CHECK(optimize::is_failure(summary.status));
    CHECK(summary.where == where);
    CHECK(to_string(summary).find(std::to_string(where)) != std::string::npos);
    CHECK(std::memcmp(p.points.data(), before.points.data(), sizeof(vec3) * p.points.size()) == 0);
  };
  problem p = good;
  p.observations[17].pose = 8;
  refused(p, bundle_status::missing_pose, 17);
  p = good;
  p.observations[23].point = 150;
  refused(p, bundle_status::missing_point, 23);
  p = good;
  p.poses[5] = se3{so3{}, vec3(0, std::numeric_limits<double>::quiet_NaN(), 0)};
  refused(p, bundle_status::bad_pose, 5);

  // A point seen once without depth is not determined: nobody damps it.
  p = test::make_bundle({.depth_share = 0.0, .sigma = 0.5}, 15);
  std::erase_if(p.observations, [](const auto& o) { return o.point == 7 && o.pose != 4; });
  const auto before = p.points;
  optimize::bundle_adjuster newton{model, optimize::huber{2.45}, optimize::gauss_newton{}};
  const auto summary = run(newton, p, seq);
  CHECK(summary.status == bundle_status::undetermined_pose);
  CHECK(summary.where == 4);
  CHECK(p.points == before);
  optimize::bundle_adjuster damped{model, optimize::huber{2.45}};
  CHECK(run(damped, p, seq, {.max_iterations = 30}).final_cost < 0.1 * summary.initial_cost);
}

TEST_CASE("Bundle adjustment never makes degenerate geometry worse") {
  using change = void (*)(problem&);
  const std::pair<const char*, change> cases[] = {
      {"points at infinity",
       [](problem& p) {
         for (std::size_t j = 0; j < 20; ++j) p.points[j] *= 1e9;
       }},
      {"half of the points behind the cameras",
       [](problem& p) {
         for (std::size_t j = 0; j < 75; ++j) p.points[j].z() *= -1.0;
       }},
      {"one observation", [](problem& p) { p.observations.resize(1); }},
      {"the same camera many times",
       [](problem& p) {
         for (se3& pose : p.poses) pose = p.poses[0];
         std::fill(p.fixed.begin(), p.fixed.end(), std::uint8_t{0});
       }},
      {"no parallax",
       [](problem& p) {
         for (se3& pose : p.poses) pose = se3{pose.rotation(), vec3::Zero()};
         for (auto& o : p.observations) o.right = std::numeric_limits<double>::quiet_NaN();
       }},
      {"points on a line",
       [](problem& p) {
         for (std::size_t j = 0; j < p.points.size(); ++j) p.points[j] = vec3(0.01 * static_cast<double>(j), 0, 2);
       }},
      {"all points the same", [](problem& p) { std::fill(p.points.begin(), p.points.end(), vec3(0, 0, 2)); }},
      {"nothing but outliers",
       [](problem& p) {
         random_bits random(3);
         for (auto& o : p.observations) o.pixel = vec2(random.uniform(0, 640), random.uniform(0, 480));
       }},
      {"a point in a camera's centre", [](problem& p) { p.points[3] = p.poses[2].translation(); }},
      {"enormous information",
       [](problem& p) {
         for (auto& o : p.observations) o.information = 1e200;
       }},
      {"pixels far away", [](problem& p) { p.observations[5].pixel.x() = 1e300; }},
      {"a camera with one observation", [](problem& p) {
         bool kept = false;
         std::erase_if(p.observations, [&](const auto& o) { return o.pose == 6 && std::exchange(kept, true); });
       }}};
  for (const auto& [name, spoil] : cases)
    for (const bool fixes : {true, false}) {
      INFO(name << (fixes ? ", fixed poses" : ", free gauge"));
      problem p = make_problem(0.5, 16);
      spoil(p);
      if (!fixes) p.fixed.assign(p.fixed.size(), 0);
      const auto check = [&](auto damping) {
        problem q = p;
        optimize::bundle_adjuster ba{model, optimize::huber{2.45}, damping};
        const auto summary = run(ba, q, seq, {.max_iterations = 15});
        CHECK_FALSE(
            (summary.observations != 0 && summary.initial_cost > 0.0 && !(summary.final_cost <= summary.initial_cost)));
        for (const auto& pose : q.poses) CHECK(pose.to_matrix().allFinite());
        for (const auto& point : q.points) CHECK(point.allFinite());
      };
      check(optimize::levenberg_marquardt{});
      check(optimize::dogleg{});
    }
}

TEST_CASE("Bundle adjustment allocates nothing after the first solve") {
  const problem start = make_problem(1.0, 17);
  problem p = start;
  optimize::bundle_adjuster ba{model, optimize::huber{2.45}};
  (void)run(ba, p, seq);
  (void)ba.solve_again(seq, std::span<se3>(p.poses), std::span<vec3>(p.points), {.fixed_poses = p.fixed});
  p.poses = start.poses;
  p.points = start.points;
  const std::size_t before = test::allocations();
  (void)run(ba, p, seq);
  (void)ba.solve_again(seq, std::span<se3>(p.poses), std::span<vec3>(p.points), {.fixed_poses = p.fixed});
  CHECK(test::allocations() == before);

  // A smaller problem, then this one again: a few vectors whose size has changed.
  problem small = start;
  std::erase_if(small.observations, [](const auto& o) { return o.point % 8 != 0; });
  p.poses = start.poses;
  p.points = start.points;
  const std::size_t after = test::allocations();
  (void)run(ba, small, seq);
  (void)run(ba, p, seq);
  CHECK(test::allocations() - after <= 16);
}

TEST_CASE("An observer sees every step, and a callback can stop them") {
  problem p = make_problem(1.0, 18);
  optimize::bundle_adjuster ba{model, optimize::huber{2.45}};
  std::vector<bundle_summary> seen;
  const auto two = [](std::size_t done, std::size_t) { return done < 2; };
  const auto summary = ba.solve(seq, std::span<se3>(p.poses), std::span<vec3>(p.points),
                                std::span<const bundle_observation>(p.observations), {.fixed_poses = p.fixed}, two,
                                [&](const bundle_summary& s) { seen.push_back(s); });
  CHECK(summary.status == bundle_status::cancelled);
  CHECK(summary.iterations == 2);
  REQUIRE(seen.size() == 3);
  CHECK(seen[0].final_cost == summary.initial_cost);
  CHECK(seen[1].final_cost < seen[0].final_cost);
  CHECK(seen[2].final_cost == summary.final_cost);
  CHECK(summary.seconds.linearize > 0.0);
  CHECK(summary.seconds.schur > 0.0);
  double cost = 0.0;
  for (const auto& o : p.observations)
    cost += 0.5 * optimize::huber{2.45}.cost(ba.chi2(p.poses[o.pose], p.points[o.point], o));
  CHECK(cost == Approx(summary.final_cost).epsilon(1e-9));  // what was reached is kept
}

TEST_CASE("A problem of Bundle Adjustment in the Large is solved") {
  const char* const name = "bal/bal-ladybug-problem-49-7776-pre-shrink-1800.txt";
  ORBIS_NEEDS_DATA(name);
  const auto file = io::read_bal(test::data_dir() / name);
  REQUIRE(file);
  std::vector<optimize::bal_camera> cameras;
  for (const auto& c : file->cameras) cameras.push_back(optimize::bal_camera::from_parameters(c));
  std::vector<bundle_observation> observations;
  for (const auto& o : file->observations) observations.push_back({o.camera, o.point, o.pixel});
  auto moved = cameras;
  auto points = file->points;
  optimize::bundle_adjuster ba{optimize::bal_reprojection{}, optimize::trivial{}};
  const auto summary = ba.solve(seq, std::span<optimize::bal_camera>(moved), std::span<vec3>(points),
                                std::span<const bundle_observation>(observations), {.max_iterations = 50});
  CHECK(summary.observations == observations.size());
  CHECK(summary.initial_cost == Approx(2.345198e5).epsilon(1e-6));
  CHECK(summary.status == bundle_status::converged);
  CHECK(moved[0].parameters() != cameras[0].parameters());
  CHECK(summary.final_cost < 3.00137e3);
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
                                  std::span<const bundle_observation>(stopped.observations), {}, refuse);
  CHECK(cancelled.status == bundle_status::cancelled);
  CHECK(stopped.points == before);
}
