// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The viewpoint, which rotates about a target that follows the camera.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace app {

class orbit {
 public:
  bool follows = true;

  /// Follows the camera; the first pose places the viewpoint behind the camera. `seconds`: time since the last call.
  void follow(const orbis::se3& T_world_camera, double seconds) {
    const orbis::vec3 goal = T_world_camera * orbis::vec3{0.0, 0.0, 1.0};
    if (!is_placed_) {
      is_placed_ = true;
      target_ = goal;
      const orbis::vec3 forward = T_world_camera.rotation() * orbis::vec3::UnitZ();
      yaw_ =
          std::atan2(-forward.y(), -forward.x()) + 0.35;  // slightly to the side, so that the frustum is recognisable
    } else if (follows) {
      target_ += (1.0 - std::exp(-4.0 * seconds)) * (goal - target_);
    }
  }
  void turn(double dx_pixels, double dy_pixels) {
    yaw_ -= 0.006 * dx_pixels;
    pitch_ = std::clamp(pitch_ + 0.006 * dy_pixels, -1.55, 1.55);
  }
  /// Pans so that the point at the target follows the mouse. `height`: height of the view in pixels.
  void pan(double dx_pixels, double dy_pixels, double height) {
    const double metres = distance_ * 2.0 * std::tan(0.5 * field_of_view) / height;
    const frame_axes a = axes();
    target_ -= metres * (dx_pixels * a.right - dy_pixels * a.up);
    follows = false;
  }
  void zoom(double by) { distance_ = std::clamp(distance_ * by, 0.3, 500.0); }

  [[nodiscard]] double distance() const { return distance_; }
  [[nodiscard]] orbis::vec3 position() const { return target_ + distance_ * axes().back; }
  [[nodiscard]] orbis::vec3 forward() const { return -axes().back; }
  /// The transform from world to clip coordinates in OpenGL's convention. `aspect`: width / height.
  [[nodiscard]] Eigen::Matrix4f clip_from_world(double aspect) const {
    const frame_axes a = axes();
    const orbis::vec3 at = position();
    Eigen::Matrix4d view = Eigen::Matrix4d::Identity();
    view.row(0) << a.right.transpose(), -a.right.dot(at);
    view.row(1) << a.up.transpose(), -a.up.dot(at);
    view.row(2) << a.back.transpose(), -a.back.dot(at);
    const double f = 1.0 / std::tan(0.5 * field_of_view), near = 0.02 * distance_, far = 200.0 + 4.0 * distance_;
    Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
    clip(0, 0) = f / aspect;
    clip(1, 1) = f;
    clip(2, 2) = (far + near) / (near - far);
    clip(2, 3) = 2.0 * far * near / (near - far);
    clip(3, 2) = -1.0;
    return (clip * view).cast<float>();
  }

 private:
  static constexpr double field_of_view = 2.0 * std::numbers::pi / 7.0;
  struct frame_axes {
    orbis::vec3 back, right, up;
  };
  [[nodiscard]] frame_axes axes() const {
    const orbis::vec3 back{std::cos(pitch_) * std::cos(yaw_), std::cos(pitch_) * std::sin(yaw_), std::sin(pitch_)};
    const orbis::vec3 right = orbis::vec3::UnitZ().cross(back).normalized();
    return {back, right, back.cross(right)};
  }

  orbis::vec3 target_ = orbis::vec3::Zero();
  double yaw_ = std::numbers::pi, pitch_ = 0.7, distance_ = 5.5;
  bool is_placed_ = false;
};

}  // namespace app
