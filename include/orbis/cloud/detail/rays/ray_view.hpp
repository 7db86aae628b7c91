// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A posed depth image in the form that `ray_evidence.hpp` uses, and a test for blocks of points for which the image
/// provides no evidence.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <optional>

#include <orbis/camera/model.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/cloud/detail/rays/depth_windows.hpp>
#include <orbis/cloud/detail/rays/point_blocks.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud::detail {

/// Parameters of a view in the form that the kernels use.
struct ray_view {
  std::array<std::array<float, 3>, 3> rotation{};  ///< R_camera_world, row by row
  std::array<float, 3> origin{};                   ///< camera position in the world frame, metres, rounded to float
  std::array<float, 3> origin_rest{};              ///< rounding error of `origin`, whose coordinates may be large
  float fx = 0, fy = 0, cx = 0, cy = 0;            ///< pinhole parameters; cx and cy include an additional half pixel
  int width = 0;
  int height = 0;
  float min_depth = 0;  ///< exclusive lower limit of the depth of tested points, metres
  float max_depth = 0;
  float margin = 0;  ///< margin + margin_growth z^2, metres
  float margin_growth = 0;
  float slant = 0;  ///< fraction of a window's depth range added to the margin of rays that pass through
  const float* nearest = nullptr;
  const float* farthest = nullptr;
  const float* middle = nullptr;
};

/// Sets all members except those of the camera and the windows. @pre the pose is finite
inline void place(ray_view& view, const se3& T_world_camera) {
  const mat3 rotation = T_world_camera.rotation_matrix();
  for (std::size_t a = 0; a != 3; ++a) {
    const auto row = static_cast<Eigen::Index>(a);
    for (std::size_t b = 0; b != 3; ++b)
      view.rotation[a][b] = static_cast<float>(rotation(static_cast<Eigen::Index>(b), row));
    view.origin[a] = static_cast<float>(T_world_camera.translation()[row]);
    view.origin_rest[a] = static_cast<float>(T_world_camera.translation()[row] - double{view.origin[a]});
  }
}

/// Upper bound on the angle between the optical axis and the ray farthest from it, radians; empty if unknown.
template <camera::camera_model Camera>
[[nodiscard]] std::optional<double> view_angle(const Camera& camera) {
  constexpr int steps = 32;
  double angle = 0;
  for (int j = 0; j <= steps; ++j) {
    for (int i = 0; i <= steps; ++i) {
      const auto ray = camera.unproject({-0.5 + camera.width() * (i / double{steps}),  //
                                         -0.5 + camera.height() * (j / double{steps})});
      if (!ray || !ray->allFinite()) return std::nullopt;
      angle = std::max(angle, std::atan2(norm(ray->template head<2>()), ray->z()));
    }
  }
  return 1.02 * angle + 0.02;
}

/// Uses bounding boxes to find blocks of points for which a view has no evidence. Conservative: may miss some of
/// these blocks.
template <camera::camera_model Camera>
class block_test {
 public:
  explicit block_test(const Camera& camera) : camera_{&camera} {
    if constexpr (!std::same_as<Camera, camera::pinhole>) angle_ = view_angle(camera);
  }

  /// Sets the view for the following tests. @pre the pose is finite
  void place(const se3& T_world_camera, const ray_view& view, const depth_windows& windows) {
    rotation_ = transposed(T_world_camera.rotation_matrix());
    absolute_ = magnitudes(rotation_);
    origin_ = T_world_camera.translation();
    view_ = &view;
    windows_ = &windows;
  }

  [[nodiscard]] bool says_nothing(const point_blocks::box& box) const {
    vec3 middle;
    vec3 half;
    for (Eigen::Index a = 0; a != 3; ++a) {
      const double low = box.low[static_cast<std::size_t>(a)];
      const double high = box.high[static_cast<std::size_t>(a)];
      middle[a] = 0.5 * (low + high);
      half[a] = 0.5 * (high - low);
    }
    const vec3 c = rotation_ * (middle - origin_);
    // The kernels' rounding error is about 1e-6 of the distance.
    const double slack = 1e-5 * (norm(c) + norm(half));
    if constexpr (std::same_as<Camera, camera::pinhole>) {
      const vec3 h = absolute_ * half + filled<vec3>(slack);
      return pinhole_says_nothing(c - h, c + h);
    } else {
      if (!angle_) return false;
      const double radius = norm(half) + slack;
      const double distance = norm(c);
      if (distance <= radius) return false;
      return std::atan2(norm(head<2>(c)), c.z()) - std::asin(radius / distance) > *angle_;
    }
  }

 private:
  [[nodiscard]] bool pinhole_says_nothing(const vec3& low, const vec3& high) const {
    if (!(high.z() > double{view_->min_depth}) || low.z() > double{view_->max_depth}) return true;
    if (!(low.z() > 1e-3)) return false;
    const camera::intrinsics& k = camera_->k();
    const auto pixels = [&](double from, double to, double focal, double center) {
      const double least = focal * (from / (from < 0 ? low.z() : high.z())) + center;
      const double most = focal * (to / (to < 0 ? high.z() : low.z())) + center;
      return std::array{least - 0.55 - 1e-5 * std::abs(least), most + 0.55 + 1e-5 * std::abs(most)};
    };
    const auto [left, right] = pixels(low.x(), high.x(), k.fx, k.cx);
    const auto [top, bottom] = pixels(low.y(), high.y(), k.fy, k.cy);
    if (right < 0 || bottom < 0 || left > k.width - 1 || top > k.height - 1) return true;
    // Skip the block if all depths around it are nearer than the block.
    const auto tile_of = [](double pixel, int size) {
      return static_cast<int>(std::clamp(pixel, 0.0, size - 1.0)) / depth_windows::tile;
    };
    const int x0 = tile_of(left, k.width), x1 = tile_of(std::ceil(right), k.width);
    const int y0 = tile_of(top, k.height), y1 = tile_of(std::ceil(bottom), k.height);
    constexpr int worth_it = 64;
    if ((x1 - x0 + 1) * (y1 - y0 + 1) > worth_it) return false;
    const double margin = double{view_->margin} + double{view_->margin_growth} * high.z() * high.z();
    return double{windows_->farthest_of_tiles(x0, y0, x1, y1)} < low.z() - 1.001 * margin;
  }

  const Camera* camera_;
  std::optional<double> angle_;
  mat3 rotation_;  ///< R_camera_world
  mat3 absolute_;
  vec3 origin_;
  const ray_view* view_ = nullptr;
  const depth_windows* windows_ = nullptr;
};

}  // namespace orbis::cloud::detail
