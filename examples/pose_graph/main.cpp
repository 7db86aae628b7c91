// SPDX-License-Identifier: BSD-3-Clause
//
// pose_graph FILE.g2o: optimises the poses of a g2o file and prints a table of iterations, or JSON (--json).
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <orbis/io/g2o.hpp>
#include <orbis/optimize/pose_graph-inl.hpp>

#include "../common/program.hpp"
#include "../common/same_file.hpp"
#include "chordal.hpp"

namespace optimize = orbis::optimize;

struct settings {
  std::string input, output, loss = "none", damping = "dogleg";
  double width = 1.0;
  int max_iterations = 100;
  unsigned threads = 1;
  bool chordal = false, json = false;
};

int report_error(int code, const std::string& why) { return examples::report_error("pose_graph", code, why); }

void print_json(const settings& s, const orbis::io::g2o_graph& graph, const optimize::pose_graph_summary& r) {
  const auto& t = r.seconds;
  std::printf(
      "{\"status\": \"%s\", \"vertices\": %zu, \"edges\": %zu, \"initial_cost\": %.17g, \"final_cost\": %.17g, ",
      to_string(r).c_str(), graph.vertices.size(), graph.edges.size(), r.initial_cost, r.final_cost);
  if (s.loss == "none")
    std::printf("\"chi2\": %.17g, ", 2.0 * r.final_cost);
  else
    std::printf("\"chi2\": null, ");
  std::printf(
      "\"iterations\": %d, \"factorizations\": %d, \"seconds\": {\"set_up\": %.6f, \"linearize\": %.6f, "
      "\"factor\": %.6f, \"solve\": %.6f, \"evaluate\": %.6f}}\n",
      r.iterations, r.factorizations, t.set_up, t.linearize, t.factor, t.solve, t.evaluate);
}

/// A damping strategy that is chosen at run time: with a single type, the solver is compiled only once for each loss.
struct chosen_damping {
  std::string name;
  struct state {
    optimize::gauss_newton::state gauss_newton;
    optimize::dogleg::state dogleg;
    optimize::levenberg_marquardt::state levenberg_marquardt;
  };
  template <class Problem>
  optimize::step_outcome advance(state& s, Problem& problem, optimize::step_workspace& w) const {
    if (name == "gauss-newton") return optimize::gauss_newton{}.advance(s.gauss_newton, problem, w);
    if (name == "dogleg") return optimize::dogleg{}.advance(s.dogleg, problem, w);
    return optimize::levenberg_marquardt{}.advance(s.levenberg_marquardt, problem, w);
  }
};

template <class Loss>
int run(const settings& s, orbis::io::g2o_graph& graph, Loss loss) {
  optimize::pose_graph_solver<orbis::se3, Loss, chosen_damping> solver{loss, chosen_damping{s.damping}};
  if (!s.json) std::printf("%9s %20s %15s\n", "iteration", "cost", "factorizations");
  const auto summary =
      solver.solve(orbis::par.with(s.threads), std::span{graph.vertices}, graph.edges,
                   {.max_iterations = s.max_iterations,
                    .fixed = graph.fixed,
                    .hold = optimize::pose_graph_gauge::first_of_each_piece},
                   {}, [&](const optimize::pose_graph_summary& now) {
                     if (!s.json) std::printf("%9d %20.10g %15d\n", now.iterations, now.final_cost, now.factorizations);
                   });
  if (is_failure(summary.status)) return report_error(2, s.input + ": " + to_string(summary));
  if (!std::isfinite(summary.initial_cost) || !std::isfinite(summary.final_cost))
    return report_error(2, s.input + ": the cost is not finite: the numbers are too large");
  if (!s.output.empty())
    if (const auto done = write_g2o(s.output, graph); !done) return report_error(2, examples::describe(done.error()));
  if (s.json)
    print_json(s, graph, summary);
  else
    std::printf("%s; half the sum of squares over %zu vertices and %zu edges\n", to_string(summary).c_str(),
                graph.vertices.size(), graph.edges.size());
  return 0;
}

int run_command(int argc, char** argv) {
  settings s;
  CLI::App cli{"Optimise the poses of a g2o file (VERTEX_SE3:QUAT, EDGE_SE3:QUAT, FIX)", "pose_graph"};
  cli.add_option("FILE", s.input, "input graph")->required();
  cli.add_option("--output", s.output, "write the graph with the optimised poses");
  cli.add_option("--loss", s.loss, "robust loss")->check(CLI::IsMember({"none", "huber", "cauchy", "tukey"}));
  cli.add_option("--width", s.width, "width of the loss in standard deviations")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  cli.add_option("--damping", s.damping, "step policy")
      ->check(CLI::IsMember({"gauss-newton", "levenberg-marquardt", "dogleg"}))
      ->capture_default_str();
  cli.add_option("--max-iterations", s.max_iterations)->check(CLI::NonNegativeNumber)->capture_default_str();
  cli.add_option("--threads", s.threads, "number of threads; 0: all cores")->capture_default_str();
  cli.add_flag("--chordal", s.chordal, "initialise from the edges instead of the file's poses");
  cli.add_flag("--json", s.json, "print the summary as JSON");
  if (const auto code = examples::parse(cli, argc, argv)) return *code;
  if (examples::is_same_file(s.output, s.input)) return report_error(1, examples::overwrite_message(s.output, s.input));
  if (!s.output.empty())
    if (const std::string why = examples::unwritable_message(s.output); !why.empty()) return report_error(2, why);
  auto graph = orbis::io::read_g2o(s.input);
  if (!graph) return report_error(2, examples::describe(graph.error()));
  if (s.chordal) {
    const auto start =
        examples::start_chordally(std::span{graph->vertices}, graph->edges,
                                  {.fixed = graph->fixed, .hold = optimize::pose_graph_gauge::first_of_each_piece});
    if (is_failure(start.status)) return report_error(2, s.input + ": " + to_string(start));
  }
  if (s.loss == "huber") return run(s, *graph, optimize::huber{s.width});
  if (s.loss == "cauchy") return run(s, *graph, optimize::cauchy{s.width});
  if (s.loss == "tukey") return run(s, *graph, optimize::tukey{s.width});
  return run(s, *graph, optimize::trivial{});
}

int main(int argc, char** argv) {
  return examples::run_program("pose_graph", [&] { return run_command(argc, argv); });
}
