// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Dual numbers, and residuals of bundle adjustment whose Jacobians are computed with them: what tests compare
/// Jacobians by hand with.
#pragma once

#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <utility>

#include <Eigen/Core>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>

namespace orbis::test {

/// A dual number: a value together with its derivatives by N variables. Every operation carries both, exactly up to
/// rounding. Mathematical functions are found by argument-dependent lookup: write `using std::sqrt; sqrt(x)`.
/// Comparisons compare the values only.
/// Source: A. Griewank, A. Walther, "Evaluating Derivatives", 2nd edition, SIAM 2008, chapter 3 (forward mode).
template <int N>
struct dual {
  double value = 0.0;
  matrix<N> slope = zeros<matrix<N>>();  ///< the derivatives of `value`

  dual() = default;
  /// A constant.
  dual(double x) : value{x} {}  // NOLINT(google-explicit-constructor)
  dual(double x, const matrix<N>& derivatives) : value{x}, slope{derivatives} {}
  /// The i-th of the N variables, at the value `x`. @pre 0 <= i < N
  [[nodiscard]] static dual variable(double x, int i) { return {x, matrix<N>::Unit(i)}; }

  dual& operator+=(const dual& b) { return *this = *this + b; }
  dual& operator-=(const dual& b) { return *this = *this - b; }
  dual& operator*=(const dual& b) { return *this = *this * b; }
  dual& operator/=(const dual& b) { return *this = *this / b; }

  friend dual operator+(const dual& a) { return a; }
  friend dual operator-(const dual& a) {
    return {-a.value, map(a, [](double s) { return -s; })};
  }
  friend dual operator+(const dual& a, const dual& b) {
    return {a.value + b.value, map(a, b, [](double s, double t) { return s + t; })};
  }
  friend dual operator-(const dual& a, const dual& b) {
    return {a.value - b.value, map(a, b, [](double s, double t) { return s - t; })};
  }
  friend dual operator*(const dual& a, const dual& b) { return {a.value * b.value, sum(a.value, b, b.value, a)}; }
  friend dual operator/(const dual& a, const dual& b) {
    const double quotient = a.value / b.value;
    return {quotient, map(a, b, [&](double s, double t) { return (s - quotient * t) / b.value; })};
  }

  friend bool operator==(const dual& a, const dual& b) { return a.value == b.value; }
  friend auto operator<=>(const dual& a, const dual& b) { return a.value <=> b.value; }

  friend bool isfinite(const dual& a) { return std::isfinite(a.value) && a.slope.allFinite(); }

  friend dual sqrt(const dual& a) {
    const double root = std::sqrt(a.value);
    return {root, times(0.5 / root, a)};
  }
  friend dual log(const dual& a) { return {std::log(a.value), over(a, a.value)}; }
  friend dual sin(const dual& a) { return {std::sin(a.value), times(std::cos(a.value), a)}; }
  friend dual cos(const dual& a) { return {std::cos(a.value), times(-std::sin(a.value), a)}; }
  friend dual acos(const dual& a) { return {std::acos(a.value), over(a, -std::sqrt(1.0 - a.value * a.value))}; }
  friend dual atan2(const dual& y, const dual& x) {
    const double square = x.value * x.value + y.value * y.value;
    return {std::atan2(y.value, x.value),
            map(x, y, [&](double by_x, double by_y) { return (x.value * by_y - y.value * by_x) / square; })};
  }
  friend dual pow(const dual& a, double b) {
    return {std::pow(a.value, b), times(b == 0.0 ? 0.0 : b * std::pow(a.value, b - 1.0), a)};
  }

