// SPDX-License-Identifier: BSD-3-Clause
//
// Whether an octree's voxels are so small that its insertions take long or do not fit into memory, told before it is
// built.
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

/// About how many voxels an octree has to keep for some rays: those in the space that they go through, or, where they
/// are farther apart, some beside each voxel on their way.
class voxel_estimate {
 public:
  /// A ray of `length` metres, and the space that is its own, cubic metres.
  void add(double length, double volume) {
    lengths_ += length;
    volume_ += volume;
  }
  /// For voxels of this edge, metres.
  [[nodiscard]] double voxels(double resolution) const {
    return std::min(16.0 * lengths_ / resolution, volume_ / (resolution * resolution * resolution));
  }
  /// Of the octree, as measured where little of it can be pruned.
  [[nodiscard]] double bytes(double resolution) const { return 8.0 * voxels(resolution); }
  [[nodiscard]] bool takes_long(double resolution) const { return voxels(resolution) >= 1e8; }
  /// Whether they are more than anybody has use for, or do not fit into `memory` bytes (where that is known).
  [[nodiscard]] bool is_too_large(double resolution, std::optional<std::uint64_t> memory) const {
    return voxels(resolution) >= 2e9 || (memory && bytes(resolution) > static_cast<double>(*memory));
  }

  /// "voxels of 1 mm: `what` has about 0.3 billion of them, 2.4 GB".
  [[nodiscard]] std::string in_words(double resolution, const std::string& what) const {
    char text[160];
    std::snprintf(text, sizeof text, "voxels of %g mm: %s has about %.1f billion of them, %.1f GB", 1000.0 * resolution,
                  what.c_str(), 1e-9 * voxels(resolution), 1e-9 * bytes(resolution));
    return text;
  }

 private:
  double lengths_ = 0.0, volume_ = 0.0;
};

/// Of a depth image: `depth(i)` metres along z, 0 where there is none.
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
