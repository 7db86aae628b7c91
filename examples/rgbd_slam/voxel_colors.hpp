// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Colours of voxels: the mean colours of the points in them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>

#include "results.hpp"

namespace app {

class voxel_colors {
 public:
  /// `resolution`: the edge length of a voxel, metres.
  explicit voxel_colors(double resolution) : grid_{resolution} {}

  /// Adds a point (metres, world).
  void add(const orbis::vec3f& point, orbis::rgb8 color);
  /// Removes a point that was added before. The memory of an empty voxel is reused.
  void remove(const orbis::vec3f& point, orbis::rgb8 color);
  /// The mean colour of the points in a cube of whole voxels or, if it contains none, of the points in the neighbouring
  /// voxels; empty if these contain none either.
  [[nodiscard]] std::optional<orbis::rgb8> mean_color(const voxel& cube) const;
  /// The number of voxels with points.
  [[nodiscard]] std::size_t size() const { return index_.size(); }
  /// Size of the allocated memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const {
    return index_.memory_bytes() + sums_.capacity() * sizeof(sum) + unused_.capacity() * sizeof(std::uint32_t);
  }

 private:
  struct sum {
    std::uint64_t r = 0, g = 0, b = 0, n = 0;
  };
  orbis::octree::voxel_grid grid_;
  orbis::hash_index index_;  // voxel with points -> index in sums_
  std::vector<sum> sums_;
  std::vector<std::uint32_t> unused_;  // indices in sums_
};

/// The colour of surfaces that are not visible in any image.
inline constexpr orbis::rgb8 no_color{176, 178, 182};

}  // namespace app
