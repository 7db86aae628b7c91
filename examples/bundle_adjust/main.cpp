// SPDX-License-Identifier: BSD-3-Clause
//
// bundle_adjust FILE.txt: adjusts cameras and points of a file of "Bundle Adjustment in the Large";
// iteration table, or --json.
#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <orbis/io/bal.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

namespace optimize = orbis::optimize;

struct settings {
  std::string input, output, loss = "none", damping = "levenberg-marquardt", solver = "automatic";
  double width = 1.0, tolerance = 1e-6;
  int max_iterations = 100;
  unsigned threads = 1;
  bool json = false;
};

int complain(int code, const std::string& why) {
  std::fprintf(stderr, "bundle_adjust: %s\n", why.c_str());
  return code;
}

/// What a file holds, as the solver wants it.
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

void print_json(const settings& s, const bundle& b, const optimize::bundle_summary& r) {
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

optimize::automatic_reduced_solver solver_named(const std::string& name) {
  constexpr auto any = std::numeric_limits<std::size_t>::max();
  if (name == "dense") return {.dense_limit = any};
  if (name == "sparse") return {.dense_limit = 0, .fill_limit = any};
  if (name == "iterative") return {.dense_limit = 0, .fill_limit = 0};
  return {};
}

/// One way to step or the other: where that is chosen at run time, one type does for both.
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
int run(const settings& s, orbis::io::bal_problem& problem, Loss loss) {
  bundle b{problem};
  optimize::bundle_adjuster adjuster{optimize::bal_reprojection{}, loss, chosen_damping{s.damping == "dogleg"},
                                     solver_named(s.solver)};
  // Of the gradient a step tells where it began: it ends the line before its own. Of the last estimate it is not known.
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
  if (is_failure(summary.status)) return complain(2, s.input + ": " + to_string(summary));
  if (!s.output.empty()) {
    b.write_to(problem);
    if (const auto done = write_bal(s.output, problem); !done) return complain(2, done.error().to_string());
  }
  if (s.json) {
    print_json(s, b, summary);
    return 0;
  }
  std::printf("%s; half the sum of squares over %zu cameras, %zu points and %zu observations\n",
              to_string(summary).c_str(), b.cameras.size(), b.points.size(), summary.observations);
  if (summary.left_out != 0)
    std::printf("left out: %zu observations without a projection, the first is number %zu\n", summary.left_out,
                summary.first_left_out);
  return 0;
}

int main(int argc, char** argv) {
  settings s;
  CLI::App cli{"Adjusts cameras and points of a file of Bundle Adjustment in the Large", "bundle_adjust"};
  cli.add_option("FILE", s.input, "the problem, unpacked")->required();
  cli.add_option("--out,--output", s.output, "where to write the problem with its new cameras and points");
  cli.add_option("--loss", s.loss, "robust loss")
      ->check(CLI::IsMember({"none", "huber", "cauchy", "tukey"}))
      ->capture_default_str();
  cli.add_option("--width", s.width, "of the loss, pixels")->check(CLI::PositiveNumber)->capture_default_str();
  cli.add_option("--damping", s.damping, "how to step")
      ->check(CLI::IsMember({"levenberg-marquardt", "dogleg"}))
      ->capture_default_str();
  cli.add_option("--solver", s.solver, "of the reduced system")
      ->check(CLI::IsMember({"automatic", "dense", "sparse", "iterative"}))
      ->capture_default_str();
  cli.add_option("--tolerance", s.tolerance, "ends when a step lowers the cost by less than this share")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  cli.add_option("--max-iterations", s.max_iterations)->check(CLI::NonNegativeNumber)->capture_default_str();
  cli.add_option("--threads", s.threads, "0: all there are")->capture_default_str();
  cli.add_flag("--json", s.json, "print the summary as JSON");
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return e.get_exit_code() == 0 ? cli.exit(e) : complain(1, e.what() + std::string{" (--help shows the usage)"});
  }
  auto problem = orbis::io::read_bal(std::filesystem::path{s.input});
  if (!problem) return complain(2, problem.error().to_string());
  if (s.loss == "huber") return run(s, *problem, optimize::huber{s.width});
  if (s.loss == "cauchy") return run(s, *problem, optimize::cauchy{s.width});
  if (s.loss == "tukey") return run(s, *problem, optimize::tukey{s.width});
  return run(s, *problem, optimize::trivial{});
}
