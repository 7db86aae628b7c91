// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The residuals of the component written once more, straight from their definitions, for any type of
/// number: what analytic Jacobians are held against.
#pragma once

#include <cmath>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/optimize/automatic.hpp>

namespace orbis::test {

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
matrix<6, 1, S> logarithm(const optimize::rigid<S>& t) {
  const matrix<3, 1, S> phi = logarithm<S>(t.rotation);
  matrix<6, 1, S> xi;
  xi << solve<S>(integral<S>(hat<S>(phi)), t.translation), phi;
  return xi;
}
template <class S>
matrix<7, 1, S> logarithm(const optimize::similarity<S>& t) {
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
