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
  const mat2 e = block<2, 2>(essential, 0, 0);
  vec2 n = head<2>(essential * first), m = head<2>(transposed(essential) * second);
  const double a = dot(n, e * m), b = 0.5 * (squared_norm(n) + squared_norm(m));
  const double c = dot(second, essential * first);
  const double d = std::sqrt(std::fmax(0.0, b * b - a * c));
  if (!(b + d > 0.0)) return;  // along the baseline: they meet anyway
  double lambda = c / (b + d);
  const vec2 moved_second = lambda * n, moved_first = lambda * m;
  n -= e * moved_first;
  m -= transposed(e) * moved_second;
  const double size = squared_norm(n) + squared_norm(m);
  if (!(size > 0.0)) return;
  lambda *= 2.0 * d / size;
  set_block(second, 0, 0, head<2>(second) - lambda * n);
  set_block(first, 0, 0, head<2>(first) - lambda * m);
}

}  // namespace detail

ORBIS_COMPILED_ONCE triangulation triangulate(const se3& T_world_first, const vec3& first_ray,
                                              const se3& T_world_second, const vec3& second_ray,
                                              const triangulation_options& options) {
  triangulation out;
  const se3 T_second_first = T_world_second.inverse() * T_world_first;
  const vec3 seen_first = vec3(first_ray) / first_ray.z(), seen_second = vec3(second_ray) / second_ray.z();
  vec3 first = seen_first, second = seen_second;
  if (!all_finite(first) || !all_finite(second) || !all_finite(T_second_first.to_matrix())) {
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
  const vec3 normal = cross(u, second);
  const double size = squared_norm(normal);
  if (!(size > 0.0) || !(squared_norm(t) > 0.0)) return out;
  const double first_depth = dot(cross(second, t), normal) / size;
  const double second_depth = dot(cross(u, t), normal) / size;
  out.point = T_world_first * vec3(first_depth * first);
  out.error = std::sqrt(0.5 * (squared_norm(vec3(first - seen_first)) + squared_norm(vec3(second - seen_second))));
  out.status = !all_finite(out.point)                    ? triangulation_status::no_parallax
               : first_depth > 0.0 && second_depth > 0.0 ? triangulation_status::ok
                                                         : triangulation_status::behind_camera;
  return out;
}

}  // namespace orbis::optimize