 private:
  // Loops instead of Eigen's expressions, which compilers take a hundred times as long for.
  template <class F>
  [[nodiscard]] static matrix<N> map(const dual& a, const F& f) {
    matrix<N> out;
    for (int i = 0; i != N; ++i) out.data()[i] = f(a.slope.data()[i]);
    return out;
  }
  template <class F>
  [[nodiscard]] static matrix<N> map(const dual& a, const dual& b, const F& f) {
    matrix<N> out;
    for (int i = 0; i != N; ++i) out.data()[i] = f(a.slope.data()[i], b.slope.data()[i]);
    return out;
  }
  [[nodiscard]] static matrix<N> times(double factor, const dual& a) {
    return map(a, [&](double s) { return factor * s; });
  }
  [[nodiscard]] static matrix<N> over(const dual& a, double divisor) {
    return map(a, [&](double s) { return s / divisor; });
  }
  /// `p a' + q b'`.
  [[nodiscard]] static matrix<N> sum(double p, const dual& a, double q, const dual& b) {
    return map(a, b, [&](double s, double t) { return p * s + q * t; });
  }
};

}  // namespace orbis::test

/// @cond
template <int N>
struct Eigen::NumTraits<orbis::test::dual<N>> : Eigen::NumTraits<double> {
  using Real = orbis::test::dual<N>;
  using NonInteger = orbis::test::dual<N>;
  using Nested = orbis::test::dual<N>;
  using Literal = orbis::test::dual<N>;
  enum {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 1,
    ReadCost = 1 + N,
    AddCost = 1 + N,
    MulCost = 3 + 2 * N
  };
};
template <int N, class Operation>
struct Eigen::ScalarBinaryOpTraits<orbis::test::dual<N>, double, Operation> {
  using ReturnType = orbis::test::dual<N>;
};
template <int N, class Operation>
struct Eigen::ScalarBinaryOpTraits<double, orbis::test::dual<N>, Operation> {
  using ReturnType = orbis::test::dual<N>;
};
/// @endcond

namespace orbis::test {

/// A rigid transform with entries of any number type.
template <class S>
struct rigid {
  matrix<3, 3, S> rotation;
  matrix<3, 1, S> translation;

  [[nodiscard]] friend matrix<3, 1, S> operator*(const rigid& t, const matrix<3, 1, S>& p) {
    return t.rotation * p + t.translation;
  }
  [[nodiscard]] friend rigid operator*(const rigid& a, const rigid& b) {
    return {a.rotation * b.rotation, a * b.translation};
  }
  [[nodiscard]] rigid inverse() const {
    const matrix<3, 3, S> back = transposed(rotation);
    return {back, -(back * translation)};
  }
};

/// How an estimate on the manifold M is written with any number type: `lift<M>::at(m, p, d)` is what a residual gets
/// for the estimate a step `d` away from `p`. It must be correct to first order in `d`, which has `M::dimension`
/// entries. Specialise it for camera manifolds of your own.
template <class M>
struct lift;

/// Poses become a `rigid<S>`.
template <>
struct lift<optimize::lie_group<se3>> {
  template <class S>
  [[nodiscard]] static rigid<S> at(const optimize::lie_group<se3>&, const se3& p, const matrix<6, 1, S>& d) {
    const matrix<3, 1, S> rho = d.template head<3>(), phi = d.template tail<3>();
    const matrix<3, 3, S> rotation = p.rotation_matrix().template cast<S>();
    return {rotation * (identity<matrix<3, 3, S>>() + hat<S>(phi)),
            p.translation().template cast<S>() + rotation * rho};
  }
};

/// Vectors of N numbers; a step is added.
template <int N>
struct euclidean {
  using point = matrix<N>;
  using tangent = matrix<N>;
  static constexpr int dimension = N;
  [[nodiscard]] static point retract(const point& p, const tangent& d) { return p + d; }
};

/// Vectors become vectors.
template <int N>
struct lift<euclidean<N>> {
  template <class S>
  [[nodiscard]] static matrix<N, 1, S> at(const euclidean<N>&, const matrix<N>& p, const matrix<N, 1, S>& d) {
    return p.template cast<S>() + d;
  }
};

/// A camera manifold for which `lift` is specialised.
template <class M>
concept liftable = optimize::camera_manifold<M> &&
    requires(const M& m, const typename M::point& p, const matrix<M::dimension>& d) {
  lift<M>::template at<double>(m, p, d);
};

namespace detail {

/// How many numbers a vector, or an `optional` of one, has.
template <class R>
inline constexpr int residual_size = R::RowsAtCompileTime;
template <class R>
inline constexpr int residual_size<std::optional<R>> = R::RowsAtCompileTime;

/// `lift` with the manifold by value: g++ 12 takes a reference to an empty member for one to something uninitialised.
template <class S, class M>
[[nodiscard]] auto lifted(M m, const typename M::point& p, const matrix<M::dimension, 1, S>& d) {
  return lift<M>::template at<S>(m, p, d);
}

}  // namespace detail

/// A residual for `bundle_adjuster` made of `f(camera, point, observation)`; satisfies `bundle_residual`. `camera` is
/// what `lift` makes of a `M::point`, `point` a vector of the same number type, in the world frame. `f` returns a
/// vector of fixed size, not yet whitened, or an `optional` of one (empty: no projection). One evaluation of `f` on
/// dual numbers gives all derivatives. Costs several times an analytic residual.
template <std::copyable F, liftable M, class Observation = optimize::bundle_observation>
struct automatic_bundle_residual {
  F f;
  M manifold{};

