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

}  // namespace orbis::test
