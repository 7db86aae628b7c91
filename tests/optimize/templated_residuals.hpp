// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The residuals of the component, written again from their definitions for any number type, and their derivatives by
/// dual numbers: the reference for analytic Jacobians.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <optional>
#include <tuple>
#include <utility>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/optimize/bundle_problem.hpp>

#include "dual_numbers.hpp"

namespace orbis::test {

/// A similarity transform with entries of any number type.
template <class S>
struct similarity {
  matrix<3, 3, S> rotation;
  matrix<3, 1, S> translation;
  S scale = S(1);

  [[nodiscard]] friend matrix<3, 1, S> operator*(const similarity& t, const matrix<3, 1, S>& p) {
    return t.scale * (t.rotation * p) + t.translation;
  }
  [[nodiscard]] friend similarity operator*(const similarity& a, const similarity& b) {
    return {a.rotation * b.rotation, a * b.translation, a.scale * b.scale};
  }
  [[nodiscard]] similarity inverse() const {
    const matrix<3, 3, S> back = rotation.transpose();
    const S shrink = S(1) / scale;
    return {back, -(shrink * (back * translation)), shrink};
  }
};

}  // namespace orbis::test

/// A rotation matrix.
template <>
struct orbis::test::lift<orbis::optimize::lie_group<orbis::so3>> {
  template <class S>
  static matrix<3, 3, S> at(const optimize::lie_group<so3>&, const so3& p, const matrix<3, 1, S>& d) {
    return p.rotation_matrix().cast<S>() * (matrix<3, 3, S>::Identity() + hat<S>(d));
  }
};
/// A `similarity`.
template <>
struct orbis::test::lift<orbis::optimize::lie_group<orbis::sim3>> {
  template <class S>
  static test::similarity<S> at(const optimize::lie_group<sim3>&, const sim3& p, const matrix<7, 1, S>& d) {
    const matrix<3, 1, S> rho = d.template head<3>(), phi = d.template segment<3>(3);
    const S scale(p.scale());
    const matrix<3, 3, S> rotation = p.rotation_matrix().cast<S>();
    return {rotation * (matrix<3, 3, S>::Identity() + hat<S>(phi)),
            p.translation().template cast<S>() + scale * (rotation * rho), scale * (S(1) + d[6])};
  }
};

namespace orbis::test {

/// A residual of several points on manifolds: `linearize(points..., jacobians...)` by one evaluation on dual numbers.
template <class F, class... M>
struct automatic {
  F f;

  automatic(F function, M...) : f{std::move(function)} {}

  template <class... J>
  auto linearize(const typename M::point&... p, J&... jacobians) const {
    constexpr int n = 14;  // enough for all, so that there is one kind of dual numbers to compile
    static_assert((0 + ... + M::dimension) <= n);
    int next = 0;
    const auto r = std::apply(f, std::tuple{seeded<n, M>(p, next)...});
    constexpr int rows = decltype(r)::RowsAtCompileTime;
    matrix<rows> values;
    matrix<rows, n> all;
    for (int i = 0; i != rows; ++i) {
      values[i] = r[i].value;
      all.row(i) = r[i].slope.transpose();
    }
    int first = 0;
    ((jacobians = all.template middleCols<J::ColsAtCompileTime>(first), first += J::ColsAtCompileTime), ...);
    return std::optional<matrix<rows>>{values};
  }

