// SPDX-License-Identifier: BSD-3-Clause
//
// filter_cloud IN.{ply,pcd} OUT.{ply,pcd}: removes outliers from a cloud, with a filter chosen automatically or by the
// user.
#include <cstdio>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include <orbis/cloud.hpp>
#include <orbis/io.hpp>

#include "../common/filter_text.hpp"
#include "../common/near_origin.hpp"
#include "../common/program.hpp"
#include "../common/same_file.hpp"

int report_error(int code, const std::string& why) { return examples::report_error("filter_cloud", code, why); }

int run(int argc, char** argv) {
  using namespace orbis::cloud;
  using orbis::par;
  std::string input, output, filter = "auto";
  std::optional<std::size_t> k;  // empty: the filter's default
  double sigma = 1.0, voxel = 0.0;
  std::vector<double> xyz;
  CLI::App cli{"Remove outliers from a cloud; print the chosen filter and the reason", "filter_cloud"};
  cli.add_option("IN", input, "input .ply or .pcd file")->required();
  cli.add_option("OUT", output, "output .ply or .pcd file")->required();
  const auto names = {"auto", "none", "statistical", "radius", "log-statistical", "range-statistical", "cluster"};
  cli.add_option("--filter", filter, "outlier filter; auto: selected by analysing the cloud")
      ->capture_default_str()
      ->check(CLI::IsMember(names));
  cli.add_option("--neighbors", k, "number of neighbours (default: depends on the filter)")
      ->check(CLI::Range(1, 100'000));
  cli.add_option("--sigma", sigma, "(range-)statistical: limit in standard deviations")->capture_default_str();
  cli.add_option("--voxel", voxel, "reduce to one point per voxel of this size in metres; 0: off")
      ->capture_default_str();
  cli.add_option("--origin", xyz, "x,y,z of the sensor in metres")->delimiter(',')->expected(3);
  if (const auto code = examples::parse(cli, argc, argv)) return *code;
  if (!(sigma >= 0 && sigma < 1e6)) return report_error(1, "--sigma: must be at least 0 and less than 1000000");
  if (voxel != 0 && !(voxel >= 1e-6 && voxel < 1e6))
    return report_error(1, "--voxel: must be 0, or at least 1e-6 and less than 1e6");
  auto eye = xyz.empty() ? std::nullopt : std::optional{orbis::vec3{xyz.data()}};
  if (eye ? !eye->allFinite() : filter == "range-statistical")
    return report_error(1, "--origin: needs a finite position");
  const auto format = orbis::io::cloud_format_by_extension(output);
  if (!format) return report_error(1, output + ": must end in .ply or .pcd");
  if (examples::is_same_file(output, input)) return report_error(1, examples::overwrite_message(output, input));
  if (const std::string why = examples::unwritable_message(output); !why.empty()) return report_error(2, why);
  auto found = examples::read_near_origin(input);  // the output is in the original coordinates
  if (!found) return report_error(2, examples::describe(found.error()));
  auto& [read, origin] = *found;
  const auto in_file = read.cloud.size();
  if (eye) *eye -= origin;
  if (voxel > 0) {
    if (!read.fields.empty())
      read.notes.push_back("left out because of --voxel: " + orbis::io::field_names(read.fields));
    read.fields.clear();
    read.cloud = voxel_grid(read.cloud, {.size = voxel});
  }
  if (*format == orbis::io::cloud_format::ply) {
    if (read.viewpoint != orbis::io::cloud_with_fields{}.viewpoint)
      read.notes.emplace_back("VIEWPOINT is left out, because PLY files have none: write a .pcd file to keep it");
    for (const auto& field : read.fields)
      if (field.type == orbis::io::scalar_type::int64 || field.type == orbis::io::scalar_type::uint64)
        read.notes.push_back(field.name +
                             ": 64-bit integers become double, which is exact up to 2^53; a .pcd file keeps them");
  }
  for (const auto& note : read.notes) report_error(0, "warning: " + input + ": " + note);
  const auto& p = read.cloud.points;
  const auto finite = pass_through_inliers(p);
  if (finite.empty()) return report_error(2, input + ": has no finite points");
  automatic_result best;
  const auto kept = filter == "none"                ? finite
                    : filter == "statistical"       ? statistical_inliers(par, p, {k.value_or(50), sigma})
                    : filter == "radius"            ? radius_inliers(par, p, {.min_neighbors = k.value_or(5)})
                    : filter == "log-statistical"   ? log_statistical_inliers(par, p, {k.value_or(8)})
                    : filter == "range-statistical" ? range_statistical_inliers(par, p, {eye}, {k.value_or(50), sigma})
                    : filter == "cluster"           ? cluster_inliers(par, p, {k.value_or(12)})
                                          : (best = filter_automatically(par, p, {k.value_or(8), eye})).inliers;
  const auto why = filter == "auto" ? to_string(best.choice.chain) + ": " + examples::filter_text(best.choice) : filter;
  if (auto ok = orbis::io::write_cloud(output, read, kept, origin); !ok)
    return report_error(2, examples::describe(ok.error()));
  if (kept.empty()) report_error(0, "warning: " + input + ": the filter removed all points");
  std::printf("%zu points, %zu to filter, %zu kept; %s\n", in_file, finite.size(), kept.size(), why.c_str());
  return 0;
}

int main(int argc, char** argv) {
  return examples::run_program("filter_cloud", [&] { return run(argc, argv); });
}
