// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of triangulation.hpp.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>

#include <orbis/core/inline.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/optimize/triangulation.hpp>

namespace orbis::optimize {

namespace detail {

ORBIS_LAZY_INLINE mat3 essential_matrix(const se3& T_second_first) {
  return hat<double>(T_second_first.translation()) * T_second_first.rotation_matrix();
}

/// Corrects two rays at z = 1 so that they intersect, with the smallest sum of squared corrections. Takes two steps,
/// which are enough to converge.
ORBIS_INLINE void intersect_rays(const mat3& essential, vec3& first, vec3& second) {
  // `second` is x and `first` is x' in the paper.
  const mat2 e = block<2, 2>(essential, 0, 0);
  vec2 n = head<2>(essential * first), m = head<2>(transposed(essential) * second);
  const double a = dot(n, e * m), b = 0.5 * (squared_norm(n) + squared_norm(m));
  const double c = dot(second, essential * first);
  const double d = std::sqrt(std::fmax(0.0, b * b - a * c));
  if (!(b + d > 0.0)) return;  // rays along the baseline intersect anyway
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

template <class S>
triangulation triangulate_all(std::span<const basic_se3<S>> T_world_camera, std::span<const matrix<3, 1, S>> rays,
                              const triangulation_options& options) {
  assert(T_world_camera.size() == rays.size());
  triangulation out;
  const std::size_t n = rays.size();
  if (n < 2) return out;
  const auto direction = [&](std::size_t i) { return vec3(normalized(T_world_camera[i].rotation() * rays[i])); };
  // Compute the point nearest to all rays relative to the first camera to preserve precision.
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
  // Measure the parallax between two distant rays: the ray farthest from the first one, and the ray farthest from it.
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

}  // namespace detail

ORBIS_INLINE triangulation triangulate(const se3& T_world_first, const vec3& first_ray, const se3& T_world_second,
                                       const vec3& second_ray, const triangulation_options& options) {
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
  detail::intersect_rays(detail::essential_matrix(T_second_first), first, second);
  // In the second camera frame, t + depth_1 u = depth_2 v.
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