  automatic_bundle_residual(F function, M space = {}) : f{std::move(function)}, manifold{std::move(space)} {}

  using camera_state = typename M::point;
  using camera_manifold = M;
  using observation = Observation;
  using view = camera_state;
  static constexpr int dimension = detail::residual_size<decltype(std::declval<const F&>()(
      lift<M>::template at<double>(std::declval<const M&>(), std::declval<const camera_state&>(),
                                   std::declval<const matrix<M::dimension>&>()),
      std::declval<const vec3&>(), std::declval<const Observation&>()))>;
  using value_type = std::optional<matrix<dimension>>;

  [[nodiscard]] static view prepare(const camera_state& state) { return state; }
  [[nodiscard]] static bool is_usable(const observation& o) {
    return o.information > 0.0 && std::isfinite(o.information);
  }
  /// Empty where `f` says so, and where a value is not finite.
  [[nodiscard]] value_type residual(const view& v, const vec3& point, const observation& o) const {
    const value_type r = f(detail::lifted<double>(manifold, v, zeros<matrix<M::dimension>>()), point, o);
    return r && r->allFinite() ? r : std::nullopt;
  }
  /// The residual and its derivatives, which are unchanged where it is empty.
  [[nodiscard]] value_type linearize(const view& v, const vec3& point, const observation& o,
                                     matrix<dimension, M::dimension>& by_camera, matrix<dimension, 3>& by_point) const {
    constexpr int n = M::dimension + 3;
    using number = dual<n>;
    matrix<M::dimension, 1, number> step;
    for (int i = 0; i != M::dimension; ++i) step[i] = number::variable(0.0, i);
    matrix<3, 1, number> p;
    for (int i = 0; i != 3; ++i) p[i] = number::variable(point[i], M::dimension + i);
    const std::optional<matrix<dimension, 1, number>> r = f(detail::lifted<number>(manifold, v, step), p, o);
    if (!r) return std::nullopt;
    matrix<dimension> values;
    matrix<dimension, n> all;
    for (int i = 0; i != dimension; ++i) {
      values[i] = (*r)[i].value;
      all.row(i) = transposed((*r)[i].slope);
    }
    if (!all_finite(values) || !all_finite(all)) return std::nullopt;
    by_camera = all.template leftCols<M::dimension>();
    by_point = all.template rightCols<3>();
    return values;
  }
};
template <class F, class M>
automatic_bundle_residual(F, M) -> automatic_bundle_residual<F, M>;

}  // namespace orbis::test
