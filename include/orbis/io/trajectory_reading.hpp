// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A trajectory read from a file in any supported layout, with notes for the user.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include <orbis/core/trajectory.hpp>

namespace orbis::io {

enum class trajectory_layout {
  tum,    ///< `timestamp tx ty tz qx qy qz qw`
  euroc,  ///< `timestamp, tx, ty, tz, qw, qx, qy, qz`, and more columns; times usually in nanoseconds
  kitti   ///< the first three rows of the pose matrix, 12 numbers, without a time
};

/// A trajectory from a file in any supported layout.
struct trajectory_reading {
  trajectory poses;  ///< with distinct times; in KITTI's layout the time is the index of the line, see `set_times`
  trajectory_layout layout = trajectory_layout::tum;
  std::size_t lost = 0;            ///< number of omitted lines with NaN, infinity or a zero quaternion
  std::vector<std::string> notes;  ///< warnings for the user, with the file name: assumptions, and omitted lines
};

}  // namespace orbis::io
