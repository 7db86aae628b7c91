// SPDX-License-Identifier: BSD-3-Clause
//
// The command calibrate: intrinsics and depth scale of a camera from a recording.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/eval/scale.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/slam/calibration.hpp>

#include "calibration_rounds.hpp"
#include "camera_check.hpp"
#include "commands.hpp"
#include "output.hpp"
#include "shutter_stage.hpp"
#include "source.hpp"

namespace app {
namespace {

using orbis::slam::calibrated_parameter;

constexpr double most_scale_deviation = 0.005;  // maximum relative standard deviation of an accepted depth scale

/// Estimates the depth scale from the ground-truth poses of the recording; empty if they do not determine it.
std::optional<calibrated_parameter> find_depth_scale(const frame_source& source, const orbis::trajectory& found) {
  if (source.ground_truth.empty()) return std::nullopt;
  const auto scale = orbis::eval::estimate_scale(found, source.ground_truth);
  if (!scale) return std::nullopt;
  const double before = source.camera.depth_scale, deviation = scale->deviation / scale->scale;
  const bool is_vague = !(deviation <= most_scale_deviation);
  return calibrated_parameter{"depth_scale", before, is_vague ? before : before / scale->scale,
                              deviation * before / scale->scale, is_vague};
}

std::string parameter_line(const calibrated_parameter& p) {
  const int digits = std::max(std::abs(p.before), std::abs(p.after)) < 10.0 ? 5 : 2;
  char text[160];
  if (p.is_held && p.deviation > 0.0 && std::isfinite(p.deviation))
    std::snprintf(text, sizeof text, "%-12s %12.*f %12s %12.*f  kept: not determined accurately enough", p.name.data(),
                  digits, p.before, "-", digits, p.deviation);
  else if (p.is_held)
    std::snprintf(text, sizeof text, "%-12s %12.*f %12s %12s  kept: not determined by the motion", p.name.data(),
                  digits, p.before, "-", "-");
  else
    std::snprintf(text, sizeof text, "%-12s %12.*f %12.*f %12.*f", p.name.data(), digits, p.before, digits, p.after,
                  digits, p.deviation);
  return text;
}

/// The error if the camera file cannot be written or would overwrite an input other than a camera file.
std::optional<orbis::error> check_output(const settings& s, const frame_source& source) {
  std::error_code ignored;
  if (s.out.empty()) return std::nullopt;
  std::vector<std::filesystem::path> kept = source.files;  // excluding camera files, which may be replaced
  if (is_file_name(s.camera)) kept.emplace_back(s.camera);
  std::erase_if(kept, [](const std::filesystem::path& file) { return file.extension() == ".toml"; });
  kept.push_back(s.config);
  if (auto lost = find_overwritten({s.out}, kept)) return lost;
  if (s.out.has_parent_path() && !std::filesystem::is_directory(s.out.parent_path(), ignored))
    return orbis::error{orbis::errc::invalid_argument, s.out.string(), "its folder does not exist"};
  if (std::filesystem::is_directory(s.out, ignored))
    return orbis::error{orbis::errc::invalid_argument, s.out.string(), "is a folder, not a file"};
  if (s.out.extension() != ".toml")
    return orbis::error{orbis::errc::invalid_argument, s.out.string(),
                        "the camera is written as TOML: choose a name that ends in .toml"};
  return std::nullopt;
}

}  // namespace

exit_code calibrate(const settings& s, console& console) {
  const auto give_up = [&](const orbis::error& e) {
    console.error(e);
    return e.code == orbis::errc::degenerate ? undetermined
           : e.code == orbis::errc::no_data  ? never_tracked
                                             : bad_input;
  };
  const auto source = open_source(s, console);
  if (!source) return console.error(source.error()), bad_input;
  if (source->sensor != orbis::slam::sensor_kind::rgbd)
    return console.error({orbis::errc::unsupported, s.input.string(), "calibration needs a recording with depth"}),
           bad_input;
  if (const auto problem = check_output(s, *source)) return console.error(*problem), bad_usage;

  orbis::camera::camera_settings camera = source->camera;
  if (s.distortion) camera.model = with_lens(camera.model);
  constexpr double first_seconds = 10.0;
  const shutter_results shutter = find_shutter(*source, s, first_seconds, console);
  const auto found = calibrate_by(*source, s, shutter.shutter, camera.model, {.compares_lens = true}, console);
  if (!found) return give_up(found.error());
  const auto is_held_distortion = [](const calibrated_parameter& p) { return p.name == "k1" && p.is_held; };
  if (s.distortion && std::ranges::any_of(found->parameters, is_held_distortion))
    return give_up({orbis::errc::degenerate, s.input.string(),
                    "the motion does not determine the lens distortion, and the focal length would compensate for "
                    "it; omit --distortion to use the lens of the camera file"});
  camera.model = found->last.camera;
  if (!is_settled(found->last, 3.0)) console.warn("the parameters have not converged: do not rely on them");

  bool printed = console.print("parameter           given        found    deviation");
  for (const calibrated_parameter& p : found->parameters) printed = console.print(parameter_line(p)) && printed;
  const auto depth_scale = find_depth_scale(*source, found->trajectory);
  if (depth_scale) camera.depth_scale = depth_scale->after;
  printed = console.print(depth_scale ? parameter_line(*depth_scale)
                                      : "depth_scale: not determined by images alone; needs poses in metres "
                                        "(groundtruth.txt)") &&
            printed;
  if (!found->last.is_complete())
    console.warn(
        "parameters marked as kept need more motion: rotate the camera about all axes, close to and far from "
        "textured surfaces");
  const auto& lens = found->lens;
  if (lens && (lens->has_distortion() || (!lens->is_determined && has_other_focal_length(found->parameters))))
    console.warn(describe(*lens));
  camera = with_shutter(std::move(camera), shutter);
  if (!s.out.empty()) {
    if (const auto written = orbis::io::write_camera(s.out, camera); !written) return give_up(written.error());
    printed = console.print("camera       " + s.out.string()) && printed;
  }
  if (!printed) return give_up({orbis::errc::write_failed, "standard output", "cannot be written"});
  return done;
}

}  // namespace app
