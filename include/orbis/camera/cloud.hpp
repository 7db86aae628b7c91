// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversion of depth images to points.
#pragma once

#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/camera/world_point.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

/// Selection of the pixels of a depth image that become points.
struct unproject_options {
  int stride = 1;                                       ///< every stride-th pixel of every stride-th row
  float min_depth = 0.0F;                               ///< minimum depth, metres along the optical axis
  float max_depth = std::numeric_limits<float>::max();  ///< maximum depth, metres along the optical axis
};

/// Points, and the pixels from which they were computed.
struct unprojected_points {
  std::vector<vec3f> points;          ///< metres
  std::vector<std::uint32_t> pixels;  ///< `y * width + x`, ascending; one per point
};

namespace detail {

/// Calls `f(x, y, point)` for each valid pixel in row `y`.
template <depth_source Depth, std::invocable<int, int, const vec3f&> F>
void for_each_point_of_row(const Depth& depth, const ray_table& rays, int y, const unproject_options& options, F&& f) {
  for (int x = 0; x < rays.width(); x += options.stride) {
    const float z = depth(x, y);
    if (!(z > 0.0F && z >= options.min_depth && z <= options.max_depth)) continue;
    const vec3f point = rays.at(x, y, z);
    if (std::isfinite(point.x()) && std::isfinite(point.y()) && std::isfinite(z)) f(x, y, point);
  }
}

}  // namespace detail

/// Converts a depth image to points in the world frame, which are in pixel order for every policy. O(width * height /
/// stride^2).
/// @pre depth and rays have the same size; options.stride > 0
template <execution_policy Policy, depth_source Depth>
[[nodiscard]] unprojected_points unproject_depth(const Policy& policy, const Depth& depth, const ray_table& rays,
                                                 const unproject_options& options = {},
                                                 const se3& T_world_camera = {}) {
  assert(depth.width() == rays.width() && depth.height() == rays.height() && options.stride > 0);
  const auto rows = static_cast<std::size_t>((rays.height() + options.stride - 1) / options.stride);
  const auto row_of = [&](std::size_t i) { return static_cast<int>(i) * options.stride; };
  constexpr std::size_t grain = 16;

  std::vector<std::size_t> first(rows + 1, 0);  // index of the first point of each row
  for_each_index(policy, rows, grain, [&](std::size_t i) {
    std::size_t count = 0;
    detail::for_each_point_of_row(depth, rays, row_of(i), options, [&](int, int, const vec3f&) { ++count; });
    first[i + 1] = count;
  });
  for (std::size_t i = 0; i != rows; ++i) first[i + 1] += first[i];

  unprojected_points out;
  out.points.resize(first[rows]);
  out.pixels.resize(first[rows]);
  const float_pose pose{T_world_camera};
  for_each_index(policy, rows, grain, [&](std::size_t i) {
    std::size_t at = first[i];
    detail::for_each_point_of_row(depth, rays, row_of(i), options, [&](int x, int y, const vec3f& point) {
      const vec2f& ray = rays(x, y);
      const auto p = world_point(pose, ray.x(), ray.y(), point.z());
      out.points[at] = {p[0], p[1], p[2]};
      out.pixels[at] =
          static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(rays.width()) + static_cast<std::uint32_t>(x);
      ++at;
    });
  });
  return out;
}

/// Converts a single depth image; computes the camera's ray table first. For several images from one camera, build the
/// table once and call the overload above. O(pixels).
template <execution_policy Policy, depth_source Depth, camera_model Camera>
[[nodiscard]] unprojected_points unproject_depth(const Policy& policy, const Depth& depth, const Camera& camera,
                                                 const unproject_options& options = {},
                                                 const se3& T_world_camera = {}) {
  return unproject_depth(policy, depth, ray_table(camera), options, T_world_camera);
}

}  // namespace orbis::camera
