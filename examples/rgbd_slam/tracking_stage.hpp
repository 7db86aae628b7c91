// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Frames in, trajectory and keyframes out.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <orbis/core/result.hpp>

#include "camera_check.hpp"
#include "console.hpp"
#include "live_stage.hpp"
#include "posed_frames.hpp"
#include "results.hpp"
#include "settings.hpp"
#include "source.hpp"
#include "viewer/viewer.hpp"

namespace app {

struct tracked_frames {
  slam_results slam;
  std::optional<world_results> world;       ///< of the poses
  posed_frames keyframes;                   ///< with their images, for the map
  std::unique_ptr<live_mapping> live;       ///< the octree that grew meanwhile, if that was asked for; stopped
  std::optional<orbis::error> stopped;      ///< why not all frames were read
  std::optional<orbis::error> unsaved;      ///< why the map of landmarks could not be saved
  std::optional<focal_doubt> camera_doubt;  ///< that the camera may be another than it is said to be
  bool missed_map = false;                  ///< a map was loaded, and the camera never found in it
};

/// Tracks the source's frames, up to the first that cannot be read, or to Ctrl-C. Errors: a map that cannot be loaded.
/// `viewer` is shown what goes on. `landmark_map`: where the map of landmarks is written, if it is to be saved.
/// `spill_file`: see posed_frames.
[[nodiscard]] orbis::result<tracked_frames> track(const frame_source& source, const shutter_results& shutter,
                                                  const settings& s, const std::filesystem::path& landmark_map,
                                                  const std::filesystem::path& spill_file, viewer& viewer,
                                                  console& console);

/// The error that stopped the tracking, with what was reached. @pre tracked.stopped
[[nodiscard]] orbis::error explain_stop(const tracked_frames& tracked, const frame_source& source);
/// That the camera was never found in the loaded map, and what that means.
[[nodiscard]] orbis::error explain_miss(const tracked_frames& tracked, const settings& s);
/// What the user should know of the frames that go into a map, and of its world.
[[nodiscard]] std::vector<std::string> mapping_notes(const posed_frames& frames,
                                                     const std::optional<world_results>& world);
/// What else the user should know of.
[[nodiscard]] std::vector<std::string> tracking_notes(const tracked_frames& tracked, const settings& s);

}  // namespace app
