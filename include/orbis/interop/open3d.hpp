// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Open3D point clouds (`open3d::geometry::PointCloud`). Every algorithm accepts their `points_` directly as a range of
/// points. Filters return indices; `extract` copies the selected points with their colours, normals and covariances:
///
/// @code
///   const auto keep = orbis::cloud::statistical_inliers(orbis::par, cloud.points_);
///   const open3d::geometry::PointCloud clean = orbis::interop::extract(cloud, keep);
/// @endcode
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>

#include <open3d/geometry/PointCloud.h>

#include <orbis/core/image.hpp>
#include <orbis/core/point_cloud.hpp>
#include <orbis/core/types.hpp>

namespace orbis::interop {

/// Converts an Open3D colour (0 ... 1); values outside this range, and NaN, are clamped.
[[nodiscard]] inline rgb8 color_from_open3d(const vec3& color) noexcept {
  const auto byte = [](double v) {
    return v > 0 ? static_cast<std::uint8_t>(std::lround(255.0 * std::min(v, 1.0))) : std::uint8_t{0};
  };
  return {byte(color.x()), byte(color.y()), byte(color.z())};
}
[[nodiscard]] inline vec3 color_to_open3d(const rgb8& color) noexcept {
  return vec3{static_cast<double>(color.r), static_cast<double>(color.g), static_cast<double>(color.b)} / 255.0;
}

/// The points with the given indices, in the order of the indices, with their colours, normals and covariances.
/// @pre every index < cloud.points_.size()
[[nodiscard]] inline open3d::geometry::PointCloud extract(const open3d::geometry::PointCloud& cloud,
                                                          std::span<const std::uint32_t> indices) {
  open3d::geometry::PointCloud out;
  const auto take = [&](const auto& from, auto& to) {
    if (from.size() != cloud.points_.size()) return;  // Open3D's convention: all points have the attribute, or none
    to.reserve(indices.size());
    for (const std::uint32_t i : indices) {
      assert(i < from.size());
      to.push_back(from[i]);
    }
  };
  take(cloud.points_, out.points_);
  take(cloud.colors_, out.colors_);
  take(cloud.normals_, out.normals_);
  take(cloud.covariances_, out.covariances_);
  return out;
}

/// Copies the points, as float, and the colours if every point has one.
[[nodiscard]] inline point_cloud from_open3d(const open3d::geometry::PointCloud& cloud) {
  point_cloud out;
  out.points.reserve(cloud.points_.size());
  for (const vec3& p : cloud.points_) out.points.push_back(p.cast<float>());
  if (!cloud.HasColors()) return out;
  out.colors.reserve(cloud.colors_.size());
  for (const vec3& c : cloud.colors_) out.colors.push_back(color_from_open3d(c));
  return out;
}

/// Copies the points to an Open3D cloud, with the colours if there are any.
[[nodiscard]] inline open3d::geometry::PointCloud to_open3d(const point_cloud& cloud) {
  open3d::geometry::PointCloud out;
  out.points_.reserve(cloud.size());
  for (const vec3f& p : cloud.points) out.points_.push_back(p.cast<double>());
  out.colors_.reserve(cloud.colors.size());
  for (const rgb8& c : cloud.colors) out.colors_.push_back(color_to_open3d(c));
  return out;
}

}  // namespace orbis::interop
