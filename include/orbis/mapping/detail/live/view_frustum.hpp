// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How far a change of pose displaces what a camera sees.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::mapping::detail {

/// The corners of a pyramid around all rays of a camera, in the camera frame at z = 1.
class view_frustum {
 public:
  /// O(pixels).
  template <camera::camera_model Camera>
  explicit view_frustum(const Camera& camera) {
    vec2 low = vec2::Constant(std::numeric_limits<double>::infinity()), high = -low;
    const auto add = [&](int u, int v) {
      const auto ray = camera.unproject(vec2{u, v});
      if (!ray || !ray->allFinite()) return;
      low = low.cwiseMin(ray->template head<2>());
      high = high.cwiseMax(ray->template head<2>());
    };
    // Every pixel: at the border of a fisheye image there may be no ray.
    for (int v = 0; v != camera.height(); ++v)
      for (int u = 0; u != camera.width(); ++u) add(u, v);
    if (!(low.array() <= high.array()).all()) low = high = vec2::Zero();
    // Depth along the axis says little of rays that are almost at right angles to it: what is farther off than 80
    // degrees counts as if it were there.
    constexpr double widest = 5.67;
    low = low.cwiseMax(-widest);
    high = high.cwiseMin(widest);
    for (unsigned i = 0; i != 4; ++i)
      corners_[i] = {(i & 1U) != 0 ? high.x() : low.x(), (i & 2U) != 0 ? high.y() : low.y(), 1.0};
  }

  /// The largest distance by which a change of the pose moves a point of the frustum from the camera to the depth
  /// `reach` (metres along the optical axis). A change moves points by an affine function, whose norm is largest at a
  /// corner: of the five corners, one is the camera's centre. O(1).
  [[nodiscard]] double displacement(const se3& T_world_before, const se3& T_world_after, double reach) const {
    double largest = (T_world_after.translation() - T_world_before.translation()).norm();
    for (const vec3& c : corners_) {
      const vec3 far = reach * c;
      largest = std::max(largest, (T_world_after * far - T_world_before * far).norm());
    }
    return largest;
  }

 private:
  std::array<vec3, 4> corners_;
};

/// The largest depth of an image, metres; 0 if no pixel is valid. O(pixels).
[[nodiscard]] inline double largest_depth(const camera::depth_view<std::uint16_t>& depth) {
  // Depth grows with what is stored: the largest stored value that is valid is found without a division for each pixel.
  const double most = static_cast<double>(depth.max_depth()) * depth.scale();
  std::uint16_t largest = 0;
  for (int y = 0; y != depth.height(); ++y)
    for (const std::uint16_t stored : depth.pixels().row(y)) {
      const bool valid = stored != std::numeric_limits<std::uint16_t>::max() && static_cast<double>(stored) <= most;
      largest = std::max(largest, valid ? stored : std::uint16_t{0});
    }
  return static_cast<double>(largest) / depth.scale();
}

}  // namespace orbis::mapping::detail
