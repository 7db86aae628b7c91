// SPDX-License-Identifier: BSD-3-Clause
//
// bundle_adjust FILE.txt: adjusts cameras and points of a file of "Bundle Adjustment in the Large";
// iteration table, or --json.
#include <exception>
#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

#include "../common/memory.hpp"
#include "adjust.hpp"

int main(int argc, char** argv) try {
  examples::limit_memory();
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
  return s.loss == "cauchy" || s.loss == "tukey" ? adjust_redescending(s, *problem) : adjust_convex(s, *problem);
} catch (const std::exception& e) {  // no memory, no threads
  return complain(2, examples::why_it_gave_up(e));
}
