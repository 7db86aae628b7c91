// SPDX-License-Identifier: BSD-3-Clause
#include "camera_stage.hpp"

#include <cmath>
#include <cstdio>

#include "calibration_rounds.hpp"
#include "camera_check.hpp"
#include "shutter_stage.hpp"

namespace app {

shutter_results prepare_camera(frame_source& source, const settings& s, console& console) {
  const bool shares_map = !s.load_map.empty() || !s.save_map.empty();  // runs that share a map need the same camera
  const bool checks_camera = s.refines_camera && s.camera.empty() && !shares_map;
  const camera_inspection first = find_shutter(source, s, checks_camera, console);
  if (!first.doubt || !first.doubt->is_sure) return first.shutter;
  const auto found = calibrate_by(source, s, first.shutter.shutter, source.camera.model, {2, 60.0}, console);
  if (!found) return first.shutter;
  const auto change = find_doubt(found->parameters);
  constexpr double alike = 0.02;  // relative difference between the two estimates
  if (!change || std::abs(change->found - first.doubt->found) > alike * change->found) return first.shutter;
  source.camera.model = found->last.camera;
  source.camera_is_refined = true;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "the images contradict the camera's focal length of %.1f pixels; the run uses a calibrated focal length of %.1f "
      "pixels (--intrinsics given keeps the original; rgbd_slam calibrate writes a camera file)",
      change->given, change->found);
  console.warn(source.notes.emplace_back(text));
  return first.shutter;
}

}  // namespace app
