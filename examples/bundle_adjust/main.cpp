// SPDX-License-Identifier: BSD-3-Clause
//
// bundle_adjust FILE.txt: adjusts cameras and points of a "Bundle Adjustment in the Large" file and prints a table of
// iterations, or JSON (--json).
#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "../common/program.hpp"
#include "../common/same_file.hpp"
#include "adjust.hpp"

int run(int argc, char** argv) {
  settings s;
  CLI::App cli{"Adjust the cameras and points in a file of Bundle Adjustment in the Large", "bundle_adjust"};
  cli.add_option("FILE", s.input, "input problem, uncompressed")->required();
  cli.add_option("--out,--output", s.output, "write the problem with the adjusted cameras and points");
  cli.add_option("--loss", s.loss, "robust loss")
      ->check(CLI::IsMember({"none", "huber", "cauchy", "tukey"}))
      ->capture_default_str();
  cli.add_option("--width", s.width, "width of the loss in pixels")->check(CLI::PositiveNumber)->capture_default_str();
  cli.add_option("--damping", s.damping, "step policy")
      ->check(CLI::IsMember({"levenberg-marquardt", "dogleg"}))
      ->capture_default_str();
  cli.add_option("--solver", s.solver, "solver of the reduced system")
      ->check(CLI::IsMember({"automatic", "dense", "sparse", "iterative"}))
      ->capture_default_str();
  cli.add_option("--tolerance", s.tolerance, "relative decrease of the cost below which the solver stops")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  cli.add_option("--max-iterations", s.max_iterations)->check(CLI::NonNegativeNumber)->capture_default_str();
  cli.add_option("--threads", s.threads, "number of threads; 0: all cores")->capture_default_str();
  cli.add_flag("--json", s.json, "print the summary as JSON");
  if (const auto code = examples::parse(cli, argc, argv)) return *code;
  if (examples::is_same_file(s.output, s.input)) return report_error(1, examples::overwrite_message(s.output, s.input));
  if (!s.output.empty())
    if (const std::string why = examples::unwritable_message(s.output); !why.empty()) return report_error(2, why);
  auto problem = orbis::io::read_bal(std::filesystem::path{s.input});
  if (!problem) return report_error(2, examples::describe(problem.error()));
  return s.loss == "cauchy" || s.loss == "tukey" ? adjust_redescending(s, *problem) : adjust_convex(s, *problem);
}

int main(int argc, char** argv) {
  return examples::run_program("bundle_adjust", [&] { return run(argc, argv); });
}
