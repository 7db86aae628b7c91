// SPDX-License-Identifier: BSD-3-Clause
//
// Bundle adjustment beside Ceres, on one thread: the local map of a SLAM in two phases of 5 and 10
// iterations, and problems of "Bundle Adjustment in the Large", generated or read: those of the data
// folder and those that the environment names, ORBIS_BAL_FILES=one.txt:another.txt. Everyone starts from
// the same estimate and must end with the same cost; making the problem from plain arrays is part of it.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <system_error>
#include <vector>

#include <benchmark/benchmark.h>

#ifdef ORBIS_BENCH_WITH_CERES
#include "optimize/ceres_bundle.hpp"
#endif

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/io/bal.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "support/synthetic/bundle.hpp"

namespace orbis::bench {
namespace {

using namespace orbis::optimize;

struct reached {
  double cost = 0.0;
  int iterations = 0;
};

// --- the local map of a SLAM ------------------------------------------------------------------------

constexpr double gate = 7.815;  ///< chi-squared of three degrees of freedom at 95 %
constexpr int first_phase = 5, second_phase = 10;

struct local_map {
  test::synthetic_local_map given;
  reached expected;
};

template <class Policy>
reached adjust_locally(const Policy& policy, const test::synthetic_local_map& map) {
  // Kept from call to call, as a SLAM keeps it.
  static bundle_adjuster ba{reprojection{map.camera, map.bf}, huber{std::sqrt(gate)}};
  static std::vector<bundle_observation> observations;
  static std::vector<std::uint8_t> outliers;
  static std::vector<double> squared;
  std::vector<se3> poses = map.poses;
  std::vector<vec3> points = map.points;
  observations.clear();
  for (const auto& o : map.observations) observations.push_back({o.keyframe, o.point, o.pixel, o.right, o.information});
  const std::span<const bundle_observation> seen{observations};
  const auto first = ba.solve(policy, std::span{poses}, std::span{points}, seen,
                              {.max_iterations = first_phase, .relative_tolerance = 0.0, .fixed_poses = map.fixed});
  squared.resize(observations.size());
  ba.chi2(poses, points, seen, squared);
  outliers.assign(observations.size(), 0);
  for (std::size_t k = 0; k != outliers.size(); ++k) outliers[k] = squared[k] > gate ? 1 : 0;
  const auto second = ba.solve_again(
      policy, std::span{poses}, std::span{points},
      {.max_iterations = second_phase, .relative_tolerance = 0.0, .fixed_poses = map.fixed, .ignored = outliers});
  return {second.final_cost, first.iterations + second.iterations};
}

local_map& map_named(const std::string& name) {
  static std::map<std::string, local_map> made;
  if (const auto found = made.find(name); found != made.end()) return found->second;
  local_map& m = made[name];
  m.given = test::make_local_map(
      name == "20_free_10_fixed"
          ? test::synthetic_local_map_options{}
          : test::synthetic_local_map_options{
                .free_keyframes = 60, .fixed_keyframes = 30, .points = 10000, .views_per_point = 5.85});
  m.expected = adjust_locally(seq, m.given);
  return m;
}

// --- Bundle Adjustment in the Large -----------------------------------------------------------------

struct large_problem {
  io::bal_problem given;
  double best = 0.0;  ///< the lowest cost that can be reached from there
};

template <class Policy>
reached solve_bal(const Policy& policy, const io::bal_problem& problem, int max_iterations = 100,
                  double tolerance = 1e-6) {
  std::vector<bal_camera> cameras;
  for (const auto& parameters : problem.cameras) cameras.push_back(bal_camera::from_parameters(parameters));
  std::vector<vec3> points = problem.points;
  std::vector<bundle_observation> observations;
  observations.reserve(problem.observations.size());
  for (const auto& o : problem.observations) observations.push_back({o.camera, o.point, o.pixel});
  bundle_adjuster ba{bal_reprojection{}, trivial{}};
  const auto summary =
      ba.solve(policy, std::span{cameras}, std::span{points}, std::span<const bundle_observation>{observations},
               {.max_iterations = max_iterations, .relative_tolerance = tolerance});
  return {summary.final_cost, summary.iterations};
}

large_problem& problem_named(const std::string& name, const std::string& path) {
  static std::map<std::string, large_problem> made;
  if (const auto found = made.find(name); found != made.end()) return found->second;
  large_problem& p = made[name];
  if (!path.empty()) {
    auto read = io::read_bal(std::filesystem::path{path});
    if (!read) {
      std::fprintf(stderr, "%s\n", read.error().to_string().c_str());
      return p;
    }
    p.given = *read;
  } else {
    const int cameras = std::atoi(name.substr(name.rfind('_') + 1).c_str());
    p.given = test::make_bal_problem(
                  {.scene = name.starts_with("street") ? test::bundle_scene::street : test::bundle_scene::monument,
                   .cameras = cameras,
                   .points = 200 * cameras})
                  .measured;
  }
  p.best = solve_bal(seq, p.given, 300, 1e-9).cost;
  return p;
}

// --- rows -------------------------------------------------------------------------------------------

void add_row(const std::string& name, std::function<void(benchmark::State&)> run) {
  benchmark::RegisterBenchmark(name.c_str(), [=](benchmark::State& state) { run(state); })
      ->Unit(benchmark::kMillisecond)
      ->UseRealTime();
}

/// Runs `solve`; a cost above `best` by more than `share` is no result.
template <class Solve>
void measure(benchmark::State& state, const Solve& solve, double best, double share) {
  reached r;
  for (auto _ : state) benchmark::DoNotOptimize(r = solve());
  if (!(r.cost <= best * (1.0 + share))) state.SkipWithError("another cost");
  state.counters["cost"] = r.cost;
  state.counters["iterations"] = r.iterations;
}

void add_local(const std::string& map, const std::string& who,
               std::function<reached(const test::synthetic_local_map&)> solve) {
  add_row("local_bundle/" + map + "/" + who, [=](benchmark::State& state) {
    const local_map& m = map_named(map);
    measure(
        state, [&] { return solve(m.given); }, m.expected.cost, 1e-3);
  });
}

void add_large(const std::string& name, const std::string& path, const std::string& who,
               std::function<reached(const io::bal_problem&)> solve) {
  add_row("bundle/" + name + "/" + who, [=](benchmark::State& state) {
    const large_problem& p = problem_named(name, path);
    if (p.given.observations.empty()) return state.SkipWithError("no problem");
    measure(
        state, [&] { return solve(p.given); }, p.best, 1e-2);
  });
}

#ifdef ORBIS_BENCH_WITH_CERES
reached ceres_locally(const test::synthetic_local_map& given, ceres::LinearSolverType solver) {
  test::synthetic_local_map map = given;
  const auto done = with_ceres::adjust_locally(map,
                                               {.solver = solver,
                                                .dense = ceres::LAPACK,
                                                .function_tolerance = 0.0,
                                                .gradient_tolerance = 0.0,
                                                .parameter_tolerance = 0.0,
                                                .huber = std::sqrt(gate)},
                                               first_phase, second_phase);
  return {done.final_cost, done.iterations};
}

reached ceres_bal(const io::bal_problem& given, ceres::LinearSolverType solver) {
  io::bal_problem problem = given;
  const auto done = with_ceres::solve_bal(problem, {.solver = solver, .dense = ceres::LAPACK});
  return {done.final_cost, done.iterations};
}
#endif

/// Ceres' conjugate gradients take minutes where cameras stand along a way.
void register_large(const std::string& name, const std::string& path) {
  add_large(name, path, "orbis", [](const io::bal_problem& p) { return solve_bal(seq, p); });
  add_large(name, path, "orbis_par2", [](const io::bal_problem& p) { return solve_bal(par.with(2), p); });
#ifdef ORBIS_BENCH_WITH_CERES
  add_large(name, path, "ceres_dense_schur", [](const io::bal_problem& p) { return ceres_bal(p, ceres::DENSE_SCHUR); });
  add_large(name, path, "ceres_sparse_schur",
            [](const io::bal_problem& p) { return ceres_bal(p, ceres::SPARSE_SCHUR); });
  if (!name.starts_with("street"))
    add_large(name, path, "ceres_iterative_schur",
              [](const io::bal_problem& p) { return ceres_bal(p, ceres::ITERATIVE_SCHUR); });
#endif
}

[[maybe_unused]] const bool registered = [] {
  for (const std::string map : {"20_free_10_fixed", "60_free_30_fixed"}) {
    add_local(map, "orbis", [](const test::synthetic_local_map& m) { return adjust_locally(seq, m); });
    add_local(map, "orbis_par2", [](const test::synthetic_local_map& m) { return adjust_locally(par.with(2), m); });
#ifdef ORBIS_BENCH_WITH_CERES
    add_local(map, "ceres_dense_schur",
              [](const test::synthetic_local_map& m) { return ceres_locally(m, ceres::DENSE_SCHUR); });
    add_local(map, "ceres_sparse_schur",
              [](const test::synthetic_local_map& m) { return ceres_locally(m, ceres::SPARSE_SCHUR); });
#endif
  }
  for (const char* name : {"monument_21", "monument_60", "street_60", "street_200"}) register_large(name, "");
  std::vector<std::filesystem::path> files;
  std::error_code none;
  for (const auto& entry : std::filesystem::directory_iterator{ORBIS_DATA_DIR "/bal", none})
    if (entry.path().extension() == ".txt") files.push_back(entry.path());
  if (const char* more = std::getenv("ORBIS_BAL_FILES")) {
    std::string name;
    for (const char* c = more;; ++c) {
      if (*c != ':' && *c != '\0') {
        name += *c;
        continue;
      }
      if (!name.empty()) files.emplace_back(name);
      name.clear();
      if (*c == '\0') break;
    }
  }
  std::sort(files.begin(), files.end());
  for (const auto& file : files) register_large(file.stem().string(), file.string());
  return true;
}();

}  // namespace
}  // namespace orbis::bench
