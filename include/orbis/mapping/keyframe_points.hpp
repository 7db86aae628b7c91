// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The points of a keyframe's depth image in the world frame, with pixel filtering.
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

/// Selection of the pixels that become points.
struct keyframe_point_options {
  int stride = 1;          ///< every stride-th pixel of every stride-th row; > 0
  float min_depth = 0.0F;  ///< metres along the optical axis
  float max_depth = 4.0F;  ///< metres along the optical axis
  /// Removal of flying pixels, whose depths lie between those of two surfaces; empty: no removal.
  std::optional<cloud::flying_pixel_options> flying_pixels{};
};

/// Converts depth images to points. Reuses the memory of its filter.
class keyframe_points {
 public:
  /// Number of parts into which `read` divides an image.
  [[nodiscard]] static std::size_t parts(const camera::ray_table& rays, int stride) noexcept {
    return static_cast<std::size_t>((rays.height() + stride * rows_of_part - 1) / (stride * rows_of_part));
  }

  /// Calls `f(part, x, y, point, range)` for the pixels with a valid depth and a ray: the point in the world frame
  /// (`camera::world_point`, a `vec3f`), and its distance from the camera, metres. Within a part, calls are in the
  /// order of the pixels; parts may run on different threads. The same image, options and pose give bit-identical
  /// results with every compiler. Returns the number of pixels of the whole image that the filter examined and removed.
  /// O(pixels). @pre depth and rays have the same size; options.stride > 0
  template <execution_policy Policy, camera::depth_source Depth, class F>
  cloud::flying_pixel_count read(const Policy& policy, const Depth& depth, const camera::ray_table& rays,
                                 const keyframe_point_options& options, const se3& T_world_camera, F&& f) {
    assert(depth.width() == rays.width() && depth.height() == rays.height() && options.stride > 0);
    if (options.flying_pixels) {
      const auto count = remove_flying(policy, depth, rays, options);
      read_all(policy, camera::depth_view<float>(filtered_.view()), rays, options, T_world_camera, f);
      return count;
    }
    read_all(policy, depth, rays, options, T_world_camera, f);
    return {};
  }
  /// Returns a copy of the depth image (see `view_like`) with 0 in every pixel that would not become a point,
  /// regardless of the stride: the result of `dense_cloud::masked_depth` before the cloud is filtered. O(pixels). @pre
  /// same as for `read`
  template <execution_policy Policy, camera::depth_source Depth>
  [[nodiscard]] image<camera::depth_pixel<Depth>> masked(const Policy& policy, const Depth& depth,
                                                         const camera::ray_table& rays,
                                                         const keyframe_point_options& options) {
    image<camera::depth_pixel<Depth>> out(rays.width(), rays.height());
    static_cast<void>(mask(policy, depth, rays, options, out.view()));
    return out;
  }
  /// As above, but writes to `out`, which may be the pixels of `depth` itself. Returns the numbers of pixels that the
  /// flying-pixel filter examined and removed. @pre `out` has the size of `depth`
  template <execution_policy Policy, camera::depth_source Depth>
  cloud::flying_pixel_count mask(const Policy& policy, const Depth& depth, const camera::ray_table& rays,
                                 const keyframe_point_options& options, image_view<camera::depth_pixel<Depth>> out) {
    const auto keep = [&](const auto& valid) {
      for_each_index(policy, static_cast<std::size_t>(rays.height()), rows_of_part, [&](std::size_t row) {
        const int y = static_cast<int>(row);
        for (int x = 0; x != rays.width(); ++x) {
          const float z = valid(x, y);
          const bool is_point = is_in_range(z, options) && std::isfinite(squared_norm(rays.at(x, y, z)));
          out(x, y) = is_point ? stored_depth(depth, x, y) : camera::depth_pixel<Depth>{};
        }
      });
    };
    if (options.flying_pixels) {
      const auto count = remove_flying(policy, depth, rays, options);
      keep(camera::depth_view<float>(filtered_.view()));
      return count;
    }
    keep(depth);
    return {};
  }
  /// Returns the point of one pixel in the world frame, bit-identical to the one from `read`; empty if the pixel has no
  /// point.
  /// @pre the pixel is inside the image; depth and rays have the same size
  template <camera::depth_source Depth>
  [[nodiscard]] static std::optional<vec3f> point_at(const Depth& depth, int x, int y, const camera::ray_table& rays,
                                                     const keyframe_point_options& options,
                                                     const camera::float_pose& T_world_camera) {
    const float z = depth(x, y);
    if (!is_in_range(z, options) || !std::isfinite(squared_norm(rays.at(x, y, z)))) return std::nullopt;
    const vec2f& ray = rays(x, y);
    const auto p = camera::world_point(T_world_camera, ray.x(), ray.y(), z);
    return vec3f{p[0], p[1], p[2]};
  }

 private:
  static constexpr int rows_of_part = 8;

  [[nodiscard]] static bool is_in_range(float z, const keyframe_point_options& options) noexcept {
    return z > 0.0F && z >= options.min_depth && z <= options.max_depth;
  }
  /// Squared distance from the camera; not finite for a pixel without a ray.
  [[nodiscard]] static float squared_norm(const vec3f& p) noexcept {
    return (rounded_product(p[0], p[0]) + rounded_product(p[1], p[1])) + rounded_product(p[2], p[2]);
  }
  /// Removes flying pixels and writes the result to `filtered_`.
  template <execution_policy Policy, camera::depth_source Depth>
  cloud::flying_pixel_count remove_flying(const Policy& policy, const Depth& depth, const camera::ray_table& rays,
                                          const keyframe_point_options& options) {
    if (filtered_.width() != rays.width() || filtered_.height() != rays.height())
      filtered_ = image<float>(rays.width(), rays.height());
    return cloud::remove_flying_pixels(policy, depth, filtered_.view(), *options.flying_pixels, workspace_);
  }
  template <execution_policy Policy, camera::depth_source Depth, class F>
  static void read_all(const Policy& policy, const Depth& depth, const camera::ray_table& rays,
                       const keyframe_point_options& options, const se3& T_world_camera, F&& f) {
    const camera::float_pose pose{T_world_camera};
    for_each_index(policy, parts(rays, options.stride), 1, [&](std::size_t part) {
      const int first = static_cast<int>(part) * rows_of_part * options.stride;
      for (int y = first; y < std::min(rays.height(), first + rows_of_part * options.stride); y += options.stride) {
        for (int x = 0; x < rays.width(); x += options.stride) {
          const float z = depth(x, y);
          if (!is_in_range(z, options)) continue;
          const float squared = squared_norm(rays.at(x, y, z));
          if (!std::isfinite(squared)) continue;
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
