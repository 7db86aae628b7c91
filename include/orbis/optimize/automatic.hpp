// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Jacobians made from a residual that is written for any type of number.
///
/// @code
///   struct looks_at {  // the direction of a landmark, seen from a pose
///     vec3 landmark, direction;
///     template <class S>
///     matrix<3, 1, S> operator()(const optimize::rigid<S>& T_world_camera) const {
///       return (T_world_camera.inverse() * landmark.cast<S>()).normalized() - direction.cast<S>();
///     }
///   };
///   optimize::automatic residual{looks_at{...}, optimize::lie_group<se3>{}};
///   matrix<3, 6> j;
///   auto r = residual.linearize(pose, j);
/// @endcode
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <optional>
#include <tuple>
#include <type_traits>
#include <utility>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/optimize/bundle_summary.hpp>
#include <orbis/optimize/dual.hpp>
#include <orbis/optimize/manifold.hpp>

namespace orbis::optimize {

/// A similarity transform of any type of number; rigid where `scale` is 1.
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

/// A rigid transform of any type of number.
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
    const matrix<3, 3, S> back = rotation.transpose();
    return {back, -(back * translation)};
  }
};

/// How points of a manifold are written in any type of number: `lift<M>::at(m, p, d)` is what a residual
/// is given for the point a step `d` away from `p`, right up to first order in `d`. `d` has
/// `M::full_dimension` entries (`M::dimension` where there is no such). Specialise it for manifolds of your
/// own.
template <class M>
struct lift;

namespace detail {

template <class S>
[[nodiscard]] matrix<3, 3, S> turned(const so3& r, const matrix<3, 1, S>& phi) {
  return r.rotation_matrix().template cast<S>() * (matrix<3, 3, S>::Identity() + hat<S>(phi));
}

template <class M>
[[nodiscard]] consteval int full_dimension() {
  if constexpr (requires { M::full_dimension; })
    return M::full_dimension;
  else
    return M::dimension;
}

}  // namespace detail

/// A rotation matrix.
template <>
struct lift<lie_group<so3>> {
  template <class S>
  [[nodiscard]] static matrix<3, 3, S> at(const lie_group<so3>&, const so3& p, const matrix<3, 1, S>& d) {
    return detail::turned<S>(p, d);
  }
};
/// A `rigid`.
template <>
struct lift<lie_group<se3>> {
  template <class S>
  [[nodiscard]] static rigid<S> at(const lie_group<se3>&, const se3& p, const matrix<6, 1, S>& d) {
    const matrix<3, 1, S> rho = d.template head<3>(), phi = d.template tail<3>();
    return {detail::turned<S>(p.rotation(), phi),
            p.translation().template cast<S>() + p.rotation_matrix().template cast<S>() * rho};
  }
};
/// A `similarity`.
template <>
struct lift<lie_group<sim3>> {
  template <class S>
  [[nodiscard]] static similarity<S> at(const lie_group<sim3>&, const sim3& p, const matrix<7, 1, S>& d) {
    const matrix<3, 1, S> rho = d.template head<3>(), phi = d.template segment<3>(3);
    const S scale(p.scale());
    return {detail::turned<S>(p.rotation(), phi),
            p.translation().template cast<S>() + scale * (p.rotation_matrix().template cast<S>() * rho),
            scale * (S(1) + d[6])};
  }
};
/// A vector.
template <int N>
struct lift<euclidean<N>> {
  template <class S>
  [[nodiscard]] static matrix<N, 1, S> at(const euclidean<N>&, const matrix<N>& p, const matrix<N, 1, S>& d) {
    return p.template cast<S>() + d;
  }
};
/// A unit vector.
template <>
struct lift<unit_sphere> {
  template <class S>
  [[nodiscard]] static matrix<3, 1, S> at(const unit_sphere&, const vec3& p, const matrix<2, 1, S>& d) {
    return p.template cast<S>() + unit_sphere::basis(p).template cast<S>() * d;
  }
};
/// As without the restriction.
template <class M, int... Free>
struct lift<subset<M, Free...>> {
  template <class S>
  [[nodiscard]] static auto at(const subset<M, Free...>& m, const typename M::point& p,
                               const matrix<M::full_dimension, 1, S>& d) {
    return lift<M>::template at<S>(m.base, p, d);
  }
};

/// A manifold whose points can be written in any type of number.
template <class M>
concept liftable = requires(const M& m, const typename M::point& p,
                            const matrix<detail::full_dimension<M>(), 1, double>& d) {
  lift<M>::template at<double>(m, p, d);
};

