// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Triangulation: a point from the rays of two or more cameras with known poses.
///
/// Rays are in the camera frame, as cameras unproject pixels; errors are distances in the plane z = 1.
///
/// Sources: P. Lindstrom, "Triangulation made easy", CVPR 2010, for two views; R. Hartley, P. Sturm, "Triangulation",
/// CVIU 68 (1997), for the optimality criterion.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <ranges>
#include <span>
#include <string_view>

#include <Eigen/LU>

#include <orbis/core/se3.hpp>
#include <orbis/core/small_cholesky.hpp>

namespace orbis::optimize {

enum class triangulation_status {
  ok,
  too_few_views,  ///< fewer than two
  not_finite,     ///< a pose or a ray is not finite
  no_parallax,    ///< the rays are nearly parallel or start in one place: the depth is not determined
  behind_camera   ///< the rays meet behind a camera
};

/// The status in words.
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
  double min_parallax = 1e-4;  ///< smallest angle between rays, radians
};

struct triangulation {
  triangulation_status status = triangulation_status::too_few_views;
  vec3 point = zeros<vec3>();  ///< in the world frame, metres; valid only if `ok()`
  double parallax = 0.0;  ///< the angle between the rays (for more than two views between two distant ones), radians
  double error = 0.0;     ///< root mean square distance from the rays at z = 1
  [[nodiscard]] bool ok() const noexcept { return status == triangulation_status::ok; }
};

namespace detail {

[[nodiscard]] inline double angle_between_directions(const vec3& a, const vec3& b) {
  const double x = a.y() * b.z() - a.z() * b.y(), y = a.z() * b.x() - a.x() * b.z(), z = a.x() * b.y() - a.y() * b.x();
  return std::atan2(std::sqrt(x * x + y * y + z * z), a.x() * b.x() + a.y() * b.y() + a.z() * b.z());
}

/// The matrix E with `second^T E first = 0` for rays of one point: translation x rotation of `T_second_first`.
[[nodiscard]] mat3 essential_of(const se3& T_second_first);

}  // namespace detail

/// The point whose projections to z = 1 have the least sum of squared distances from the two rays. Constant time.
[[nodiscard]] triangulation triangulate(const se3& T_world_first, const vec3& first_ray, const se3& T_world_second,
                                        const vec3& second_ray, const triangulation_options& options = {});

/// The point whose projections to z = 1 have the least sum of squared distances from all rays: starts at the point
/// nearest to the rays and refines it by Levenberg-Marquardt. O(views) for each of a few steps.
/// `poses` are the cameras' `T_world_camera`. @pre poses and rays are as many
template <std::ranges::contiguous_range Poses, std::ranges::contiguous_range Rays>
requires std::same_as<std::ranges::range_value_t<Poses>, se3> && std::same_as<std::ranges::range_value_t<Rays>, vec3>
[[nodiscard]] triangulation triangulate(const Poses& poses, const Rays& directions,
                                        const triangulation_options& options = {}) {
  const std::span<const se3> T_world_camera{poses};
  const std::span<const vec3> rays{directions};
  assert(T_world_camera.size() == rays.size());
  triangulation out;
  const std::size_t n = rays.size();
  if (n < 2) return out;
  const auto direction = [&](std::size_t i) { return vec3(normalized(T_world_camera[i].rotation() * rays[i])); };
  // The point nearest to all rays, about their first camera for the sake of digits.
  const vec3 origin = T_world_camera[0].translation();
  mat3 a = zeros<mat3>();
  vec3 b = zeros<vec3>();
  double baseline = 0.0;
  out.status = triangulation_status::not_finite;
  for (std::size_t i = 0; i != n; ++i) {
    if (!all_finite(rays[i]) || rays[i].z() == 0.0 || !all_finite(T_world_camera[i].to_matrix())) return out;
    const vec3 d = direction(i);
    const mat3 across = identity<mat3>() - d * transposed(d);
    a += across;
    const vec3 from_origin = T_world_camera[i].translation() - origin;
    b += across * from_origin;
    baseline = std::max(baseline, norm(from_origin));
  }
  // Two rays that are far apart: the one farthest from the first, and the one farthest from that.
  const auto farthest_from = [&](std::size_t k) {
    std::size_t farthest = k;
    double angle = 0.0;
    for (std::size_t i = 0; i != n; ++i)
      if (const double to_i = detail::angle_between_directions(direction(k), direction(i)); to_i > angle) {
        angle = to_i;
        farthest = i;
      }
    out.parallax = std::max(out.parallax, angle);
    return farthest;
  };
  farthest_from(farthest_from(0));
  out.status = triangulation_status::no_parallax;
  if (!(out.parallax >= options.min_parallax) || !(baseline > 0.0)) return out;
  small_cholesky<3> factors;
  if (!factors.set(a) || !(factors.factor(0.0) > 0.0)) return out;
  vec3 point = factors.solve(b);
  if (!all_finite(point)) return out;

  const auto error_at = [&](const vec3& p, mat3* h, vec3* g) {
    double sum = 0.0;
    for (std::size_t i = 0; i != n; ++i) {
      const vec3 seen = T_world_camera[i].rotation().inverse() * vec3(p + (origin - T_world_camera[i].translation()));
      const double inverse_z = 1.0 / seen.z();
      const vec2 xy = head<2>(seen) * inverse_z;
      const vec2 r = xy - vec2(rays[i].x() / rays[i].z(), rays[i].y() / rays[i].z());
      sum += squared_norm(r);
      if (h == nullptr) continue;
      matrix<2, 3> j;
      j << inverse_z, 0.0, -xy.x() * inverse_z, 0.0, inverse_z, -xy.y() * inverse_z;
      j = (j * transposed(T_world_camera[i].rotation_matrix())).eval();
      *h += transposed(j) * j;
      *g += transposed(j) * r;
    }
    return sum;
  };
  double lambda = 1e-6;
  double error = error_at(point, nullptr, nullptr);
  for (int k = 0; k != 20; ++k) {
    mat3 h = zeros<mat3>();
    vec3 g = zeros<vec3>();
    error_at(point, &h, &g);
    if (!factors.set(h)) break;
    bool better = false;
    double gain = 0.0;
    for (int attempt = 0; attempt != 6 && !better; ++attempt, lambda *= better ? 0.1 : 10.0) {
      if (!(factors.factor(lambda) > 0.0)) continue;
      const vec3 next = point - factors.solve(g);
      const double at_next = error_at(next, nullptr, nullptr);
      better = at_next < error;
      if (!better) continue;
      gain = error - at_next;
      point = next;
      error = at_next;
    }
    if (!better || gain <= 1e-15 * error) break;
  }
  out.point = origin + point;
  out.error = std::sqrt(error / static_cast<double>(n));
  if (!all_finite(out.point)) return out;
  out.status = triangulation_status::ok;
  for (std::size_t i = 0; i != n; ++i) {
    const vec3 seen = T_world_camera[i].rotation().inverse() * vec3(point + (origin - T_world_camera[i].translation()));
    if (!(seen.z() > 0.0)) out.status = triangulation_status::behind_camera;
  }
  return out;
}

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/detail/compiled/triangulation_functions.hpp>
#endif
