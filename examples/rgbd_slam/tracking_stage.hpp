// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Tracking: from frames to trajectory and keyframes.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/core/result.hpp>

#include "camera_check.hpp"
#include "console.hpp"
#include "live_stage.hpp"
#include "posed_frames.hpp"
#include "result_files.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"
#include "viewer/viewer.hpp"

namespace app {

struct tracked_frames {
  slam_results slam;
  std::optional<world_results> world;       ///< world frame of the poses
  posed_frames keyframes;                   ///< keyframes with images, for the map
  std::unique_ptr<live_mapping> live;       ///< the live map, if requested; its last step may still be running
  std::optional<orbis::error> stopped;      ///< the error that ended the reading of frames early
  std::optional<orbis::error> unsaved;      ///< the error in saving the landmark map
  std::optional<focal_doubt> camera_doubt;  ///< evidence that the focal length is wrong
  /// A calibrated camera that replaces the given one. If set, tracking ended when it was found, and there are no other
  /// results.
  std::optional<orbis::camera::any_camera> better_camera;
  bool missed_map = false;  ///< the camera was never found in the loaded map
};

/// Tracks the frames of the source until a frame is unreadable, Ctrl-C is pressed, or memory is exhausted. If the
/// shutter is estimated, the estimate begins with `shutter`. The focal length is checked at the end, unless a map was
/// loaded, and if the camera may be replaced (`may_refine`), also after ten seconds and each time that has doubled. If
/// the frames then clearly contradict it (`focal_doubt::is_sure`), the camera is calibrated. Errors: a map that cannot
/// be loaded. `files`: where to write the landmark map, if the settings request one, and depth images that do not fit
/// into memory (see `posed_frames`). `viewer` shows the progress.
[[nodiscard]] orbis::result<tracked_frames> track(const frame_source& source, const shutter_results& shutter,
                                                  const settings& s, const result_files& files, viewer& viewer,
                                                  console& console);

/// The error that stopped tracking, with the number of frames before it. @pre tracked.stopped
[[nodiscard]] orbis::error explain_stop(const tracked_frames& tracked, const frame_source& source);
/// The error for a run that was never relocalised in the loaded map; describes the consequences.
[[nodiscard]] orbis::error explain_miss(const tracked_frames& tracked, const settings& s);
/// Warnings about the frames of a map and its world frame.
[[nodiscard]] std::vector<std::string> mapping_notes(const posed_frames& frames,
                                                     const std::optional<world_results>& world);
/// Warnings about tracking, including those of `mapping_notes`.
[[nodiscard]] std::vector<std::string> tracking_notes(const tracked_frames& tracked, const settings& s);

}  // namespace app
