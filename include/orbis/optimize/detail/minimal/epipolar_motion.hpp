// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The relative motion of two views up to scale, and the normal equations of Sampson distances for this motion.
#pragma once

#include <cmath>

#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>

namespace orbis::optimize::detail {

/// Returns two orthonormal columns that are orthogonal to the unit vector `p`; discontinuous only at p.z() == 0.
/// Source: T. Duff et al., "Building an orthonormal basis, revisited", JCGT 6(1), 2017.
[[nodiscard]] inline matrix<3, 2> tangent_basis(const vec3& p) {
  const double sign = std::copysign(1.0, p.z());
  const double a = -1.0 / (sign + p.z());
  const double b = p.x() * p.y() * a;
  matrix<3, 2> columns;
  columns(0, 0) = 1.0 + sign * p.x() * p.x() * a;
  columns(1, 0) = sign * b;
  columns(2, 0) = -sign * p.x();
  columns(0, 1) = b;
  columns(1, 1) = sign + p.y() * p.y() * a;
  columns(2, 1) = -p.y();
  return columns;
}

/// Returns the unit vector at a distance of |d| radians from the unit vector `p` along a great circle. `d` is
/// expressed in the basis `tangent_basis(p)`, which is also the derivative of the result with respect to `d` at d = 0.
[[nodiscard]] inline vec3 step_on_sphere(const vec3& p, const vec2& d) {
  const double angle = std::sqrt(d.x() * d.x() + d.y() * d.y());
  const double factor = angle < 1e-8 ? 1.0 : std::sin(angle) / angle, along = std::cos(angle);
  const matrix<3, 2> b = tangent_basis(p);
  double q[3], square = 0.0;
  for (int i = 0; i != 3; ++i) {
    q[i] = along * p[i] + factor * (b(i, 0) * d[0] + b(i, 1) * d[1]);
    square += q[i] * q[i];
  }
  const double length = std::sqrt(square);
  return {q[0] / length, q[1] / length, q[2] / length};
}

/// Converts gradients with respect to the point at z = 1 to gradients with respect to the pixel.
struct pixel_gradient {
  double xx, yx, yy;
  explicit pixel_gradient(const metric_ray& r) : xx{1.0 / r.xx}, yx{-r.xy / (r.xx * r.yy)}, yy{1.0 / r.yy} {}
  [[nodiscard]] vec2 operator()(double gx, double gy) const { return {xx * gx, yx * gx + yy * gy}; }
  /// Returns the product of the transposed conversion matrix and `g`.
  [[nodiscard]] vec2 back(const vec2& g) const { return {xx * g.x() + yx * g.y(), yy * g.y()}; }
};

/// An essential matrix and the motion that it represents: the rotation and the direction of translation of
/// `T_second_first`.
struct epipolar_motion {
  so3 rotation;
  vec3 direction;
  mat3 e;
  epipolar_motion(const so3& r, const vec3& t) : rotation{r}, direction{t}, e{hat<double>(t) * r.rotation_matrix()} {}
  /// Returns the motion after a step: the rotation is multiplied by `exp(head<3>(d))` from the left, and the direction
  /// moves by `tail<2>(d)` on the unit sphere.
  [[nodiscard]] epipolar_motion moved(const matrix<5>& d) const {
    return {so3::exp(head<3>(d)) * rotation, step_on_sphere(direction, tail<2>(d))};
  }
};

/// Returns the squared Sampson distance of a match, where distances are in pixels or in the unit set by
/// `metric_ray::scale_metric`.
[[nodiscard]] inline double squared_sampson(const mat3& e, const image_match& m) {
  const vec3 first = m.first.direction(), second = m.second.direction();
  const vec3 line = e * first, other = transposed(e) * second;
  const double c = dot(second, line);
  return c * c /
         (squared_norm(pixel_gradient(m.second)(line.x(), line.y())) +
          squared_norm(pixel_gradient(m.first)(other.x(), other.y())));
}

/// Normal equations of Sampson distances for the nine entries of E, row by row; `cost` is the sum of squares.
struct epipolar_equations {
  matrix<9, 9> h = zeros<matrix<9, 9>>();
  matrix<9> g = zeros<matrix<9>>();
  double cost = 0.0;

  /// Adds a match to the lower triangle of `h`. `weight(squared distance)` is its weight.
  template <class Weight>
  void add(const mat3& e, const image_match& m, const Weight& weight) {
    const pixel_gradient by_first(m.first), by_second(m.second);
    const vec3 first = m.first.direction(), second = m.second.direction();
    const vec3 line = e * first, other = transposed(e) * second;
    const double c = dot(second, line);
    const vec2 p = by_second(line.x(), line.y()), q = by_first(other.x(), other.y());
    const double inverse = 1.0 / std::sqrt(squared_norm(p) + squared_norm(q));
    const double r = c * inverse;
    const double w = weight(r * r);
    if (!(w > 0.0)) return;
    // r = c / s: dr = (dc - r ds) / s, and s ds = p dp + q dq.
    const vec2 back_p = by_second.back(p) * (r * inverse), back_q = by_first.back(q) * (r * inverse);
    const vec3 dp(back_p.x(), back_p.y(), 0.0), dq(back_q.x(), back_q.y(), 0.0);
    matrix<9> d;
    for (int row = 0; row != 3; ++row)
      for (int column = 0; column != 3; ++column)
        d[3 * row + column] =
            inverse * (second[row] * first[column] - dp[row] * first[column] - second[row] * dq[column]);
    for (int a = 0; a != 9; ++a) {
      const double weighted = w * d[a];
      for (int b = 0; b <= a; ++b) h(a, b) += weighted * d[b];
      g[a] += weighted * r;
    }
    cost += w * r * r;
  }
  void add(const mat3& e, const image_match& m) {
    add(e, m, [](double) { return 1.0; });
  }
  /// Copies the lower triangle of `h` to the upper one.
  void mirror() {
    for (int a = 0; a != 9; ++a)
      for (int b = a + 1; b != 9; ++b) h(a, b) = h(b, a);
  }

  struct motion_equations {
    matrix<5, 5> h;
    matrix<5> g;
  };
  /// Returns the equations for a step of the motion (`epipolar_motion::moved`). @pre `mirror` was called
  [[nodiscard]] motion_equations by_motion(const epipolar_motion& m) const {
    // Derivatives of the entries of E = [t]x R with respect to phi in exp(phi) R and to a step of t on the sphere.
    matrix<9, 5> by_step;
    const matrix<3, 2> basis = tangent_basis(m.direction);
    for (int j = 0; j != 5; ++j) {
      const mat3 d =
          j < 3 ? hat<double>(m.direction) * hat<double>(column_of(identity<mat3>(), j)) * m.rotation.rotation_matrix()
                : hat<double>(column_of(basis, j - 3)) * m.rotation.rotation_matrix();
      for (int entry = 0; entry != 9; ++entry) by_step(entry, j) = d(entry / 3, entry % 3);
    }
    const matrix<9, 5> h_by_step = h * by_step;
    return {transposed_product(by_step, h_by_step), transposed_product(by_step, g)};
  }
};

}  // namespace orbis::optimize::detail
