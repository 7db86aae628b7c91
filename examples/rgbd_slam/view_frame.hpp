// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The coordinate frame of pictures of a map: z up, walls along the axes, the floor at zero.
#pragma once

#include <optional>
#include <string>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

#include "results.hpp"

namespace app {

struct view_frame {
  orbis::se3 T_view_world;
  orbis::vec3 low = orbis::vec3::Zero(), high = orbis::vec3::Ones();  ///< bounds of the map in view, excluding outliers
  double cut = 1.0;  ///< height above which the map is not drawn, because a ceiling would hide the rest
};

/// Rotates the world about its z axis so that walls are parallel to x and y, and shifts the floor (or, if no floor is
/// known, the lowest points) to height 0. `floor`: height in the world, metres. For pictures only; no result is in this
/// frame.
[[nodiscard]] view_frame find_view_frame(const std::vector<orbis::vec3f>& points, const orbis::trajectory& cameras,
                                         std::optional<double> floor);
/// The height of the floor in the world in metres: the median height of the points in the floor's voxels. Empty if no
/// floor was found.
[[nodiscard]] std::optional<double> height_of_floor(const results& r);

/// Describes how the frame of pictures differs from the world frame of the files: a rotation about z by more than 0.5
/// degrees, or a vertical shift by more than half a centimetre. Empty if there is neither. `unit`: the unit of lengths.
[[nodiscard]] std::string view_frame_note(const view_frame& frame, const std::string& unit);
/// The transform from the world frame to the frame of pictures, as `tx ty tz qx qy qz qw`.
[[nodiscard]] std::string view_frame_text(const view_frame& frame);

/// The colour for a height, with `t` in [0, 1] from the lowest to the highest point.
[[nodiscard]] orbis::rgb8 height_color(double t);

}  // namespace app
