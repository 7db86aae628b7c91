// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of triangulation.hpp: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/optimize_two_view.cpp.
#pragma once

#include <cmath>

#include <orbis/core/compiled_once.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/triangulation.hpp>

namespace orbis::optimize {

namespace detail {

ORBIS_COMPILED_ONCE mat3 essential_of(const se3& T_second_first) {
  return hat<double>(T_second_first.translation()) * T_second_first.rotation_matrix();
}

/// Moves two rays at z = 1 by the least sum of squares so that they meet. Two steps, after which nothing changes.
ORBIS_COMPILED_ONCE void make_rays_meet(const mat3& essential, vec3& first, vec3& second) {
  // `second` is x and `first` is x' in the paper.
  const mat2 e = essential.template topLeftCorner<2, 2>();
  vec2 n = (essential * first).template head<2>(), m = (essential.transpose() * second).template head<2>();
  const double a = n.dot(e * m), b = 0.5 * (n.squaredNorm() + m.squaredNorm());
  const double c = second.dot(essential * first);
  const double d = std::sqrt(std::fmax(0.0, b * b - a * c));
  if (!(b + d > 0.0)) return;  // along the baseline: they meet anyway
  double lambda = c / (b + d);
  const vec2 moved_second = lambda * n, moved_first = lambda * m;
  n -= e * moved_first;
  m -= e.transpose() * moved_second;
  const double size = n.squaredNorm() + m.squaredNorm();
  if (!(size > 0.0)) return;
  lambda *= 2.0 * d / size;
  second.template head<2>() -= lambda * n;
  first.template head<2>() -= lambda * m;
}

}  // namespace detail

ORBIS_COMPILED_ONCE triangulation triangulate(const se3& T_world_first, const vec3& first_ray,
                                              const se3& T_world_second, const vec3& second_ray,
                                              const triangulation_options& options) {
  triangulation out;
  const se3 T_second_first = T_world_second.inverse() * T_world_first;
  const vec3 seen_first = vec3(first_ray) / first_ray.z(), seen_second = vec3(second_ray) / second_ray.z();
  vec3 first = seen_first, second = seen_second;
  if (!first.allFinite() || !second.allFinite() || !T_second_first.to_matrix().allFinite()) {
    out.status = triangulation_status::not_finite;
    return out;
  }
  out.parallax = detail::angle_between_directions(T_second_first.rotation() * first, second);
  out.status = triangulation_status::no_parallax;
  if (!(out.parallax >= options.min_parallax)) return out;
  detail::make_rays_meet(detail::essential_of(T_second_first), first, second);
  // In the second camera: t + depth_1 u = depth_2 v.
  const vec3 u = T_second_first.rotation() * first;
  const vec3& t = T_second_first.translation();
  const vec3 normal = u.cross(second);
  const double size = normal.squaredNorm();
  if (!(size > 0.0) || !(t.squaredNorm() > 0.0)) return out;
  const double first_depth = second.cross(t).dot(normal) / size;
  const double second_depth = u.cross(t).dot(normal) / size;
  out.point = T_world_first * vec3(first_depth * first);
  out.error = std::sqrt(0.5 * (vec3(first - seen_first).squaredNorm() + vec3(second - seen_second).squaredNorm()));
  out.status = !out.point.allFinite()                    ? triangulation_status::no_parallax
               : first_depth > 0.0 && second_depth > 0.0 ? triangulation_status::ok
                                                         : triangulation_status::behind_camera;
  return out;
}

}  // namespace orbis::optimize