 private:
  /// The point `p` whose step has the variables `first`, `first + 1`, ...
  template <int N, class Manifold>
  static auto seeded(const typename Manifold::point& p, int& first) {
    matrix<Manifold::dimension, 1, dual<N>> d;
    for (int i = 0; i != Manifold::dimension; ++i) d[i] = dual<N>::variable(0.0, first++);
    return lift<Manifold>::template at<dual<N>>(Manifold{}, p, d);
  }
};

template <class S>
matrix<2, 1, S> project(const camera::pinhole& c, const matrix<3, 1, S>& p) {
  return {c.k().fx * p.x() / p.z() + c.k().cx, c.k().fy * p.y() / p.z() + c.k().cy};
}
template <class S>
matrix<2, 1, S> project(const camera::radial_tangential& c, const matrix<3, 1, S>& p) {
  const auto& d = c.distortion();
  const S x = p.x() / p.z(), y = p.y() / p.z(), s = x * x + y * y;
  const S g = (1.0 + d.k1 * s + d.k2 * s * s + d.k3 * s * s * s) / (1.0 + d.k4 * s + d.k5 * s * s + d.k6 * s * s * s);
  const S u = g * x + 2.0 * d.p1 * x * y + d.p2 * (s + 2.0 * x * x);
  const S v = g * y + d.p1 * (s + 2.0 * y * y) + 2.0 * d.p2 * x * y;
  return {c.k().fx * u + c.k().cx, c.k().fy * v + c.k().cy};
}
template <class S>
matrix<2, 1, S> project(const camera::kannala_brandt& c, const matrix<3, 1, S>& p) {
  using std::atan2, std::sqrt, std::pow;
  const auto& d = c.distortion();
  const S r = sqrt(p.x() * p.x() + p.y() * p.y()), theta = atan2(r, p.z());
  const S t = theta + d.k1 * pow(theta, 3.0) + d.k2 * pow(theta, 5.0) + d.k3 * pow(theta, 7.0) + d.k4 * pow(theta, 9.0);
  return {c.k().fx * t * p.x() / r + c.k().cx, c.k().fy * t * p.y() / r + c.k().cy};
}

/// Pixel, and the virtual right coordinate where there is one.
template <class S, class Camera>
matrix<3, 1, S> reproject(const Camera& camera, double bf, const matrix<3, 1, S>& p, const vec2& pixel, double right) {
  const matrix<2, 1, S> seen = project<S>(camera, p);
  return {seen.x() - pixel.x(), seen.y() - pixel.y(), std::isnan(right) ? S(0.0) : seen.x() - bf / p.z() - right};
}

/// The rotation vector of a rotation that is neither small nor by nearly half a turn.
template <class S>
matrix<3, 1, S> logarithm(const matrix<3, 3, S>& r) {
  using std::acos, std::sin;
  const S angle = acos(0.5 * (r.trace() - S(1.0)));
  const matrix<3, 1, S> axis(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1));
  return (0.5 * angle / sin(angle)) * axis;
}

/// The integral of exp(t a) for t from 0 to 1, by its power series.
template <class S>
matrix<3, 3, S> integral(const matrix<3, 3, S>& a) {
  matrix<3, 3, S> sum = matrix<3, 3, S>::Identity(), term = sum;
  for (int n = 2; n != 40; ++n) {
    term = (term * a * S(1.0 / n)).eval();
    sum += term;
  }
  return sum;
}

/// The solution of m x = b, by Cramer's rule.
template <class S>
matrix<3, 1, S> solve(const matrix<3, 3, S>& m, const matrix<3, 1, S>& b) {
  const matrix<3, 1, S> x = m.col(0), y = m.col(1), z = m.col(2);
  const S det = x.dot(y.cross(z));
  return {b.dot(y.cross(z)) / det, x.dot(b.cross(z)) / det, x.dot(y.cross(b)) / det};
}

template <class S>
matrix<6, 1, S> logarithm(const rigid<S>& t) {
  const matrix<3, 1, S> phi = logarithm<S>(t.rotation);
  matrix<6, 1, S> xi;
  xi << solve<S>(integral<S>(hat<S>(phi)), t.translation), phi;
  return xi;
}
template <class S>
matrix<7, 1, S> logarithm(const similarity<S>& t) {
  using std::log;
  const matrix<3, 1, S> phi = logarithm<S>(t.rotation);
  const S sigma = log(t.scale);
  matrix<7, 1, S> xi;
  xi << solve<S>(integral<S>(hat<S>(phi) + sigma * matrix<3, 3, S>::Identity()), t.translation), phi, sigma;
  return xi;
}

/// The vector part of the unit quaternion with a positive real part.
template <class S>
matrix<3, 1, S> quaternion_vector(const matrix<3, 3, S>& r) {
  using std::sqrt;
  const S w = 0.5 * sqrt(1.0 + r.trace());
  return matrix<3, 1, S>(r(2, 1) - r(1, 2), r(0, 2) - r(2, 0), r(1, 0) - r(0, 1)) * (0.25 / w);
}

}  // namespace orbis::test
