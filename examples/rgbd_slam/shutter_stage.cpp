// SPDX-License-Identifier: BSD-3-Clause
#include "shutter_stage.hpp"

#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include <orbis/slam/system.hpp>

#include "interrupts.hpp"
#include "profiles.hpp"
#include "slam_options.hpp"

namespace app {
namespace {

constexpr double watched = 10.0;  // seconds

std::string milliseconds(double seconds, const char* format = "%.1f") {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, format, 1000.0 * seconds);
  return buffer;
}

}  // namespace

first_look find_shutter(const frame_source& source, const settings& s, bool checks_camera, console& console) {
  first_look look;
  shutter_results& result = look.shutter;
  if (source.is_monocular()) {  // what is known of motion while an image is read is in metres
    result.from = "camera";
    return look;
  }
  if (s.read_out_ms) {
    result.from = "given";
    result.shutter = source.camera.shutter.value_or(orbis::camera::shutter{});
    result.shutter.color_read_out = result.shutter.depth_read_out = 0.001 * *s.read_out_ms;
    return look;
  }
  if (source.camera.shutter) {
    result.from = "camera";
    result.shutter = *source.camera.shutter;
    return look;
  }
  // Only depth tells, and a camera shows its first seconds once.
  if (source.sensor != orbis::slam::sensor_kind::rgbd || source.is_live) {
    result.from = "camera";
    return look;
  }
  result.from = "estimated";
  console.stage("shutter");
  orbis::slam::options options = slam_options(source.camera.model, source.camera.baseline);
  set_profile(s.profile, options);
  options.estimates_shutter = true;
  orbis::slam::rgbd_system<decltype(orbis::camera::camera_settings::model)> slam{source.camera.model, options};
  read_ahead frames{source, s.threads != 1};
  std::optional<double> begin;
  for (std::size_t i = 0; frames.has_next() && !interrupts::requested(); ++i) {
    const auto frame = frames.next();
    if (!frame) break;  // it is told when the frame's turn comes
    if (!begin) begin = frame->timestamp;
    if (frame->timestamp - *begin > watched) break;
    slam.track(*frame);
    console.advance(i + 1, source.frames, "looking at the first seconds");
  }
  const auto found = *slam.estimated_shutter();
  result.shutter = found.shutter;
  result.read_out_deviation = found.read_out_deviation;
  result.delay_deviation = found.delay_deviation;
  console.finish(in_words(result));
  if (!checks_camera) return look;
  const orbis::slam::map_id most = slam.largest_map();
  look.doubt = slam.inspect(
      [&](const orbis::slam::atlas& maps) { return find_doubt(maps.at(most), source.camera.model, options); });
  return look;
}

orbis::camera::camera_settings with_shutter(orbis::camera::camera_settings camera, const shutter_results& shutter) {
  const bool is_estimated = shutter.from == "estimated" && !shutter.shutter.is_global();
  if (shutter.from == "given" || is_estimated) camera.shutter = shutter.shutter;
  return camera;
}

std::string in_words(const shutter_results& r) {
  const bool estimated = r.from == "estimated";
  if (r.shutter.is_global())
    return !estimated ? "global" : std::isfinite(r.read_out_deviation) ? "global, or nearly so" : "taken to be global";
  const auto value = [&](double seconds, double deviation) {
    return milliseconds(seconds) + (estimated ? " +- " + milliseconds(deviation) : "") + " ms";
  };
  std::string text = "images are read out in " + value(r.shutter.color_read_out, r.read_out_deviation);
  if (r.shutter.depth_read_out != r.shutter.color_read_out)
    text += ", depth images in " + milliseconds(r.shutter.depth_read_out) + " ms";
  if (r.shutter.depth_delay != 0.0)
    text += ", depth " + value(std::abs(r.shutter.depth_delay), r.delay_deviation) +
            (r.shutter.depth_delay > 0.0 ? " after colour" : " before colour");
  return text;
}

}  // namespace app
