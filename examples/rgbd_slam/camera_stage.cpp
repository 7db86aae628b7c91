// SPDX-License-Identifier: BSD-3-Clause
#include "camera_stage.hpp"

#include <cmath>
#include <cstdio>

#include "calibration_rounds.hpp"
#include "camera_check.hpp"
#include "shutter_stage.hpp"

namespace app {

shutter_results get_to_know_camera(frame_source& source, const settings& s, console& console) {
  const bool shares_map = !s.load_map.empty() || !s.save_map.empty();  // and so the camera of other runs
  const first_look look = find_shutter(source, s, s.refines_camera && s.camera.empty() && !shares_map, console);
  if (!look.doubt || !look.doubt->is_sure) return look.shutter;
  const auto found = calibrate_by(source, s, look.shutter.shutter, source.camera.model, {2, 60.0}, console);
  if (!found) return look.shutter;
  const auto change = find_doubt(found->parameters);
  constexpr double alike = 0.02;  // what the first seconds tell, and what more of them
  if (!change || std::abs(change->found - look.doubt->found) > alike * change->found) return look.shutter;
  source.camera.model = found->last.camera;
  source.camera_is_refined = true;
  char text[240];
  std::snprintf(
      text, sizeof text,
      "the images do not fit the camera's focal length of %.1f pixels: used is the camera that they fit, with "
      "%.1f (--intrinsics given keeps the camera; rgbd_slam calibrate writes a file)",
      change->given, change->found);
  console.warn(source.notes.emplace_back(text));
  return look.shutter;
}

}  // namespace app
