// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Points of a depth image in the world frame.
#pragma once

#include <any>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <utility>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/camera/world_point.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::octree {

/// Rays of a camera's pixels, as in camera::ray_table, with x and y stored separately. For a pinhole camera, x depends
/// only on the column and y only on the row, so no table is needed. Reuse one object for all frames of the same camera.
class pixel_rays {
 public:
  static constexpr int padding = 16;  ///< readable values after the end of a row

  /// Sets the rays to those of `camera`; does nothing if `camera` compares equal (`==`) to the current camera.
  template <camera::camera_model Camera>
  void fit(const Camera& camera) {
    if constexpr (std::same_as<Camera, camera::any_camera>) {
      camera.visit([&](const auto& model) { fit(model); });
    } else {
      [[maybe_unused]] Camera* last = nullptr;
      if constexpr (std::regular<Camera>) {
        last = std::any_cast<Camera>(&camera_);
        if (last != nullptr && *last == camera) return;
      }
      width_ = static_cast<int>(camera.width());
      height_ = static_cast<int>(camera.height());
      separable_ = std::same_as<Camera, camera::pinhole>;
      ++version_;
      tabulate(camera);
      if constexpr (std::regular<Camera>) {
        if (last != nullptr)
          *last = camera;  // in place, without allocation
        else
          camera_ = camera;
      }
    }
  }

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  /// Returns true if x depends only on the column and y only on the row.
  [[nodiscard]] bool separable() const noexcept { return separable_; }
  /// Version number; changes with the rays.
  [[nodiscard]] unsigned version() const noexcept { return version_; }
  /// Focal length of the approximate projection: the pixel of a ray is about `focal * (x, y) + center`; exact if
  /// separable.
  [[nodiscard]] const vec2& focal() const noexcept { return focal_; }
  [[nodiscard]] const vec2& center() const noexcept { return center_; }
  /// Returns the x components of the rays of row `v`, one per column; NaN where a pixel has no ray.
  [[nodiscard]] const float* x(int v) const noexcept { return x_.data() + (separable_ ? 0 : row(v)); }
  /// Returns the y components of the rays of row `v`; a single value if separable.
  [[nodiscard]] const float* y(int v) const noexcept { return y_.data() + (separable_ ? v : row(v)); }
  [[nodiscard]] std::pair<float, float> at(int u, int v) const noexcept { return {x(v)[u], y(v)[separable_ ? 0 : u]}; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return (x_.capacity() + y_.capacity()) * sizeof(float); }

 private:
  [[nodiscard]] std::ptrdiff_t row(int v) const noexcept {
    return static_cast<std::ptrdiff_t>(v) * (static_cast<std::ptrdiff_t>(width_) + padding);
  }
  void tabulate(const camera::pinhole& camera) {
    x_.assign(static_cast<std::size_t>(width_ + padding), 0.0F);
    y_.assign(static_cast<std::size_t>(height_ + padding), 0.0F);
    focal_ = {camera.k().fx, camera.k().fy};
    center_ = {camera.k().cx, camera.k().cy};
    for (int u = 0; u != width_; ++u)
      x_[static_cast<std::size_t>(u)] = static_cast<float>((u - camera.k().cx) / camera.k().fx);
    for (int v = 0; v != height_; ++v)
      y_[static_cast<std::size_t>(v)] = static_cast<float>((v - camera.k().cy) / camera.k().fy);
  }
  template <class Camera>
  void tabulate(const Camera& camera) {
    const auto size = static_cast<std::size_t>(row(height_)) + padding;
    x_.assign(size, 0.0F);
    y_.assign(size, 0.0F);
    camera::for_each_ray(camera, [&](int u, int v, const vec2& ray) {
      const auto i = static_cast<std::size_t>(row(v) + u);
      x_[i] = static_cast<float>(ray.x());
      y_[i] = static_cast<float>(ray.y());
    });
  }

  std::vector<float> x_, y_;
  std::any camera_;
  vec2 focal_ = filled<vec2>(1), center_ = zeros<vec2>();
  int width_ = 0;
  int height_ = 0;
  unsigned version_ = 0;
  bool separable_ = false;
};

/// Appends to `points` the world points (metres) of all pixels of `depth` that have a measurement and a valid ray, row
/// by row.
/// @pre depth and camera have the same size
template <camera::depth_source Depth>
void append_world_points(const Depth& depth, const pixel_rays& rays, const se3& T_world_camera,
                         std::vector<vec3f>& points) {
  assert(static_cast<int>(depth.width()) == rays.width() && static_cast<int>(depth.height()) == rays.height());
  const camera::float_pose pose{T_world_camera};
  for (int v = 0; v < rays.height(); ++v)
    for (int u = 0; u < rays.width(); ++u) {
      const float z = depth(u, v);
      const auto [x, y] = rays.at(u, v);
      if (!(z > 0.0F) || std::isnan(x)) continue;
      const auto p = camera::world_point(pose, x, y, z);
      points.emplace_back(p[0], p[1], p[2]);
    }
}
/// Like the overload with pixel_rays, but computes the camera's rays in every call; with lens distortion this takes
/// longer than computing the points. For several images, reuse a pixel_rays object.
template <camera::depth_source Depth, camera::camera_model Camera>
void append_world_points(const Depth& depth, const Camera& camera, const se3& T_world_camera,
                         std::vector<vec3f>& points) {
  pixel_rays rays;
  rays.fit(camera);
  append_world_points(depth, rays, T_world_camera, points);
}

}  // namespace orbis::octree
