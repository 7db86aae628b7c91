// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Matches between known points and pixels, converted for PnP.
///
/// A pixel is stored as the point (x, y) of its ray at z = 1, and the derivative of the pixel with respect to that
/// point, made upper triangular by a rotation. The error in pixels is this matrix times the difference at z = 1: exact
/// without distortion, and correct to first order with distortion, which is sufficient to rank poses. The loops over
/// the matches are therefore independent of the camera type.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>

namespace orbis::optimize::detail {

/// The transform from the world frame, with its origin moved to the centre of the points, to the camera frame.
struct centred_pose {
  mat3 rotation = identity<mat3>();
  vec3 translation = zeros<vec3>();
};

/// Number of coordinates of a match, each in a separate list: X, Y, Z, x, y and the three entries of the derivative.
inline constexpr std::size_t match_coordinates = 8;

/// The usable matches between two lists, in an order that depends only on the seed.
struct pnp_matches {
  std::vector<std::uint32_t> original;  ///< index of the match in the caller's lists
  std::vector<vec3> points;             ///< points relative to their centre
  std::vector<vec3> rays;               ///< unit vectors
  std::vector<double> columns;          ///< eight lists, `stride` apart
  std::vector<float> float_columns;     ///< the same values as float
  std::vector<double> gathered;         ///< contiguous copies of the matches in a refinement
  std::size_t stride = 0;               ///< size, rounded up to whole blocks
  vec3 centre = zeros<vec3>();

  [[nodiscard]] std::size_t size() const noexcept { return original.size(); }

  /// Reads the matches, except those that are not finite or cannot be unprojected. @pre the spans have the same length
  template <camera::camera_model Camera>
  void assign(std::span<const vec3> points_world, std::span<const vec2> pixels, const Camera& camera,
              std::uint64_t seed) {
    original.clear();
    original.reserve(points_world.size());
    for (std::size_t i = 0; i != points_world.size(); ++i)
      if (all_finite(points_world[i]) && all_finite(pixels[i])) original.push_back(static_cast<std::uint32_t>(i));
    random_bits random(mix64(seed));
    shuffle(original, random);

    stride = (original.size() + 31) / 32 * 32;
    columns.assign(match_coordinates * stride, std::numeric_limits<double>::quiet_NaN());
    points.clear();
    rays.clear();
    points.reserve(original.size());
    rays.reserve(original.size());
    centre = zeros<vec3>();
    std::size_t kept = 0;
    for (const std::uint32_t i : original) {
      matrix<2, 3> by_point;
      const auto ray = camera.unproject(pixels[i]);
      if (!ray || !camera.project(*ray, by_point)) continue;
      // Compute R of the QR decomposition of the derivative with respect to x and y.
      const double length = std::hypot(by_point(0, 0), by_point(1, 0));
      const double along = (by_point(0, 0) * by_point(0, 1) + by_point(1, 0) * by_point(1, 1)) / length;
      const double across = (by_point(0, 0) * by_point(1, 1) - by_point(1, 0) * by_point(0, 1)) / length;
      if (!(length > 0.0) || !std::isfinite(along + across)) continue;
      const double values[] = {ray->x(), ray->y(), length, along, across};
      for (std::size_t k = 0; k != 5; ++k) columns[(3 + k) * stride + kept] = values[k];
      original[kept++] = i;
      points.push_back(points_world[i]);
      rays.push_back(normalized(*ray));
      centre += points_world[i];
    }
    original.resize(kept);
    if (kept != 0) centre /= static_cast<double>(kept);
    for (std::size_t i = 0; i != kept; ++i) {
      points[i] -= centre;
      for (std::size_t k = 0; k != 3; ++k) columns[k * stride + i] = points[i][static_cast<Eigen::Index>(k)];
    }
    float_columns.resize(columns.size());
    for (std::size_t k = 0; k != columns.size(); ++k) float_columns[k] = static_cast<float>(columns[k]);
  }
};

}  // namespace orbis::optimize::detail
