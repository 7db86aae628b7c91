// SPDX-License-Identifier: BSD-3-Clause
//
// Estimates, before an octree is built, whether its voxels are so small that insertion takes a long time or exceeds the
// memory.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <string>

#include <orbis/camera/intrinsics.hpp>

namespace examples {

/// An estimate of the number of voxels that an octree stores for a set of rays: the voxels in the volume between the
/// rays or, if the rays are farther apart than a voxel, the voxels along each ray and some neighbours.
class voxel_estimate {
 public:
  /// Adds a ray of `length` metres and its share of the volume in cubic metres.
  void add(double length, double volume) {
    lengths_ += length;
    volume_ += volume;
  }
  /// The estimated number of voxels with an edge length of `resolution` metres.
  [[nodiscard]] double voxels(double resolution) const {
    return std::min(16.0 * lengths_ / resolution, volume_ / (resolution * resolution * resolution));
  }
  /// The estimated size of the octree in bytes, based on measurements of scenes that allow little pruning.
  [[nodiscard]] double bytes(double resolution) const { return 8.0 * voxels(resolution); }
  [[nodiscard]] bool takes_long(double resolution) const { return voxels(resolution) >= 1e8; }
  /// Returns true if there are at least two billion voxels, or if they do not fit into `memory` bytes (if known).
  [[nodiscard]] bool is_too_large(double resolution, std::optional<std::uint64_t> memory) const {
    return voxels(resolution) >= 2e9 || (memory && bytes(resolution) > static_cast<double>(*memory));
  }

  /// A description: "`what` has about 0.3 billion voxels of 1 mm (2.4 GB)".
  [[nodiscard]] std::string describe(double resolution, const std::string& what) const {
    char text[160];
    std::snprintf(text, sizeof text, "%s has about %.1f billion voxels of %g mm (%.1f GB)", what.c_str(),
                  1e-9 * voxels(resolution), 1000.0 * resolution, 1e-9 * bytes(resolution));
    return text;
  }

 private:
  double lengths_ = 0.0, volume_ = 0.0;
};

/// The estimate for a depth image. `depth(i)`: depth of pixel `i` in metres along z; 0 if it is unknown.
template <class Depth>
[[nodiscard]] voxel_estimate voxels_of_depth(const orbis::camera::intrinsics& k, const Depth& depth) {
  voxel_estimate all;
  for (std::size_t i = 0; i != static_cast<std::size_t>(k.width) * static_cast<std::size_t>(k.height); ++i) {
    const double z = depth(i);
    all.add(z, z * z * z / (3.0 * k.fx * k.fy));
  }
  return all;
}

}  // namespace examples
