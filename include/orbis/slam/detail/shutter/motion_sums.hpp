// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sums of the normal equations of a camera motion over observed points.
#pragma once

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::slam::detail {

/// The sum of `w J^T J` over points `q` in the camera frame. `J = [B, -B hat(q)]` is the derivative of a residual with
/// respect to a motion of that frame (`exp(step) * q`), and `B` that with respect to the point.
struct motion_sums {
  mat3 translation = zeros<mat3>();  ///< w B^T B
  mat3 mixed = zeros<mat3>();        ///< w B^T B hat(q)
  mat3 rotation = zeros<mat3>();     ///< w hat(q)^T B^T B hat(q)

  /// The terms of one point. `information`: `w B^T B`.
  [[nodiscard]] static motion_sums of_point(const mat3& information, const vec3& q) {
    const mat3 turn = hat<double>(q), mixed = information * turn;
    return {information, mixed, mat3(-turn * mixed)};
  }
  motion_sums& operator+=(const motion_sums& other) {
    translation += other.translation, mixed += other.mixed, rotation += other.rotation;
    return *this;
  }
  motion_sums& operator*=(double factor) {
    translation *= factor, mixed *= factor, rotation *= factor;
    return *this;
  }
  [[nodiscard]] mat6 matrix() const {
    mat6 out;
    set_block(out, 0, 0, translation);
    set_block(out, 0, 3, mat3(-mixed));
    set_block(out, 3, 0, mat3(-transposed(mixed)));
    set_block(out, 3, 3, rotation);
    return out;
  }
};

/// The gradient `w J^T r` for the `J` of `motion_sums`. `by_point`: `w B^T r`.
[[nodiscard]] inline vec6 by_motion(const vec3& by_point, const vec3& q) {
  return stacked(by_point, cross(q, by_point));
}

}  // namespace orbis::slam::detail
