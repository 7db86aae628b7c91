// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Triangulation of a point from the rays of two or more cameras with known poses.
///
/// Rays are in the camera frame, as returned by `unproject`; errors are distances in the plane z = 1.
///
/// Sources: P. Lindstrom, "Triangulation made easy", CVPR 2010, for two views; R. Hartley, P. Sturm, "Triangulation",
/// CVIU 68 (1997), for the optimality criterion.
#pragma once

#include <cmath>
#include <concepts>
#include <ranges>
#include <span>
#include <string_view>

#include <orbis/core/inline.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::optimize {

enum class triangulation_status {
  ok,
  too_few_views,  ///< fewer than two views
  not_finite,     ///< a pose or a ray is not finite
  no_parallax,    ///< the rays are nearly parallel or start at the same point: the depth is not determined
  behind_camera   ///< the rays intersect behind a camera
};

/// Returns the status as text.
[[nodiscard]] constexpr std::string_view to_string(triangulation_status status) noexcept {
  switch (status) {
    case triangulation_status::ok: return "ok";
    case triangulation_status::too_few_views: return "too few views";
    case triangulation_status::not_finite: return "not finite";
    case triangulation_status::no_parallax: return "no parallax";
    case triangulation_status::behind_camera: return "behind a camera";
  }
  return "unknown";
}

struct triangulation_options {
  double min_parallax = 1e-4;  ///< minimum angle between rays, radians
};

struct triangulation {
  triangulation_status status = triangulation_status::too_few_views;
  vec3 point = zeros<vec3>();  ///< in the world frame, metres; valid only if `ok()`
  double parallax = 0.0;       ///< angle between the rays, radians; with more than two views, between two distant rays
  double error = 0.0;          ///< root mean square distance between projections and rays at z = 1
  [[nodiscard]] bool ok() const noexcept { return status == triangulation_status::ok; }
};

namespace detail {

[[nodiscard]] inline double angle_between_directions(const vec3& a, const vec3& b) {
  const double x = a.y() * b.z() - a.z() * b.y(), y = a.z() * b.x() - a.x() * b.z(), z = a.x() * b.y() - a.y() * b.x();
  return std::atan2(std::sqrt(x * x + y * y + z * z), a.x() * b.x() + a.y() * b.y() + a.z() * b.z());
}

/// Returns the matrix E with `second^T E first = 0` for two rays to the same point: [t]x R of `T_second_first`.
ORBIS_LAZY [[nodiscard]] mat3 essential_matrix(const se3& T_second_first);

/// Implements `triangulate` for any number of rays.
template <class S>
[[nodiscard]] triangulation triangulate_all(std::span<const basic_se3<S>> T_world_camera,
                                            std::span<const matrix<3, 1, S>> rays,
                                            const triangulation_options& options);

}  // namespace detail

/// Returns the point whose projections to z = 1 have the smallest sum of squared distances from the two rays. O(1).
[[nodiscard]] triangulation triangulate(const se3& T_world_first, const vec3& first_ray, const se3& T_world_second,
                                        const vec3& second_ray, const triangulation_options& options = {});

/// Returns the point whose projections to z = 1 have the smallest sum of squared distances from all rays. Starts at the
/// point nearest to the rays and refines it with a few Levenberg-Marquardt steps. O(views) per step. `poses` are the
/// cameras' `T_world_camera`. @pre poses.size() == directions.size()
template <std::ranges::contiguous_range Poses, std::ranges::contiguous_range Rays>
requires std::same_as<std::ranges::range_value_t<Poses>, se3> && std::same_as<std::ranges::range_value_t<Rays>, vec3>
[[nodiscard]] triangulation triangulate(const Poses& poses, const Rays& directions,
                                        const triangulation_options& options = {}) {
  return detail::triangulate_all<double>(std::span<const se3>{poses}, std::span<const vec3>{directions}, options);
}

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/triangulation-inl.hpp>
#endif
