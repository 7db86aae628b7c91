// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A frame to look at a map in: z up, walls along the axes, the floor at zero.
#pragma once

#include <optional>
#include <string>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

#include "results.hpp"

namespace app {

struct view_frame {
  orbis::se3 T_view_world;
  orbis::vec3 low = orbis::vec3::Zero(), high = orbis::vec3::Ones();  ///< bounds of the map in view, outliers aside
  double cut = 1.0;  ///< what lies higher hides the rest from above: a ceiling
};

/// Turns the world about its z axis so that walls fall into few, full bins, and puts the floor (its height in the
/// world, metres) at 0, or where none is known the lowest points. For pictures only; nothing is measured in this frame.
[[nodiscard]] view_frame find_view_frame(const std::vector<orbis::vec3f>& points, const orbis::trajectory& cameras,
                                         std::optional<double> floor);
/// The height of the floor in the world, metres: the median of the points in the voxels of which it is made. Empty if
/// no floor was found.
[[nodiscard]] std::optional<double> height_of_floor(const results& r);

/// What pictures say about it, since it is not the world's frame, in which the files are.
inline constexpr const char* view_frame_note =
    "drawn with walls along x and y and the floor at 0: turned about z against the world frame of the files";
/// The transform from the world, `tx ty tz qx qy qz qw`.
[[nodiscard]] std::string view_frame_text(const view_frame& frame);

/// A colour for a height within the bounds, `t` in [0, 1].
[[nodiscard]] orbis::rgb8 height_color(double t);

}  // namespace app
