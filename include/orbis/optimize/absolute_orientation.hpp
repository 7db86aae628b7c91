// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The rigid or similarity transform that best maps one list of points to another, in closed form.
///
/// Source: B. K. P. Horn, "Closed-form solution of absolute orientation using unit quaternions",
/// JOSA A 4 (1987); the scale is the least-squares one of S. Umeyama, PAMI 13 (1991).
#pragma once

#include <cmath>
#include <cstddef>
#include <iterator>
#include <ranges>

#include <Eigen/Eigenvalues>

#include <orbis/core/point.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::optimize {

/// A similarity: `s * (R p) + t`.
struct similarity {
  double scale = 1.0;
  so3 rotation;
  vec3 translation = vec3::Zero();
  [[nodiscard]] friend vec3 operator*(const similarity& s, const vec3& p) {
    return s.scale * (s.rotation * p) + s.translation;
  }
};

namespace detail {

template <point_range From, point_range To>
[[nodiscard]] result<similarity> align(const From& from, const To& to, bool with_scale) {
  constexpr const char* where = "absolute orientation";
  const auto n = static_cast<std::size_t>(std::ranges::size(from));
  if (n != static_cast<std::size_t>(std::ranges::size(to)))
    return fail(errc::invalid_argument, where, "the two lists of points differ in length");
  if (n < 3) return fail(errc::no_data, where, "fewer than three pairs of points");
  const auto at = [](const auto& points, std::size_t i) {
    using range = std::remove_cvref_t<decltype(points)>;
    const auto c =
        coordinates<double>(std::ranges::begin(points)[static_cast<std::ranges::range_difference_t<range>>(i)]);
    return vec3(c[0], c[1], c[2]);
  };
  vec3 from_mean = vec3::Zero(), to_mean = vec3::Zero();
  for (std::size_t i = 0; i < n; ++i) {
    from_mean += at(from, i);
    to_mean += at(to, i);
  }
  from_mean /= static_cast<double>(n);
  to_mean /= static_cast<double>(n);
  if (!from_mean.allFinite() || !to_mean.allFinite())
    return fail(errc::degenerate, where, "a coordinate is not finite");

  mat3 m = mat3::Zero();
  double from_spread = 0.0, to_spread = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const vec3 a = at(from, i) - from_mean;
    const vec3 b = at(to, i) - to_mean;
    m += a * b.transpose();
    from_spread += a.squaredNorm();
    to_spread += b.squaredNorm();
  }

  // The best rotation, as a quaternion, is the eigenvector of the largest eigenvalue of this matrix.
  Eigen::Matrix4d q;
  q(0, 0) = m(0, 0) + m(1, 1) + m(2, 2);
  q(1, 1) = m(0, 0) - m(1, 1) - m(2, 2);
  q(2, 2) = -m(0, 0) + m(1, 1) - m(2, 2);
  q(3, 3) = -m(0, 0) - m(1, 1) + m(2, 2);
  q(0, 1) = q(1, 0) = m(1, 2) - m(2, 1);
  q(0, 2) = q(2, 0) = m(2, 0) - m(0, 2);
  q(0, 3) = q(3, 0) = m(0, 1) - m(1, 0);
  q(1, 2) = q(2, 1) = m(0, 1) + m(1, 0);
  q(1, 3) = q(3, 1) = m(2, 0) + m(0, 2);
  q(2, 3) = q(3, 2) = m(1, 2) + m(2, 1);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix4d> eigen(q);
  const vec4 values = eigen.eigenvalues();
  const vec4 best = eigen.eigenvectors().col(3);
  // Two equally good rotations: the points lie on a line, or in one place.
  if (eigen.info() != Eigen::Success ||
      !(values(3) - values(2) > 1e-10 * std::sqrt(from_spread) * std::sqrt(to_spread)))
    return fail(errc::degenerate, where, "the points do not determine a rotation");

  similarity s;
  s.rotation = so3(so3::quaternion(best(0), best(1), best(2), best(3)));
  // values(3) is the trace of the rotated covariance.
  if (with_scale) s.scale = values(3) / from_spread;
  s.translation = to_mean - s.scale * (s.rotation * from_mean);
  return s;
}

}  // namespace detail

/// `T_to_from` that minimises the sum of `|T_to_from * from[i] - to[i]|^2`. O(n).
/// Errors: `invalid_argument` for lists of different length, `no_data` below three pairs,
/// `degenerate` for collinear or non-finite points.
template <point_range From, point_range To>
[[nodiscard]] result<se3> absolute_orientation(const From& from, const To& to) {
  const auto s = detail::align(from, to, false);
  if (!s) return fail(s.error());
  return se3(s->rotation, s->translation);
}

/// The same with a free scale: minimises the sum of `|s R from[i] + t - to[i]|^2`.
template <point_range From, point_range To>
[[nodiscard]] result<similarity> absolute_orientation_with_scale(const From& from, const To& to) {
  return detail::align(from, to, true);
}

}  // namespace orbis::optimize
