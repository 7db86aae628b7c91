// SPDX-License-Identifier: BSD-3-Clause
//
// The camera's intrinsics and depth scale from a recording that it made: track, refine the camera by the map, and
// again with that camera, until nothing changes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/camera/settings.hpp>
#include <orbis/eval/scale.hpp>
#include <orbis/io/camera_file.hpp>
#include <orbis/slam/calibration.hpp>
#include <orbis/slam/rgbd_system.hpp>

#include "commands.hpp"
#include "output.hpp"
#include "shutter_stage.hpp"
#include "slam_options.hpp"
#include "source.hpp"

namespace app {
namespace {

using orbis::camera::any_camera;
using calibration = orbis::slam::calibration<any_camera>;

constexpr int most_rounds = 5;
constexpr double most_scale_deviation = 0.005;  // of a depth scale that is believed

struct refined {
  calibration camera;
  orbis::trajectory trajectory;
};

/// Tracks all frames with `model` and refines it by the map, the largest one if tracking was lost in between.
orbis::result<refined> refine(const any_camera& model, const frame_source& source, const settings& s,
                              const orbis::camera::shutter& shutter, console& console) {
  orbis::slam::options options = slam_options(model, source.camera.baseline);
  options.shutter = shutter;
  orbis::slam::rgbd_system<any_camera> slam{model, options};
  read_ahead frames{source, s.threads != 1};
  for (std::size_t i = 0; frames.has_next(); ++i) {
    const auto frame = frames.next();
    if (!frame) return orbis::fail(frame.error());
    slam.track(*frame);
    console.advance(i + 1, source.frames, "tracking");
  }
  const orbis::slam::map_id map = slam.largest_map();
  orbis::trajectory poses = slam.trajectory(map);
  if (poses.empty()) return orbis::fail(orbis::errc::no_data, s.input.string(), "tracking never started");
  const auto found = slam.inspect([&](const orbis::slam::atlas& maps) {
    return orbis::slam::calibrate(maps.at(map), orbis::slam::make_rig(model, options), {}, console.progress());
  });
  if (!found) return orbis::fail(orbis::errc::degenerate, s.input.string(), found.error().message);
  return refined{*found, std::move(poses)};
}

/// Whether the round changed no parameter by more than so many deviations. Not every map has the same landmarks.
bool is_settled(const calibration& c, double deviations) {
  return std::all_of(c.parameters.begin(), c.parameters.end(), [&](const orbis::slam::calibrated_parameter& p) {
    return std::abs(p.after - p.before) <= deviations * p.deviation;  // 0 for what was held
  });
}

/// The parameters of a camera by their names.
using parameter_table = std::map<std::string_view, double>;

parameter_table table_of(const any_camera& camera) {
  return camera.visit([](const auto& model) {
    using of_model = orbis::camera::parameters_of<std::remove_cvref_t<decltype(model)>>;
    const auto values = of_model::get(model);
    parameter_table table;
    for (int i = 0; i != of_model::count; ++i) table[of_model::names[static_cast<std::size_t>(i)]] = values[i];
    return table;
  });
}

/// `camera` with the parameters that stand in a table; as it is if there is no such camera.
any_camera with_parameters(const any_camera& camera, const parameter_table& table) {
  return camera.visit([&](const auto& model) -> any_camera {
    using of_model = orbis::camera::parameters_of<std::remove_cvref_t<decltype(model)>>;
    auto values = of_model::get(model);
    for (int i = 0; i != of_model::count; ++i)
      if (const auto at = table.find(of_model::names[static_cast<std::size_t>(i)]); at != table.end())
        values[i] = at->second;
    const auto changed = of_model::with(model, values);
    return changed ? any_camera{*changed} : camera;
  });
}

/// The camera that was found, where what was held has the values that were given, not those of an earlier round.
any_camera with_what_was_given(calibration& found, const parameter_table& given) {
  parameter_table held;
  for (auto& p : found.parameters)
    if (p.is_held) p.after = held[p.name] = given.at(p.name);
  return with_parameters(found.camera, held);
}

/// The depth scale by the poses of the recording; empty if they do not tell.
std::optional<orbis::slam::calibrated_parameter> find_depth_scale(const frame_source& source,
                                                                  const orbis::trajectory& found) {
  if (source.ground_truth.empty()) return std::nullopt;
  const auto scale = orbis::eval::scale_of(found, source.ground_truth);
  if (!scale) return std::nullopt;
  const double before = source.camera.depth_scale, deviation = scale->deviation / scale->scale;
  const bool is_vague = !(deviation <= most_scale_deviation);
  return orbis::slam::calibrated_parameter{"depth_scale", before, is_vague ? before : before / scale->scale,
                                           deviation * before / scale->scale, is_vague};
}

std::string line_of(const orbis::slam::calibrated_parameter& p) {
  const int digits = std::max(std::abs(p.before), std::abs(p.after)) < 10.0 ? 5 : 2;
  char text[160];
  if (p.is_held && p.deviation > 0.0 && std::isfinite(p.deviation))
    std::snprintf(text, sizeof text, "%-12s %12.*f %12s %12.*f  kept: not known better than this", p.name.data(),
                  digits, p.before, "-", digits, p.deviation);
  else if (p.is_held)
    std::snprintf(text, sizeof text, "%-12s %12.*f %12s %12s  kept: the motion does not tell", p.name.data(), digits,
                  p.before, "-", "-");
  else
    std::snprintf(text, sizeof text, "%-12s %12.*f %12.*f %12.*f", p.name.data(), digits, p.before, digits, p.after,
                  digits, p.deviation);
  return text;
}

std::optional<orbis::error> find_trouble(const settings& s, const frame_source& source) {
  std::error_code ignored;
  if (s.out.empty()) return std::nullopt;
  std::vector<std::filesystem::path> kept = source.files;  // but for its camera file, which may be replaced
  std::erase_if(kept, [](const std::filesystem::path& file) { return file.extension() == ".toml"; });
  if (auto lost = find_overwritten({s.out}, kept)) return lost;
  if (s.out.has_parent_path() && !std::filesystem::is_directory(s.out.parent_path(), ignored))
    return orbis::error{orbis::errc::invalid_argument, s.out.string(), "would be in a folder that there is not"};
  if (std::filesystem::is_directory(s.out, ignored))
    return orbis::error{orbis::errc::invalid_argument, s.out.string(), "is a folder; a file is wanted"};
  return std::nullopt;
}

}  // namespace

exit_code calibrate(settings s, console& console) {
  const auto give_up = [&](const orbis::error& e) {
    console.error(e);
    return e.code == orbis::errc::degenerate ? undetermined
           : e.code == orbis::errc::no_data  ? never_tracked
                                             : bad_input;
  };
  const auto source = open_source(s, console);
  if (!source) return console.error(source.error()), bad_input;
  if (source->sensor != orbis::slam::sensor_kind::rgbd)
    return console.error({orbis::errc::unsupported, s.input.string(), "only recordings with depth can be calibrated"}),
           bad_input;
  if (const auto trouble = find_trouble(s, *source)) return console.error(*trouble), bad_usage;

  orbis::camera::camera_settings camera = source->camera;
  if (const auto* const plain = camera.model.get_if<orbis::camera::pinhole>(); plain && s.distortion)
    camera.model = orbis::camera::radial_tangential{plain->k(), {}};
  const parameter_table given = table_of(camera.model);
  const shutter_results shutter = find_shutter(*source, s, console);
  std::optional<refined> last;
  for (int round = 1; round <= most_rounds && !(last && is_settled(last->camera, 1.0)); ++round) {
    console.stage("calibrating");
    auto next = refine(camera.model, *source, s, shutter.shutter, console);
    if (!next) return give_up(next.error());
    last = *std::move(next);
    camera.model = with_what_was_given(last->camera, given);
    char text[160];
    std::snprintf(text, sizeof text, "round %d: %zu keyframes, %zu observations, their error %.3f -> %.3f deviations",
                  round, last->camera.keyframes, last->camera.observations, last->camera.initial_rms,
                  last->camera.final_rms);
    console.finish(text);
  }
  if (!is_settled(last->camera, 3.0))
    console.warn("the parameters still change from round to round: do not rely on them");

  bool printed = console.print("parameter           given        found    deviation");
  for (auto p : last->camera.parameters) {
    p.before = given.at(p.name);  // the last round began with what the others had found
    printed = console.print(line_of(p)) && printed;
  }
  const auto depth_scale = find_depth_scale(*source, last->trajectory);
  if (depth_scale) camera.depth_scale = depth_scale->after;
  printed = console.print(depth_scale ? line_of(*depth_scale)
                                      : "depth_scale: images alone do not tell; poses of known size (groundtruth.txt) "
                                        "would") &&
            printed;
  if (!last->camera.is_complete())
    console.warn("what was kept needs more motion: turn the camera about all axes, near and far from textured things");
  if (s.read_out_ms) {
    if (!camera.shutter) camera.shutter.emplace();
    camera.shutter->color_read_out = camera.shutter->depth_read_out = shutter.shutter.color_read_out;
  } else if (shutter.from == "estimated" && !shutter.shutter.is_global()) {
    camera.shutter = shutter.shutter;
  }
  if (!s.out.empty()) {
    if (const auto written = orbis::io::write_camera(s.out, camera); !written) return give_up(written.error());
    printed = console.print("camera       " + s.out.string()) && printed;
  }
  if (!printed) return give_up({orbis::errc::write_failed, "standard output", "cannot be written"});
  return done;
}

}  // namespace app
