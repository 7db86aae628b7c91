// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Epipolar lines of two pinhole images: another geometry than that of rays, for tests and benchmarks.
#pragma once

#include <cstddef>
#include <optional>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/epipolar_geometry.hpp>

namespace orbis::test {

/// Two pinhole images, by their fundamental matrix: `x_train^T F x_query = 0` for matching pixels.
class fundamental_geometry {
 public:
  explicit fundamental_geometry(const mat3& F) : F_{F} {
    // The epipole is orthogonal to every column; the two that span most give it best.
    for (int i = 0; i != 3; ++i) {
      const vec3 normal = cross(column_of(F, i), column_of(F, (i + 1) % 3));
      if (norm(normal) > norm(epipole_)) epipole_ = normal;
    }
  }
  /// From the intrinsic matrices (pixels) and the pose of the query's camera in the train's.
  fundamental_geometry(const mat3& K_query, const mat3& K_train, const se3& T_train_query)
      : fundamental_geometry{transposed(inverse(K_train)) * essential(T_train_query) * inverse(K_query)} {}

  [[nodiscard]] std::optional<features::epipolar_line> line(std::size_t, const features::keypoint& k) const noexcept {
    return features::to_line(F_ * vec3{k.x, k.y, 1.0});
  }
  [[nodiscard]] vec2f point(std::size_t, const features::keypoint& k) const noexcept { return {k.x, k.y}; }
  [[nodiscard]] std::optional<vec2f> epipole() const noexcept { return features::to_pixel(epipole_); }
  [[nodiscard]] const mat3& matrix() const noexcept { return F_; }

  /// `[t]x R`: `r_train^T E r_query = 0` for the rays of matching keypoints.
  [[nodiscard]] static mat3 essential(const se3& T_train_query) {
    return hat(T_train_query.translation()) * T_train_query.rotation_matrix();
  }

 private:
  mat3 F_;
  vec3 epipole_ = zeros<vec3>();
};
static_assert(features::epipolar_geometry<fundamental_geometry>);

/// Intrinsic matrices of two cameras, pixels.
inline const mat3 K1 = (mat3{} << 500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0).finished();
inline const mat3 K2 = (mat3{} << 450.0, 0.0, 310.0, 0.0, 455.0, 250.0, 0.0, 0.0, 1.0).finished();
/// Poses of the second camera: it looks sideways at what the first sees, or goes straight ahead.
inline se3 sideways() { return {so3::exp(vec3{0.05, -0.2, 0.1}), vec3{0.4, 0.05, 0.1}}; }
inline se3 ahead() { return {so3{}, vec3{0.02, 0.01, -0.5}}; }
inline vec3 pixel(const mat3& K, const vec3& p) { return K * p / p.z(); }

}  // namespace orbis::test
