// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The colours of voxels: means of the coloured points in them.
#pragma once

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
  /// `resolution`: the edge of a voxel, metres.
  explicit voxel_colors(double resolution) : grid_{resolution} {}

  /// Adds a point (metres, world).
  void add(const orbis::vec3f& point, orbis::rgb8 color);
  /// Takes out a point that was added.
  void remove(const orbis::vec3f& point, orbis::rgb8 color);
  /// The mean colour of the points in a cube that consists of whole voxels; where it has none, of those in the voxels
  /// around it; where these have none either, nothing.
  [[nodiscard]] std::optional<orbis::rgb8> color_of(const voxel& cube) const;

 private:
  struct sum {
    std::uint32_t r = 0, g = 0, b = 0, n = 0;
  };
  [[nodiscard]] sum* sum_at(const orbis::vec3f& point, bool make);

  orbis::octree::voxel_grid grid_;
  orbis::hash_index index_;  // of voxels in sums_
  std::vector<sum> sums_;
};

/// The colour of what no image shows.
inline constexpr orbis::rgb8 no_color{176, 178, 182};

}  // namespace app
