// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Manifolds: what estimates are, and how a step in a tangent space moves them.
///
/// Source: C. Hertzberg, R. Wagner, U. Frese, L. Schroeder, "Integrating generic sensor fusion
/// algorithms with sound state representations through encapsulation of manifolds", Information
/// Fusion 14(1), 2013: `retract` and `local` are its boxplus and boxminus.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::optimize {

/// `m.retract(p, d)` is the point a step `d` away from `p`, with `retract(p, 0) == p`; `m.local(p, q)`
/// is the step that leads from `p` to `q`, with `retract(p, local(p, q)) == q`. Steps are vectors of
/// `M::dimension` numbers. `m.reduce(j)` turns columns for steps of the whole tangent space, as
/// residuals give them, into columns for the manifold's own steps.
template <class M>
concept manifold = std::copyable<M> && requires(const M& m, const typename M::point& p, const typename M::tangent& d,
                                                const matrix<3, M::full_dimension>& j) {
  { m.retract(p, d) } -> std::same_as<typename M::point>;
  { m.local(p, p) } -> std::same_as<typename M::tangent>;
  { m.reduce(j) } -> std::convertible_to<matrix<3, M::dimension>>;
  requires std::same_as<typename M::tangent, matrix<M::dimension>>;
  requires M::dimension >= 1 && M::dimension <= M::full_dimension;
};

/// A Lie group with steps on the right: `T * exp(d)`, that is, in the frame of the body for a pose
/// `T_world_body`.
template <class T>
struct lie_group {
  using point = T;
  using tangent = typename T::tangent;
  static constexpr int dimension = T::dof;
  static constexpr int full_dimension = T::dof;

  [[nodiscard]] static point retract(const point& p, const tangent& d) { return p * T::exp(d); }
  [[nodiscard]] static tangent local(const point& p, const point& q) { return (p.inverse() * q).log(); }
  template <int R>
  [[nodiscard]] static const matrix<R, dimension>& reduce(const matrix<R, dimension>& j) {
    return j;
  }
};

/// Vectors, with addition.
template <int N>
struct euclidean {
  using point = matrix<N>;
  using tangent = matrix<N>;
  static constexpr int dimension = N;
  static constexpr int full_dimension = N;

  [[nodiscard]] static point retract(const point& p, const tangent& d) { return p + d; }
  [[nodiscard]] static tangent local(const point& p, const point& q) { return q - p; }
  template <int R>
  [[nodiscard]] static const matrix<R, N>& reduce(const matrix<R, N>& j) {
    return j;
  }
};

/// Directions: unit vectors in three dimensions, with steps along great circles. The whole tangent
/// space of a residual is that of the plane `basis(p)`.
struct unit_sphere {
  using point = vec3;
  using tangent = vec2;
  static constexpr int dimension = 2;
  static constexpr int full_dimension = 2;

  /// Two orthonormal columns, orthogonal to the unit vector `p`; smooth but at p.z() == 0. The
  /// derivative of `retract(p, d)` by `d` at 0. Source: T. Duff et al., "Building an orthonormal basis,
  /// revisited", JCGT 6(1), 2017.
  [[nodiscard]] static matrix<3, 2> basis(const point& p) {
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
  [[nodiscard]] static point retract(const point& p, const tangent& d) {
    const double angle = std::sqrt(d.x() * d.x() + d.y() * d.y());
    const double factor = angle < 1e-8 ? 1.0 : std::sin(angle) / angle, along = std::cos(angle);
    const matrix<3, 2> b = basis(p);
    double q[3], square = 0.0;
    for (int i = 0; i != 3; ++i) {
      q[i] = along * p[i] + factor * (b(i, 0) * d[0] + b(i, 1) * d[1]);
      square += q[i] * q[i];
    }
    const double length = std::sqrt(square);
    return {q[0] / length, q[1] / length, q[2] / length};
  }
  /// Of length at most pi; one of many for the opposite direction.
  [[nodiscard]] static tangent local(const point& p, const point& q) {
    const matrix<3, 2> b = basis(p);
    double x = 0.0, y = 0.0, cosine = 0.0;
    for (int i = 0; i != 3; ++i) {
      x += b(i, 0) * q[i];
      y += b(i, 1) * q[i];
      cosine += p[i] * q[i];
    }
    const double sine = std::sqrt(x * x + y * y);
    const double angle = std::atan2(sine, cosine);
    if (sine < 1e-12) return angle < 1.0 ? tangent(x, y) : tangent(angle, 0.0);
    return {angle / sine * x, angle / sine * y};
  }
  template <int R>
  [[nodiscard]] static const matrix<R, 2>& reduce(const matrix<R, 2>& j) {
    return j;
  }
};

/// `M` with all coordinates of a step held at 0 but those named: a gauge, or motion known to be
/// restricted. `subset<lie_group<se3>, 0, 1, 5>` are poses that move along their own x and y and turn
/// about their own z.
template <class M, int... Free>
struct subset {
  static_assert(((Free >= 0 && Free < M::dimension) && ...), "a coordinate that the manifold does not have");
  static_assert(
      [](auto... i) {
        std::array<int, M::dimension> times{};
        (++times[static_cast<std::size_t>(i)], ...);
        return std::all_of(times.begin(), times.end(), [](int n) { return n <= 1; });
      }(Free...),
      "a coordinate that is named twice");

  using point = typename M::point;
  using tangent = matrix<static_cast<int>(sizeof...(Free))>;
  static constexpr int dimension = static_cast<int>(sizeof...(Free));
  static constexpr int full_dimension = M::full_dimension;
  M base{};

  [[nodiscard]] point retract(const point& p, const tangent& d) const {
    typename M::tangent whole = M::tangent::Zero();
    for (int i = 0; i != dimension; ++i) whole[free[static_cast<std::size_t>(i)]] = d[i];
    return base.retract(p, whole);
  }
  /// The named coordinates of the step from `p` to `q`.
  [[nodiscard]] tangent local(const point& p, const point& q) const {
    const typename M::tangent whole = base.local(p, q);
    tangent d;
    for (int i = 0; i != dimension; ++i) d[i] = whole[free[static_cast<std::size_t>(i)]];
    return d;
  }
  template <int R>
  [[nodiscard]] matrix<R, dimension> reduce(const matrix<R, full_dimension>& j) const {
    const matrix<R, M::dimension> whole = base.reduce(j);
    matrix<R, dimension> kept;
    for (int i = 0; i != dimension; ++i) kept.col(i) = whole.col(free[static_cast<std::size_t>(i)]);
    return kept;
  }

 private:
  static constexpr std::array<int, sizeof...(Free)> free{Free...};
};

static_assert(manifold<lie_group<se3>> && manifold<lie_group<sim3>> && manifold<lie_group<so3>>);
static_assert(manifold<euclidean<3>> && manifold<unit_sphere> && manifold<subset<lie_group<se3>, 0, 1, 5>>);

}  // namespace orbis::optimize
