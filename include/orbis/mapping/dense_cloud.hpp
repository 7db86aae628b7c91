// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframes' depth images spliced into one cloud in the world.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/cloud.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/types.hpp>
#include <orbis/mapping/keyframe.hpp>

namespace orbis::mapping {

struct dense_options {
  int stride = 2;           ///< every stride-th pixel of every stride-th row; > 0
  float min_depth = 0.0F;   ///< metres along the optical axis
  float max_depth = 4.0F;   ///< metres along the optical axis
  double voxel_size = 0.0;  ///< metres; points in one voxel become their centroid. 0: every point stays
};

/// A cloud that grows by keyframes. With a voxel size its memory follows the surface that was seen
/// (about 60 bytes for each voxel), without one the number of measurements.
class dense_cloud {
 public:
  /// @pre options.stride > 0, options.voxel_size >= 0
  explicit dense_cloud(camera::ray_table rays, const dense_options& options = {})
      : rays_{std::move(rays)}, options_{options}, voxels_{options.voxel_size > 0 ? options.voxel_size : 1.0} {
    assert(options.stride > 0 && options.voxel_size >= 0);
  }

  /// Adds a keyframe's points; returns how many measurements there were. Colours are kept if every
  /// keyframe has them. O(pixels / stride^2). @pre the images have the size of the ray table
  template <execution_policy Policy, keyframe_like Keyframe>
  std::size_t splice(const Policy& policy, const Keyframe& k) {
    const image_view<const rgb8> color = k.color;
    assert(color.empty() || (color.width() == rays_.width() && color.height() == rays_.height()));
    const camera::unprojected_points seen = unproject(policy, k);
    first_of_frame_.push_back(ranges_.size());
    colored_ = colored_ && !color.empty();
    const vec3f origin = se3(k.T_world_camera).translation().template cast<float>();
    for (std::size_t i = 0; i != seen.points.size(); ++i) {
      const auto pixel = static_cast<int>(seen.pixels[i]);
      const rgb8 c = color.empty() ? rgb8{} : color(pixel % rays_.width(), pixel / rays_.width());
      const float range = (seen.points[i] - origin).norm();
      if (!merging()) {
        every_.points.push_back(seen.points[i]);
        every_.colors.push_back(c);
        ranges_.push_back(range);
      } else if (const auto number = voxels_.add(seen.points[i], c)) {
        if (*number == ranges_.size()) ranges_.push_back(range);
        ranges_[*number] = std::min(ranges_[*number], range);
      }
    }
    return seen.points.size();
  }

  [[nodiscard]] std::size_t size() const noexcept { return ranges_.size(); }
  /// The cloud so far, in the world.
  [[nodiscard]] point_cloud cloud() const {
    if (merging()) return voxels_.centroids(colored_);
    return {every_.points, colored_ ? every_.colors : std::vector<rgb8>{}};
  }
  /// For each point of the cloud the distance in metres from which it was seen, the shortest one if
  /// there are several.
  [[nodiscard]] std::span<const float> ranges() const noexcept { return ranges_; }

  /// A keyframe's own measurements in the world, of those alone whose point of the cloud is `kept`
  /// (one entry for each point; empty: all are). `number`: how many keyframes were spliced before it.
  /// @pre the same keyframe was spliced
  template <execution_policy Policy, keyframe_like Keyframe>
  [[nodiscard]] std::vector<vec3f> measurements(const Policy& policy, const Keyframe& k, std::size_t number,
                                                std::span<const char> kept = {}) const {
    assert(number < first_of_frame_.size() && (kept.empty() || kept.size() == size()));
    std::vector<vec3f> points = unproject(policy, k).points;
    if (kept.empty()) return points;
    std::size_t in_cloud = first_of_frame_[number];
    std::erase_if(points, [&](const vec3f& p) {
      if (!merging()) return kept[in_cloud++] == 0;
      const auto voxel = voxels_.find(p);
      return !voxel || kept[*voxel] == 0;
    });
    return points;
  }

 private:
  [[nodiscard]] bool merging() const noexcept { return options_.voxel_size > 0; }

  template <execution_policy Policy, keyframe_like Keyframe>
  [[nodiscard]] camera::unprojected_points unproject(const Policy& policy, const Keyframe& k) const {
    return camera::unproject_depth(
        policy, k.depth, rays_,
        {.stride = options_.stride, .min_depth = options_.min_depth, .max_depth = options_.max_depth},
        k.T_world_camera);
  }

  camera::ray_table rays_;
  dense_options options_;
  cloud::voxel_accumulator voxels_;  ///< where points are merged
  point_cloud every_;                ///< where they are not
  std::vector<float> ranges_;
  std::vector<std::size_t> first_of_frame_;
  bool colored_ = true;
};

}  // namespace orbis::mapping
