// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment problems in the form of "Bundle Adjustment in the Large".
///
/// A camera consists of an angle-axis rotation R, a translation t, a focal length f and two coefficients of radial
/// distortion k1, k2. It projects X to -f (1 + k1 r^2 + k2 r^4) d with p = R X + t, d = (p.x, p.y) / p.z and r = |d|.
/// The camera looks along its negative z axis; pixel coordinates are relative to the centre of the image, y upwards.
///
/// Source: S. Agarwal, N. Snavely, S. M. Seitz, R. Szeliski, "Bundle adjustment in the large", ECCV 2010,
/// and https://grail.cs.washington.edu/projects/bal.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::io {

/// Observation of the point `point` by the camera `camera`; both are indices.
struct bal_observation {
  std::uint32_t camera = 0;
  std::uint32_t point = 0;
  vec2 pixel = zeros<vec2>();  ///< relative to the centre of the image, y upwards
};

/// Cameras, points and observations.
struct bal_problem {
  std::vector<std::array<double, 9>> cameras;  ///< rotation (angle-axis, radians), translation, f, k1, k2
  std::vector<vec3> points;                    ///< in the world frame, in the file's unit of length
  std::vector<bal_observation> observations;   ///< in the file's order
};

/// Projects a point by a camera of this format; empty if the point lies in the camera's plane z = 0, or if the result
/// is not finite. Points behind the camera are projected too, as in the residuals of the paper.
[[nodiscard]] inline std::optional<vec2> project_bal(std::span<const double, 9> camera, const vec3& point) {
  const vec3 p = so3::exp(vec3(camera[0], camera[1], camera[2])) * point + vec3(camera[3], camera[4], camera[5]);
  const vec2 d = head<2>(p) / p.z();
  const double r2 = squared_norm(d);
  const vec2 pixel = -camera[6] * (1.0 + r2 * (camera[7] + r2 * camera[8])) * d;
  if (!all_finite(pixel)) return std::nullopt;
  return pixel;
}

}  // namespace orbis::io