namespace detail {

/// What a residual gives, whether it says so with an `optional` or not.
template <class R>
struct residual_traits {
  static constexpr int dimension = R::RowsAtCompileTime;
};
template <class R>
struct residual_traits<std::optional<R>> : residual_traits<R> {};

template <class M, class S>
using lifted = decltype(lift<M>::template at<S>(std::declval<const M&>(), std::declval<const typename M::point&>(),
                                                std::declval<const matrix<full_dimension<M>(), 1, S>&>()));

/// The point `p` with the step's entries as the variables `First`, `First + 1`, ... of dual numbers.
template <int N, int First, class M>
[[nodiscard]] auto seeded(M m, const typename M::point& p) {
  matrix<full_dimension<M>(), 1, dual<N>> d;
  for (int i = 0; i != full_dimension<M>(); ++i) d[i] = dual<N>::variable(0.0, First + i);
  return lift<M>::template at<dual<N>>(m, p, d);
}
template <class M>
[[nodiscard]] auto as_numbers(const M& m, const typename M::point& p) {
  return lift<M>::template at<double>(m, p, matrix<full_dimension<M>()>::Zero());
}

/// Where the steps of the i-th manifold stand among those of all.
template <std::size_t I, class... M>
[[nodiscard]] consteval int offset_of() {
  constexpr int sizes[] = {full_dimension<M>()...};
  int sum = 0;
  for (std::size_t i = 0; i != I; ++i) sum += sizes[i];
  return sum;
}

/// A residual as an optional of numbers; empty for one that is not finite.
template <class R>
[[nodiscard]] auto finite_or_none(const R& r) {
  if constexpr (requires { r.has_value(); }) {
    return r && r->allFinite() ? r : R{};
  } else {
    return r.allFinite() ? std::optional<R>{r} : std::nullopt;
  }
}

/// Splits dual numbers into values and Jacobians, one for each manifold.
template <int D, int N, class... J>
[[nodiscard]] std::optional<matrix<D>> split(const matrix<D, 1, dual<N>>& r, J&... jacobians) {
  matrix<D> values;
  matrix<D, N> all;
  for (int i = 0; i != D; ++i) {
    values[i] = r[i].value;
    all.row(i) = r[i].slope.transpose();
  }
  if (!values.allFinite() || !all.allFinite()) return std::nullopt;
  int first = 0;
  ((jacobians = all.template middleCols<J::ColsAtCompileTime>(first), first += J::ColsAtCompileTime), ...);
  return values;
}

}  // namespace detail

/// A residual of points on manifolds: `F` is called with what `lift` makes of them, and returns a vector of
/// fixed size of the same type of number, or an `optional` of one. One evaluation of `F` on dual numbers
/// gives all derivatives.
template <std::copy_constructible F, liftable... M>
struct automatic {
  F f;
  std::tuple<M...> manifolds{};

  automatic(F function, M... spaces) : f{std::move(function)}, manifolds{std::move(spaces)...} {}

  using value_type = decltype(std::declval<const F&>()(std::declval<const detail::lifted<M, double>&>()...));
  static constexpr int dimension = detail::residual_traits<value_type>::dimension;

  /// Empty where `F` says so, and where it is not finite.
  [[nodiscard]] std::optional<matrix<dimension>> residual(const typename M::point&... p) const {
    return std::apply([&](const M&... m) { return detail::finite_or_none(f(detail::as_numbers(m, p)...)); }, manifolds);
  }
  /// The same with its derivatives by a step of each point, in the whole tangent space, `matrix<dimension,
  /// M::full_dimension>`; untouched where empty.
  [[nodiscard]] std::optional<matrix<dimension>> linearize(
      const typename M::point&... p, matrix<dimension, detail::full_dimension<M>()>&... jacobians) const {
    return linearize_all(std::index_sequence_for<M...>{}, std::tie(p...), jacobians...);
  }

 private:
  template <std::size_t... I, class Points, class... J>
  [[nodiscard]] std::optional<matrix<dimension>> linearize_all(std::index_sequence<I...>, const Points& p,
                                                               J&... jacobians) const {
    constexpr int n = (0 + ... + detail::full_dimension<M>());
    const auto r = f(detail::seeded<n, detail::offset_of<I, M...>()>(std::get<I>(manifolds), std::get<I>(p))...);
    if constexpr (requires { r.has_value(); }) {
      if (!r) return std::nullopt;
      return detail::split<dimension, n>(*r, jacobians...);
    } else {
      return detail::split<dimension, n>(r, jacobians...);
    }
  }
};

/// A residual of bundle adjustment from `f(camera, point, observation)`, where `camera` is what `lift`
/// makes of a point on `M`, and `point` a vector. Satisfies `bundle_residual`.
template <std::copyable F, liftable M, class Observation = bundle_observation>
struct automatic_bundle_residual {
  F f;
  M manifold{};

  automatic_bundle_residual(F function, M space = {}) : f{std::move(function)}, manifold{std::move(space)} {}

  using camera_state = typename M::point;
  using camera_manifold = M;
  using observation = Observation;
  using view = camera_state;
  using value_type =
      decltype(std::declval<const F&>()(std::declval<const detail::lifted<M, double>&>(), std::declval<const vec3&>(),
                                        std::declval<const Observation&>()));
  static constexpr int dimension = detail::residual_traits<value_type>::dimension;

  [[nodiscard]] static view prepare(const camera_state& state) { return state; }
  [[nodiscard]] static bool is_usable(const observation& o) {
    return o.information > 0.0 && std::isfinite(o.information);
  }
  [[nodiscard]] std::optional<matrix<dimension>> residual(const view& v, const vec3& point,
                                                          const observation& o) const {
    return detail::finite_or_none(f(detail::as_numbers(manifold, v), point, o));
  }
  [[nodiscard]] std::optional<matrix<dimension>> linearize(const view& v, const vec3& point, const observation& o,
                                                           matrix<dimension, M::dimension>& by_camera,
                                                           matrix<dimension, 3>& by_point) const {
    auto bound = [this, &o](const auto& camera, const auto& p) { return f(camera, p, o); };
    matrix<dimension, detail::full_dimension<M>()> whole;
    const auto r =
        automatic<decltype(bound), M, euclidean<3>>{bound, manifold, {}}.linearize(v, point, whole, by_point);
    if (!r) return r;
    if constexpr (requires { manifold.reduce(whole); })
      by_camera = manifold.reduce(whole);
    else
      by_camera = whole;
    return r;
  }
};
template <class F, class M>
automatic_bundle_residual(F, M) -> automatic_bundle_residual<F, M>;

}  // namespace orbis::optimize
