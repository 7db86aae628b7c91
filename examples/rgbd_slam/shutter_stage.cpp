// SPDX-License-Identifier: BSD-3-Clause
#include "shutter_stage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>

#include <orbis/camera/presets.hpp>
#include <orbis/slam/shutter_estimate.hpp>
#include <orbis/slam/system.hpp>

#include "interrupts.hpp"
#include "profiles.hpp"
#include "slam_options.hpp"

namespace app {
namespace {

std::string milliseconds(double seconds, const char* format = "%.1f") {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, format, 1000.0 * seconds);
  return buffer;
}

/// The typical shutter of the camera as an estimate, which tracking can revise. Empty if it is unknown, or if the depth
/// images have no time stamps of their own.
std::optional<orbis::slam::shutter_estimate> typical_estimate(const frame_source& source) {
  const auto typical = orbis::camera::typical_shutter(source.camera.model);
  if (!typical) return std::nullopt;
  const auto first = source.frame(0);  // for its time stamps
  if (!first || !first->depth_timestamp) return std::nullopt;
  return orbis::slam::shutter_estimate{.shutter = *typical,
                                       .read_out = typical->color_read_out,
                                       .read_out_deviation = 0.002,  // see typical_shutter
                                       .delay = typical->depth_delay,
                                       .delay_deviation = 0.003,
                                       .observed = 20.0};  // seconds; short recordings keep it
}

}  // namespace

shutter_results find_shutter(const frame_source& source, const settings& s, double seconds, console& console) {
  shutter_results result;
  result.from = "camera";
  if (source.is_monocular()) return result;  // the correction needs motion in metres
  if (s.read_out_ms) {
    result.from = "given";
    result.shutter = source.camera.shutter.value_or(orbis::camera::shutter{});
    result.shutter.color_read_out = result.shutter.depth_read_out = 0.001 * *s.read_out_ms;
    return result;
  }
  if (source.camera.shutter) {
    result.shutter = *source.camera.shutter;
    return result;
  }
  if (source.sensor != orbis::slam::sensor_kind::rgbd) return result;  // the estimate needs depth
  result.from = "estimated";
  if (source.is_live) return result;
  console.stage("shutter");
  if (const auto typical = typical_estimate(source)) {
    result.from = "typical";
    result.estimate = *typical;
    result.shutter = typical->shutter;
    console.finish(describe(result) + ", typical of this camera");
    return result;
  }
  orbis::slam::options options = slam_options(source.camera.model, source.camera.baseline);
  set_profile(s.profile, options);
  options.estimates_shutter = true;
  options.features.max_features = std::min(options.features.max_features, 500);  // enough for an estimate
  options.trajectory_frames = 2;  // nothing reads the trajectory, so no frame is localised again
  orbis::slam::rgbd_system<decltype(orbis::camera::camera_settings::model)> slam{source.camera.model, options};
  read_ahead frames{source, s.threads != 1};
  std::optional<double> begin;
  for (std::size_t i = 0; frames.has_next() && !interrupts::stop_requested(); ++i) {
    const auto frame = frames.next();
    if (!frame) break;  // tracking reports the error
    if (!begin) begin = frame->timestamp;
    if (frame->timestamp - *begin > seconds) break;
    slam.track(*frame);
    console.advance(i + 1, source.frames, "tracking the first seconds");
  }
  result.estimate = *slam.estimated_shutter();
  result.shutter = result.estimate.shutter;
  console.finish(describe(result));
  return result;
}

orbis::camera::camera_settings with_shutter(orbis::camera::camera_settings camera, const shutter_results& shutter) {
  const bool is_estimated = shutter.from == "estimated" && !shutter.shutter.is_global();
  const bool is_typical = shutter.from == "typical" && !orbis::camera::typical_shutter(camera.model);
  if (shutter.from == "given" || is_estimated || is_typical) camera.shutter = shutter.shutter;
  return camera;
}

std::string describe(const shutter_results& r) {
  if (r.shutter.is_global())
    return !r.can_be_revised()                            ? "global"
           : std::isfinite(r.estimate.read_out_deviation) ? "global or nearly global"
                                                          : "assumed global";
  const auto value = [&](double seconds, double deviation) {
    return milliseconds(seconds) + (r.can_be_revised() ? " +- " + milliseconds(deviation) : "") + " ms";
  };
  std::string text = "rolling, read-out time " + value(r.shutter.color_read_out, r.estimate.read_out_deviation);
  if (r.shutter.depth_read_out != r.shutter.color_read_out)
    text += ", depth " + milliseconds(r.shutter.depth_read_out) + " ms";
  if (r.shutter.depth_delay != 0.0)
    text += ", depth image " + value(std::abs(r.shutter.depth_delay), r.estimate.delay_deviation) +
            (r.shutter.depth_delay > 0.0 ? " after colour" : " before colour");
  return text;
}

}  // namespace app
