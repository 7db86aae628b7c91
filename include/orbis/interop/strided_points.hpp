// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Points at regular distances in a buffer, in place: matrices, images of points, packed messages, columns of a table.
///
/// Eigen's matrices do not need it: `m.colwise()` and `m.rowwise()` are ranges of points already.
#pragma once

#include <array>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <ranges>

namespace orbis::interop {

/// Placement of the points in the buffer, in units of `S`.
struct point_layout {
  std::ptrdiff_t point_stride = 3;       ///< from one point to the next
  std::ptrdiff_t coordinate_stride = 1;  ///< from x to y, and from y to z
  std::size_t row_length = 0;            ///< points in a row; 0: all points are in one row
  std::ptrdiff_t row_stride = 0;         ///< from the first point of a row to the first point of the next
};

namespace detail {

template <std::floating_point S>
struct strided_point {
  const S* data = nullptr;
  point_layout layout{};

  [[nodiscard]] constexpr std::array<S, 3> operator()(std::ptrdiff_t i) const noexcept {
    const auto length = static_cast<std::ptrdiff_t>(layout.row_length);
    const S* const p = length == 0 ? data + i * layout.point_stride
                                   : data + i / length * layout.row_stride + i % length * layout.point_stride;
    return {p[0], p[layout.coordinate_stride], p[2 * layout.coordinate_stride]};
  }
};
template <std::floating_point S>
using strided_view =
    std::ranges::transform_view<std::ranges::iota_view<std::ptrdiff_t, std::ptrdiff_t>, strided_point<S>>;

}  // namespace detail

/// A view of `size` points with coordinates `S`; each is read as a `std::array<S, 3>`. A non-owning `point_range`: the
/// buffer must outlive it.
template <std::floating_point S>
class strided_points : public detail::strided_view<S> {
 public:
  constexpr strided_points() = default;
  /// `data`: x of the first point. @pre the buffer contains all points; rows are full
  constexpr strided_points(const S* data, std::size_t size, const point_layout& layout = {})
      : detail::strided_view<S>{{0, static_cast<std::ptrdiff_t>(size)}, {data, layout}} {
    assert(layout.row_length == 0 || size % layout.row_length == 0);
  }
};

}  // namespace orbis::interop
