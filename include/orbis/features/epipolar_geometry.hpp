// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Epipolar lines: the loci of a keypoint's matches for a known relative pose of two images.
#pragma once

#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>

namespace orbis::features {

/// A line `a x + b y + c = 0` with `a^2 + b^2 = 1`: the left-hand side is the signed distance of a point.
struct epipolar_line {
  float a = 0.0F, b = 0.0F, c = 0.0F;
};

/// Epipolar geometry for the keypoints of two images:
///
/// - `line(i, k)`: the line in the train image for query `i` with keypoint `k`, or empty;
/// - `point(i, k)`: position of train keypoint `k` (index `i`), pixels; NaN if it has none;
/// - `epipole()`: intersection of all lines in the train image, or empty.
///
/// Lines and points share a plane, which need not be the image plane.
template <class G>
concept epipolar_geometry = requires(const G& geometry, std::size_t i, const keypoint& k) {
  { geometry.line(i, k) } -> std::same_as<std::optional<epipolar_line>>;
  { geometry.point(i, k) } -> std::same_as<vec2f>;
  { geometry.epipole() } -> std::same_as<std::optional<vec2f>>;
};

/// Converts a homogeneous vector to a line; empty if it is degenerate.
[[nodiscard]] inline std::optional<epipolar_line> to_line(const vec3& l) noexcept {
  const double norm = std::hypot(l.x(), l.y());
  if (!(norm > 0.0) || !std::isfinite(norm) || !std::isfinite(l.z())) return std::nullopt;
  return epipolar_line{static_cast<float>(l.x() / norm), static_cast<float>(l.y() / norm),
                       static_cast<float>(l.z() / norm)};
}

/// Converts a homogeneous vector to a pixel; empty if it is at infinity.
[[nodiscard]] inline std::optional<vec2f> to_pixel(const vec3& p) noexcept {
  if (!(std::abs(p.z()) > 1e-12 * norm(p))) return std::nullopt;
  return vec2f{static_cast<float>(p.x() / p.z()), static_cast<float>(p.y() / p.z())};
}

/// Epipolar geometry of two images from any central cameras, based on the rays through their keypoints. Lines and
/// points are in the plane z = 1 of the train camera, in pixels of a pinhole camera with the given focal length. Refers
/// to the rays, which must outlive it; a ray that is NaN, or does not point forward, has no match.
class ray_geometry {
 public:
  /// @pre one ray per keypoint on each side; focal > 0 (pixels)
  ray_geometry(std::span<const vec3> query_rays, std::span<const vec3> train_rays, const se3& T_train_query,
               double focal)
      : query_rays_{query_rays},
        train_rays_{train_rays},
        E_{hat(T_train_query.translation()) * T_train_query.rotation_matrix()},
        centre_{T_train_query.translation()},
        focal_{focal} {
    assert(focal > 0.0);
  }

  [[nodiscard]] std::optional<epipolar_line> line(std::size_t i, const keypoint&) const noexcept {
    const vec3 l = E_ * query_rays_[i];
    return to_line({l.x(), l.y(), focal_ * l.z()});
  }
  [[nodiscard]] vec2f point(std::size_t i, const keypoint&) const noexcept {
    const vec3& r = train_rays_[i];
    if (!(r.z() > 0.0)) return filled<vec2f>(std::numeric_limits<float>::quiet_NaN());
    return {static_cast<float>(focal_ * r.x() / r.z()), static_cast<float>(focal_ * r.y() / r.z())};
  }
  [[nodiscard]] std::optional<vec2f> epipole() const noexcept {
    return to_pixel({focal_ * centre_.x(), focal_ * centre_.y(), centre_.z()});
  }

 private:
  std::span<const vec3> query_rays_, train_rays_;
  mat3 E_;
  vec3 centre_;
  double focal_;
};

static_assert(epipolar_geometry<ray_geometry>);

}  // namespace orbis::features
