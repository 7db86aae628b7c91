// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the readers of stereo recordings hand to `stereo_recording`: a list of pairs, not yet read, and the cameras.
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/camera/stereo.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>
#include <orbis/io/detail/recordings/tum.hpp>

namespace orbis::io::detail {

/// A stereo recording without its pixels.
struct stereo_index {
  /// Of each frame `color` is the left image and `depth` the right one; poses are those of the left camera.
  recording_index images;
  camera::stereo_rig<camera::any_camera> cameras;
  double fps = 30.0;
  std::optional<camera::shutter> shutter{};  ///< of both cameras, if it is known
};

/// Pairs left with right images within `max_time_difference` seconds and makes frames of them; what finds no partner is
/// noted. Errors: no_data (no pair), not_found (the first images).
[[nodiscard]] inline result<void> pair_images(const std::vector<stamped_file>& left,
                                              const std::vector<stamped_file>& right,
                                              const std::filesystem::path& where, double max_time_difference,
                                              recording_index& to) {
  const auto stamps = [](const std::vector<stamped_file>& files) {
    std::vector<double> t;
    for (const stamped_file& f : files) t.push_back(f.timestamp);
    return t;
  };
  for (const auto& [l, r] : associate(stamps(left), stamps(right), max_time_difference))
    to.frames.push_back({left[l].timestamp, left[l].path, right[r].path, {}});
  if (to.frames.empty())
    return fail(errc::no_data, where.string(),
                "no left image has a right image within " + std::to_string(max_time_difference) + " s");
  for (const auto& [list, side] : {std::pair{&left, "left"}, std::pair{&right, "right"}})
    if (const std::size_t lonely = list->size() - to.frames.size(); lonely != 0)
      to.notes.push_back(std::to_string(lonely) + " of " + std::to_string(list->size()) + " " + side +
                         " images have no partner and are left out");
  return check_first_frame(to, where);
}

}  // namespace orbis::io::detail
