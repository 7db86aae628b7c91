// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Type-erased points, the argument type of algorithms that are compiled once.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <ranges>
#include <tuple>
#include <type_traits>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud::detail {

/// Converts any policy to the policy type for which algorithms are compiled; results are the same for all policies.
template <execution_policy Policy>
[[nodiscard]] parallel_policy as_parallel(const Policy& policy) noexcept(noexcept(policy.threads())) {
  if constexpr (std::same_as<Policy, parallel_policy>)
    return policy;
  else
    return {std::max(1U, static_cast<unsigned>(policy.threads()))};
}

/// Points whose coordinates are numbers of type `S` with a fixed stride.
template <std::floating_point S>
class basic_point_view {
 public:
  using scalar = S;
  basic_point_view() = default;
  /// Views points in memory. `axis`: coordinates of the first point; consecutive points are `stride` bytes apart.
  basic_point_view(const std::array<const S*, 3>& axis, std::size_t stride, std::size_t count) noexcept
      : stride_{stride}, count_{count} {
    for (std::size_t a = 0; a != 3; ++a) axis_[a] = reinterpret_cast<const unsigned char*>(axis[a]);
  }
  basic_point_view(const std::vector<std::array<S, 3>>& points) noexcept  // NOLINT(google-explicit-constructor)
      : stride_{sizeof(points[0])}, count_{points.size()} {
    const auto* const first = reinterpret_cast<const unsigned char*>(points.data());
    if (count_ != 0) axis_ = {first, first + sizeof(S), first + 2 * sizeof(S)};
  }

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] std::array<S, 3> operator[](std::size_t i) const noexcept {
    std::array<S, 3> p;
    for (std::size_t a = 0; a != 3; ++a) std::memcpy(&p[a], axis_[a] + i * stride_, sizeof(S));
    return p;
  }

 private:
  std::array<const unsigned char*, 3> axis_{};
  std::size_t stride_ = 0;
  std::size_t count_ = 0;
};

using point_view = basic_point_view<float>;

/// A point type that stores its coordinates directly, not through a pointer.
template <class P>
concept indexed_storage = std::is_bounded_array_v<P> || requires {
  std::tuple_size<P>::value;
} ||(requires { P::SizeAtCompileTime; } && std::same_as<P, typename P::PlainObject>);

/// Addresses of a point's coordinates; null if the point computes them or stores another number type.
template <std::floating_point S, point_like P>
[[nodiscard]] std::array<const S*, 3> stored_coordinates(const P& p) noexcept {
  if constexpr (requires { typename point_traits<P>::is_default; }) {
    if constexpr (requires {
                    { p.x } -> std::same_as<const S&>;
                    { p.y } -> std::same_as<const S&>;
                    { p.z } -> std::same_as<const S&>;
                  }) {
      return {std::addressof(p.x), std::addressof(p.y), std::addressof(p.z)};
    } else if constexpr (indexed_storage<P> && requires {
                           { p[0] } -> std::same_as<const S&>;
                         }) {
      return {std::addressof(p[0]), std::addressof(p[1]), std::addressof(p[2])};
    }
  }
  return {};
}

/// Adapts a user's points to `basic_point_view`: in place if they store numbers of type `S` contiguously, otherwise as
/// a copy (12 bytes per point for float).
template <std::floating_point S>
class basic_viewed_points {
 public:
  template <point_range Points>
  explicit basic_viewed_points(const Points& points) {
    const std::size_t count = std::ranges::size(points);
    if constexpr (std::ranges::contiguous_range<const Points>) {
      if (count == 0) return;
      const auto* const first = std::ranges::data(points);
      const std::array<const S*, 3> axis = stored_coordinates<S>(*first);
      if (holds_coordinates(*first, axis)) {
        view_ = {axis, sizeof(*first), count};
        return;
      }
    }
    copies_.reserve(count);
    for (const auto& p : points) copies_.push_back(coordinates<S>(p));
    view_ = copies_;
  }
  basic_viewed_points(const basic_viewed_points&) = delete;
  basic_viewed_points& operator=(const basic_viewed_points&) = delete;
  [[nodiscard]] const basic_point_view<S>& view() const noexcept { return view_; }
  // NOLINTNEXTLINE(google-explicit-constructor)
  [[nodiscard]] operator const basic_point_view<S>&() const noexcept { return view_; }

 private:
  /// Returns true if the coordinates exist and are stored inside the point. For a packed struct, for example,
  /// the addresses are those of temporary copies.
  template <class P>
  [[nodiscard]] static bool holds_coordinates(const P& point, const std::array<const S*, 3>& axis) noexcept {
    const auto begin = reinterpret_cast<std::uintptr_t>(std::addressof(point));
    for (const S* const a : axis) {
      const auto at = reinterpret_cast<std::uintptr_t>(a);
      if (at < begin || at + sizeof(S) > begin + sizeof(P)) return false;
    }
    return true;
  }

  std::vector<std::array<S, 3>> copies_;
  basic_point_view<S> view_;
};
using viewed_points = basic_viewed_points<float>;

/// Returns the i-th point of a cloud.
template <point_range Points>
[[nodiscard]] decltype(auto) point_at(const Points& points, std::size_t i) {
  return std::ranges::begin(points)[static_cast<std::ranges::range_difference_t<const Points>>(i)];
}

}  // namespace orbis::cloud::detail
