// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// In-place access to user-defined point types through a trait.
///
/// Any type with members `x`, `y`, `z` (PCL's points, plain structs) and any type indexable with `p[0], p[1], p[2]`
/// (Eigen vectors, `std::array`, `float[3]`) works without further code. For other types, specialise `point_traits`:
///
/// @code
///   template <> struct orbis::point_traits<my_point> {
///     using scalar = float;
///     static float x(const my_point& p) { return p.easting; }
///     static float y(const my_point& p) { return p.northing; }
///     static float z(const my_point& p) { return p.height; }
///   };
/// @endcode
#pragma once

#include <array>
#include <cmath>
#include <concepts>
#include <ranges>
#include <tuple>
#include <type_traits>
#include <utility>

namespace orbis {

namespace detail {

/// True if the type is known at compile time to hold fewer than three numbers.
template <class P>
[[nodiscard]] consteval bool has_fewer_than_three() {
  if constexpr (std::is_bounded_array_v<P>) {
    return std::extent_v<P> < 3;
  } else if constexpr (requires { P::SizeAtCompileTime; }) {  // Eigen: -1 if only known at run time
    return int{P::SizeAtCompileTime} >= 0 && int{P::SizeAtCompileTime} < 3;
  } else if constexpr (requires { std::tuple_size<P>::value; }) {
    return std::tuple_size<P>::value < 3;
  } else {
    return false;
  }
}

}  // namespace detail

/// Customisation point; the primary template is empty so that `point_like` is false without an error.
template <class P>
struct point_traits {};

template <class P>
requires requires(const P& p) {
  { p.x } -> std::convertible_to<double>;
  { p.y } -> std::convertible_to<double>;
  { p.z } -> std::convertible_to<double>;
}
struct point_traits<P> {
  using scalar = std::remove_cvref_t<decltype(std::declval<const P&>().x)>;
  using is_default = void;  ///< marks the default implementation
  static constexpr scalar x(const P& p) noexcept { return p.x; }
  static constexpr scalar y(const P& p) noexcept { return p.y; }
  static constexpr scalar z(const P& p) noexcept { return p.z; }
};

template <class P>
requires(
    !requires(const P& p) { p.x; } && !detail::has_fewer_than_three<P>() &&
    requires(const P& p) {
      { p[0] } -> std::convertible_to<double>;
      { p[2] } -> std::convertible_to<double>;
    }) struct point_traits<P> {
  using scalar = std::remove_cvref_t<decltype(std::declval<const P&>()[0])>;
  using is_default = void;
  static constexpr scalar x(const P& p) noexcept { return p[0]; }
  static constexpr scalar y(const P& p) noexcept { return p[1]; }
  static constexpr scalar z(const P& p) noexcept { return p[2]; }
};

/// A point whose three coordinates (metres) can be read.
template <class P>
concept point_like = requires(const std::remove_cvref_t<P>& p) {
  typename point_traits<std::remove_cvref_t<P>>::scalar;
  requires std::floating_point<typename point_traits<std::remove_cvref_t<P>>::scalar>;
  { point_traits<std::remove_cvref_t<P>>::x(p) } -> std::same_as<typename point_traits<std::remove_cvref_t<P>>::scalar>;
  { point_traits<std::remove_cvref_t<P>>::y(p) } -> std::same_as<typename point_traits<std::remove_cvref_t<P>>::scalar>;
  { point_traits<std::remove_cvref_t<P>>::z(p) } -> std::same_as<typename point_traits<std::remove_cvref_t<P>>::scalar>;
};

/// A sized random-access range of points: a cloud that algorithms read without copying it.
template <class R>
concept point_range =
    std::ranges::random_access_range<R> && std::ranges::sized_range<R> && point_like<std::ranges::range_value_t<R>>;

/// The number type of a point's coordinates.
template <point_like P>
using point_scalar_t = typename point_traits<std::remove_cvref_t<P>>::scalar;

/// The coordinates of `p` converted to `S`.
template <std::floating_point S, point_like P>
[[nodiscard]] constexpr std::array<S, 3> coordinates(const P& p) noexcept {
  using traits = point_traits<P>;
  return {static_cast<S>(traits::x(p)), static_cast<S>(traits::y(p)), static_cast<S>(traits::z(p))};
}

/// Returns true if all three coordinates are finite.
template <point_like P>
[[nodiscard]] bool is_finite(const P& p) noexcept {
  using traits = point_traits<P>;
  return std::isfinite(traits::x(p)) && std::isfinite(traits::y(p)) && std::isfinite(traits::z(p));
}

}  // namespace orbis
