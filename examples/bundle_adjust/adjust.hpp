// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment with a robust loss. The solver is compiled once for each loss; the compilations are divided
/// between two source files.
#pragma once

#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <orbis/io/bal.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#include "../common/report_error.hpp"

namespace optimize = orbis::optimize;

struct settings {
  std::string input, output, loss = "none", damping = "levenberg-marquardt", solver = "automatic";
  double width = 1.0, tolerance = 1e-6;
  int max_iterations = 100;
  unsigned threads = 1;
  bool json = false;
};

inline int report_error(int code, const std::string& why) { return examples::report_error("bundle_adjust", code, why); }

/// A problem from a file, in the form that the solver takes.
struct bundle {
  std::vector<optimize::bal_camera> cameras;
  std::vector<orbis::vec3> points;
  std::vector<optimize::bundle_observation> observations;

  explicit bundle(const orbis::io::bal_problem& problem) : points{problem.points} {
    for (const auto& parameters : problem.cameras) cameras.push_back(optimize::bal_camera::from_parameters(parameters));
    for (const auto& o : problem.observations) observations.push_back({o.camera, o.point, o.pixel});
  }
  void write_to(orbis::io::bal_problem& problem) const {
    for (std::size_t i = 0; i != cameras.size(); ++i) problem.cameras[i] = cameras[i].parameters();
    problem.points = points;
  }
};

inline void print_json(const settings& s, const bundle& b, const optimize::bundle_summary& r) {
  const auto& t = r.seconds;
  std::printf(
      "{\"status\": \"%s\", \"cameras\": %zu, \"points\": %zu, \"observations\": %zu, \"left_out\": %zu, "
      "\"initial_cost\": %.17g, \"final_cost\": %.17g, ",
      to_string(r).c_str(), b.cameras.size(), b.points.size(), r.observations, r.left_out, r.initial_cost,
      r.final_cost);
  if (s.loss == "none" && r.observations != 0)
    std::printf("\"rms_pixels\": %.17g, ", std::sqrt(2.0 * r.final_cost / static_cast<double>(r.observations)));
  else
    std::printf("\"rms_pixels\": null, ");
  std::printf(
      "\"iterations\": %d, \"steps_tried\": %d, \"linear_iterations\": %d, \"seconds\": {\"set_up\": %.6f, "
      "\"linearize\": %.6f, \"schur\": %.6f, \"factor\": %.6f, \"solve\": %.6f, \"back_substitute\": %.6f, "
      "\"evaluate\": %.6f}}\n",
      r.iterations, r.steps_tried, r.linear_iterations, t.set_up, t.linearize, t.schur, t.factor, t.solve,
      t.back_substitute, t.evaluate);
}

inline optimize::reduced_solver_options solver_named(const std::string& name) {
  constexpr auto any = std::numeric_limits<std::size_t>::max();
  if (name == "dense") return {.dense_limit = any};
  if (name == "sparse") return {.dense_limit = 0, .fill_limit = any};
  if (name == "iterative") return {.dense_limit = 0, .fill_limit = 0};
  return {};
}

/// A damping strategy that is selected at run time.
struct chosen_damping {
  bool dogleg = false;
  struct state {
    optimize::levenberg_marquardt::state levenberg_marquardt;
    optimize::dogleg::state dogleg;
  };
  template <class Problem>
  optimize::step_outcome advance(state& s, Problem& problem, optimize::step_workspace& w) const {
    if (dogleg) return optimize::dogleg{}.advance(s.dogleg, problem, w);
    return optimize::levenberg_marquardt{}.advance(s.levenberg_marquardt, problem, w);
  }
};

template <class Loss>
int adjust(const settings& s, orbis::io::bal_problem& problem, Loss loss) {
  bundle b{problem};
  optimize::bundle_adjuster adjuster{optimize::bal_reprojection{}, loss, chosen_damping{s.damping == "dogleg"},
                                     solver_named(s.solver)};
  // A step reports the gradient at its start, which belongs in the previous line. For the last estimate it is unknown.
  bool in_line = false;
  const auto print = [&](const optimize::bundle_summary& now) {
    if (s.json) return;
    if (in_line) std::printf(" %14.4g\n", now.gradient);
    std::printf("%9d %20.10g %12d", now.iterations, now.final_cost, now.steps_tried);
    std::fflush(stdout);
    in_line = true;
  };
  if (!s.json) std::printf("%9s %20s %12s %14s\n", "iteration", "cost", "steps tried", "gradient");
  const auto summary =
      adjuster.solve(orbis::par.with(s.threads), std::span{b.cameras}, std::span{b.points},
                     std::span<const optimize::bundle_observation>{b.observations},
                     {.max_iterations = s.max_iterations, .relative_tolerance = s.tolerance}, {}, print);
  if (in_line) std::printf("\n");
  if (is_failure(summary.status)) return report_error(2, s.input + ": " + to_string(summary));
  if (!std::isfinite(summary.initial_cost) || !std::isfinite(summary.final_cost))
    return report_error(2, s.input + ": the cost is not finite: the numbers are too large");
  if (!s.output.empty()) {
    b.write_to(problem);
    if (const auto done = write_bal(s.output, problem); !done) return report_error(2, examples::describe(done.error()));
  }
  if (s.json) {
    print_json(s, b, summary);
    return 0;
  }
  std::printf("%s; half the sum of squares over %zu cameras, %zu points and %zu observations\n",
              to_string(summary).c_str(), b.cameras.size(), b.points.size(), summary.observations);
  if (summary.left_out != 0)
    std::printf("omitted: %zu observations without a projection; index of the first: %zu\n", summary.left_out,
                summary.first_left_out);
  return 0;
}

/// Adjusts with a redescending loss, "cauchy" or "tukey".
int adjust_redescending(const settings& s, orbis::io::bal_problem& problem);
/// Adjusts with the loss "huber" or "none".
int adjust_convex(const settings& s, orbis::io::bal_problem& problem);
