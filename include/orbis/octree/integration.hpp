// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Options of the integration of a scan, and a summary of what became of its points.
#pragma once

#include <cstddef>
#include <limits>

namespace orbis::octree {

/// Which rays of a scan are traversed.
enum class ray_mode {
  every_ray,   ///< from the sensor to every point (OctoMap's `discretize = false`)
  discretized  ///< from the sensor to the centre of every voxel that holds points (`discretize = true`)
};

struct integration_options {
  /// Metres from the sensor; of a point further away only the ray up to here counts, as free. A point
  /// at exactly this distance is within range. OctoMap's "no limit", a negative range, is infinity here.
  /// @pre >= 0
  double max_range = std::numeric_limits<double>::infinity();
  ray_mode mode = ray_mode::every_ray;
};

/// What became of a scan. In mode `discretized`, `used` and `truncated` count the voxels that hold
/// points instead of the points, and points that share a voxel count once.
struct integration_summary {
  std::size_t used = 0;       ///< points within range
  std::size_t truncated = 0;  ///< points beyond the range
  std::size_t rejected = 0;   ///< points that are NaN, infinite, or too far outside the grid
  std::size_t free = 0;       ///< voxels observed free; in a map without those that are free already and saturated
  std::size_t occupied = 0;   ///< voxels observed occupied
};

}  // namespace orbis::octree
