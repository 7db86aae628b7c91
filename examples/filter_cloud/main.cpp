// SPDX-License-Identifier: BSD-3-Clause
//
// filter_cloud IN.{ply,pcd} OUT.ply: a cloud without its outliers, by the filter that suits it or one that is named.
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <orbis/cloud.hpp>
#include <orbis/io.hpp>

#include "../common/memory.hpp"
#include "../common/near_origin.hpp"
#include "../common/same_file.hpp"

int complain(int code, const std::string& why) { return std::fprintf(stderr, "filter_cloud: %s\n", why.c_str()), code; }

int main(int argc, char** argv) try {
  examples::limit_memory();
  using namespace orbis::cloud;
  using orbis::par;
  std::string input, output, filter = "auto";
  std::optional<std::size_t> k;  // as the filter has it
  double sigma = 1.0, voxel = 0.0;
  std::vector<double> xyz;
  CLI::App cli{"A cloud without its outliers; says which filter was chosen, and why", "filter_cloud"};
  cli.add_option("IN", input, "a .ply or .pcd file")->required();
  cli.add_option("OUT", output, "the .ply file to write")->required();
  const auto names = {"auto", "none", "statistical", "radius", "log-statistical", "range-statistical", "cluster"};
  cli.add_option("--filter", filter, "auto: as the cloud suggests")->capture_default_str()->check(CLI::IsMember(names));
  cli.add_option("--neighbors", k, "of a point; default: the filter's own")->check(CLI::Range(1, 100'000));
  cli.add_option("--sigma", sigma, "(range-)statistical: deviations above the mean")->capture_default_str();
  cli.add_option("--voxel", voxel, "first one point for each voxel of this size, metres; 0: no")->capture_default_str();
  cli.add_option("--origin", xyz, "x,y,z of the sensor that saw the cloud, metres")->delimiter(',')->expected(3);
  try {
    cli.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return e.get_exit_code() == 0 ? cli.exit(e) : complain(1, e.what() + std::string{" (--help shows the usage)"});
  }
  if (!(sigma >= 0 && sigma < 1e6)) return complain(1, "--sigma: is not 0 ... 1000000");
  if (voxel != 0 && !(voxel >= 1e-6 && voxel < 1e6)) return complain(1, "--voxel: is not 0, nor a micrometre or more");
  auto eye = xyz.empty() ? std::nullopt : std::optional{orbis::vec3{xyz.data()}};
  if (eye ? !eye->allFinite() : filter == "range-statistical") return complain(1, "--origin: wants a finite place");
  if (examples::is_same_file(output, input)) return complain(1, examples::would_be_lost(output, input));
  const auto read = examples::read_near_origin(input);  // and written where it was
  if (!read) return complain(2, read.error().to_string());
  if (eye) *eye -= read->origin;
  const auto cloud = voxel > 0 ? voxel_grid(read->cloud, {.size = voxel}) : read->cloud;
  const auto& p = cloud.points;
  const auto finite = pass_through_inliers(p);
  if (finite.empty()) return complain(2, input + ": has no finite points");
  automatic_result best;
  const auto kept = filter == "none"                ? finite
                    : filter == "statistical"       ? statistical_inliers(par, p, {k.value_or(50), sigma})
                    : filter == "radius"            ? radius_inliers(par, p, {.min_neighbors = k.value_or(5)})
                    : filter == "log-statistical"   ? log_statistical_inliers(par, p, {k.value_or(8)})
                    : filter == "range-statistical" ? range_statistical_inliers(par, p, {eye}, {k.value_or(50), sigma})
                    : filter == "cluster"           ? cluster_inliers(par, p, {k.value_or(12)})
                                          : (best = filter_automatically(par, p, {k.value_or(8), eye})).inliers;
  const auto why = filter == "auto" ? to_string(best.choice.chain) + ": " + best.choice.reason : filter;
  const orbis::io::ply_options options{.origin = read->origin};
  if (auto ok = orbis::io::write_ply(output, cloud, kept, options); !ok) return complain(2, ok.error().to_string());
  std::printf("%zu points, %zu to filter, %zu kept; %s\n", read->cloud.size(), finite.size(), kept.size(), why.c_str());
} catch (const std::exception& e) {  // no memory, no threads
  return complain(2, examples::why_it_gave_up(e));
}
