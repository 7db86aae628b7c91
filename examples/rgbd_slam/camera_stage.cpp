// SPDX-License-Identifier: BSD-3-Clause
#include "camera_stage.hpp"

#include <cmath>

#include "calibration_rounds.hpp"
#include "formatted_text.hpp"
#include "interrupts.hpp"

namespace app {

bool may_refine(const frame_source& source, const settings& s) {
  const bool shares_map = !s.load_map.empty() || !s.save_map.empty();
  return source.sensor == orbis::slam::sensor_kind::rgbd && !source.made && !source.camera_is_refined &&
         s.refines_camera && s.camera.empty() && !shares_map;
}

std::optional<orbis::camera::any_camera> refine_camera(const frame_source& source,
                                                       const orbis::camera::shutter& shutter, const focal_doubt& doubt,
                                                       const settings& s, console& console) {
  const auto found = calibrate_by(source, s, shutter, source.camera.model, {2, 60.0}, console);
  if (!found) return std::nullopt;
  const auto change = find_doubt(found->parameters);
  constexpr double alike = 0.02;  // relative difference between the two estimates
  if (!change || std::abs(change->found - doubt.found) > alike * change->found || interrupts::stop_requested())
    return std::nullopt;
  return found->last.camera;
}

std::string replace_camera(frame_source& source, const orbis::camera::any_camera& refined) {
  const double given = source.camera.model.k().fx;
  source.camera.model = refined;
  source.camera_is_refined = true;
  return source.notes.emplace_back(
      text("the images contradict the camera's focal length of %.1f pixels; the run uses a calibrated focal length of "
           "%.1f pixels (--intrinsics given keeps the original; rgbd_slam calibrate writes a camera file)",
           given, refined.k().fx));
}

}  // namespace app
