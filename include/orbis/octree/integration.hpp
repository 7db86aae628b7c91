// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Options for integrating a scan, and a summary of the result.
#pragma once

#include <cstddef>
#include <limits>

namespace orbis::octree {

/// Selects the rays of a scan that are traversed.
enum class ray_mode {
  every_ray,   ///< rays from the sensor to every point (OctoMap's `discretize = false`)
  discretized  ///< rays from the sensor to the centre of every voxel that holds points (`discretize = true`)
};

struct integration_options {
  /// Maximum distance from the sensor, metres. For a point further away, only the ray up to this distance is
  /// integrated, as free space. A point at exactly this distance is within range. OctoMap's "no limit", a negative
  /// range, corresponds to infinity.
  /// @pre >= 0
  double max_range = std::numeric_limits<double>::infinity();
  ray_mode mode = ray_mode::every_ray;
};

/// Counts of points and voxels of an integrated scan. In mode `discretized`, `used` and `truncated` count
/// voxels rather than points: all points in a voxel count once.
struct integration_summary {
  std::size_t used = 0;       ///< number of points within range
  std::size_t truncated = 0;  ///< number of points beyond the range
  std::size_t rejected = 0;   ///< number of points that are NaN, infinite, or too far outside the grid
  std::size_t free = 0;       ///< number of voxels observed as free; a map excludes those already at the lower bound
  std::size_t occupied = 0;   ///< number of voxels observed as occupied
};

}  // namespace orbis::octree
