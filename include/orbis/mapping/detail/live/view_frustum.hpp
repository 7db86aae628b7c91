// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Displacement of a camera's view caused by a change of its pose.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::mapping::detail {

/// An eight-sided pyramid around all rays of a camera, stored as its corners at z = 1 in the camera frame.
class view_frustum {
 public:
  /// Encloses the rays of all pixels. O(pixels).
  template <camera::camera_model Camera>
  explicit view_frustum(const Camera& camera) {
    // All pixels, not only those at the border, which may have no ray in a fisheye image.
    for (int v = 0; v != camera.height(); ++v)
      for (int u = 0; u != camera.width(); ++u)
        if (const auto ray = camera.unproject(vec2{u, v})) include(ray->template head<2>());
    close();
  }
  explicit view_frustum(const camera::ray_table& rays) {
    for (int v = 0; v != rays.height(); ++v)
      for (int u = 0; u != rays.width(); ++u) include(rays(u, v).cast<double>());
    close();
  }

  /// Returns the largest distance by which a change of the pose moves a point of the frustum. The frustum ends at
  /// depth `reach` (metres along the optical axis). The displacement is an affine function of the point, so its norm is
  /// largest at one of the nine corners, which include the camera's centre. Infinite if the reach or a pose is not
  /// finite. O(1).
  [[nodiscard]] double displacement(const se3& T_world_before, const se3& T_world_after, double reach) const {
    double largest = norm(T_world_after.translation() - T_world_before.translation());
    for (const vec3& c : corners_) {
      const vec3 far = reach * c;
      const double moved = norm(T_world_after * far - T_world_before * far);
      if (!std::isfinite(moved)) return std::numeric_limits<double>::infinity();  // std::max would drop NaN
      largest = std::max(largest, moved);
    }
    return largest;
  }

 private:
  static constexpr std::size_t sides = 8;
  [[nodiscard]] static vec2 direction(std::size_t side) noexcept {
    constexpr double half = 0.70710678118654752440;
    constexpr std::array<std::array<double, 2>, sides> all{
        {{1, 0}, {half, half}, {0, 1}, {-half, half}, {-1, 0}, {-half, -half}, {0, -1}, {half, -half}}};
    return {all[side % sides][0], all[side % sides][1]};
  }
  /// Extends the pyramid to a ray: x and y at z = 1.
  void include(vec2 ray) {
    if (!all_finite(ray)) return;
    // Depth along the axis hardly limits the length of rays almost perpendicular to it: rays beyond 80 degrees are
    // treated as if they were at 80 degrees.
    constexpr double widest = 5.67;
    const double off_axis = norm(ray);
    if (off_axis > widest) ray *= widest / off_axis;
    for (std::size_t i = 0; i != sides; ++i) reach_[i] = std::max(reach_[i], dot(direction(i), ray));
  }
  /// Computes the corners: the intersections of neighbouring sides.
  void close() {
    for (std::size_t i = 0; i != sides; ++i) {
      const vec2 a = direction(i), b = direction(i + 1);
      const double of_a = reach_[i], of_b = reach_[(i + 1) % sides];
      const double sine = a.x() * b.y() - a.y() * b.x();
      corners_[i] = {(of_a * b.y() - of_b * a.y()) / sine, (a.x() * of_b - b.x() * of_a) / sine, 1.0};
      if (!all_finite(corners_[i])) corners_[i] = vec3(0.0, 0.0, 1.0);  // no ray was included
    }
  }

  std::array<double, sides> reach_ = [] {
    std::array<double, sides> none{};
    none.fill(-std::numeric_limits<double>::infinity());
    return none;
  }();
  std::array<vec3, sides> corners_;
};

/// The largest depth of an image, metres; 0 if no pixel is valid. O(pixels).
[[nodiscard]] inline double largest_depth(const camera::depth_view<std::uint16_t>& depth) {
  // Depth is monotonic in the stored value, so no division per pixel is needed to find the largest valid one.
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
