// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The points of a keyframe's depth image in the world, filtered before they become points.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <optional>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/camera/world_point.hpp>
#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/mapping/masked_depth.hpp>

namespace orbis::mapping {

/// Which pixels become points.
struct keyframe_point_options {
  int stride = 1;          ///< every stride-th pixel of every stride-th row; > 0
  float min_depth = 0.0F;  ///< metres along the optical axis
  float max_depth = 4.0F;  ///< metres along the optical axis
  /// Pixels between two surfaces are left out; empty: they are not looked for.
  std::optional<cloud::flying_pixel_options> flying_pixels{};
};

/// Reads depth images. Keeps the memory that it needs for the filter.
class keyframe_points {
 public:
  /// In how many parts an image is read.
  [[nodiscard]] static std::size_t parts(const camera::ray_table& rays, int stride) noexcept {
    return static_cast<std::size_t>((rays.height() + stride * rows_of_part - 1) / (stride * rows_of_part));
  }

  /// Calls `f(part, x, y, point, range)` for the pixels with a valid depth and a ray: the point in the
  /// world (`camera::world_point`, a `vec3f`), and its distance from the camera, metres. Within a part in the order of
  /// the pixels; parts may be on different threads. The same image, options and pose give the same bits, however they
  /// are compiled. Returns how many pixels of the whole image the filter has looked at and left out. O(pixels).
  /// @pre depth and rays have the same size; options.stride > 0
  template <execution_policy Policy, camera::depth_source Depth, class F>
  cloud::flying_pixel_count read(const Policy& policy, const Depth& depth, const camera::ray_table& rays,
                                 const keyframe_point_options& options, const se3& T_world_camera, F&& f) {
    assert(depth.width() == rays.width() && depth.height() == rays.height() && options.stride > 0);
    if (options.flying_pixels) {
      if (filtered_.width() != rays.width() || filtered_.height() != rays.height())
        filtered_ = image<float>(rays.width(), rays.height());
      const auto count =
          cloud::remove_flying_pixels(policy, depth, filtered_.view(), *options.flying_pixels, workspace_);
      read_all(policy, camera::depth_view<float>(filtered_.view()), rays, options, T_world_camera, f);
      return count;
    }
    read_all(policy, depth, rays, options, T_world_camera, f);
    return {};
  }
  /// A copy of the depth image (see `view_like`) in which every pixel is 0 that would not become a point, whatever the
  /// stride: what `dense_cloud::masked_depth` gives before a filter of the cloud. O(pixels). @pre as for `read`
  template <execution_policy Policy, camera::depth_source Depth>
  [[nodiscard]] image<depth_pixel<Depth>> masked(const Policy& policy, const Depth& depth,
                                                 const camera::ray_table& rays, keyframe_point_options options) {
    options.stride = 1;
    image<depth_pixel<Depth>> out(rays.width(), rays.height());
    read(policy, depth, rays, options, se3{},
         [&](std::size_t, int x, int y, const vec3f&, float) { out(x, y) = stored_depth(depth, x, y); });
    return out;
  }

 private:
  static constexpr int rows_of_part = 8;

  template <execution_policy Policy, camera::depth_source Depth, class F>
  static void read_all(const Policy& policy, const Depth& depth, const camera::ray_table& rays,
                       const keyframe_point_options& options, const se3& T_world_camera, F&& f) {
    const camera::float_pose pose{T_world_camera};
    for_each_index(policy, parts(rays, options.stride), 1, [&](std::size_t part) {
      const int first = static_cast<int>(part) * rows_of_part * options.stride;
      for (int y = first; y < std::min(rays.height(), first + rows_of_part * options.stride); y += options.stride) {
        for (int x = 0; x < rays.width(); x += options.stride) {
          const float z = depth(x, y);
          if (!(z > 0.0F && z >= options.min_depth && z <= options.max_depth)) continue;
          const vec3f in_camera = rays.at(x, y, z);
          const float squared = (rounded_product(in_camera[0], in_camera[0]) +  //
                                 rounded_product(in_camera[1], in_camera[1])) +
                                rounded_product(in_camera[2], in_camera[2]);
          if (!std::isfinite(squared)) continue;  // a pixel without a ray
          const vec2f& ray = rays(x, y);
          const auto p = camera::world_point(pose, ray.x(), ray.y(), z);
          f(part, x, y, vec3f{p[0], p[1], p[2]}, std::sqrt(squared));
        }
      }
    });
  }

  image<float> filtered_;
  cloud::flying_pixel_workspace workspace_;
};

}  // namespace orbis::mapping
