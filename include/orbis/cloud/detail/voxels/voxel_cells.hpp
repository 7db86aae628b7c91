// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// In which cell of a grid points lie, block by block.
#pragma once

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <ranges>

#include <orbis/core/point.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// A cell of a grid through the origin.
using voxel_key = std::array<std::int32_t, 3>;

/// Whether a number of `voxel_cells` is that of a cell.
[[nodiscard]] constexpr bool is_cell(std::int32_t cell) noexcept { return cell > -2147483647 && cell < 2147483647; }
[[nodiscard]] constexpr bool is_cell(const voxel_key& key) noexcept {
  return is_cell(key[0]) && is_cell(key[1]) && is_cell(key[2]);
}

/// Whether two keys are the same. `std::array`'s own comparison is a call of memcmp.
[[nodiscard]] constexpr bool same_key(const voxel_key& a, const voxel_key& b) noexcept {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

/// `cells[i] = floor(x[i] * inverse_size)`, in double, where the magnitude is below 2^31 - 1; elsewhere, and where x[i]
/// is not a number, something for which `is_cell` is false. @pre count is a multiple of eight
template <std::floating_point S>
struct voxel_cells {
  using signature = void(const S* x, std::size_t count, double inverse_size, std::int32_t* cells);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const S* x, std::size_t count, double inverse_size, std::int32_t* cells) {
    using lanes = simd::vec<double, 8, Target>;
    for (std::size_t i = 0; i != count; i += lanes::count) {
      const lanes exact = simd::convert<double>(simd::vec<S, 8, Target>::load(x + i)) * lanes(inverse_size);
      const lanes within = min(lanes(2147483647.0), max(lanes(-2147483648.0), exact));  // NaN goes to the lower end
      const lanes truncated = simd::convert<double>(simd::convert<std::int32_t>(within));
      const lanes floored = truncated - select(truncated > within, lanes(1.0), lanes(0.0));
      simd::convert<std::int32_t>(floored).store(cells + i);
    }
  }
};

/// Some points of a cloud with their cells.
template <std::floating_point S>
class point_block {
 public:
  static constexpr std::size_t capacity = 256;

  /// @pre size > 0, metres
  explicit point_block(double size) : inverse_size_{1.0 / size} {}

  /// Takes `count` points; `point(i)` gives the coordinates of the i-th. @pre count <= capacity
  template <class Point>
  void assign(std::size_t count, const Point& point) {
    for (std::size_t i = 0; i != count; ++i) {
      const std::array<S, 3> p = point(i);
      for (std::size_t a = 0; a != 3; ++a) x_[3 * i + a] = p[a];
    }
    run_(x_.data(), (3 * count + 7) / 8 * 8, inverse_size_, cells_.data());
  }
  [[nodiscard]] voxel_key key(std::size_t i) const noexcept {
    return {cells_[3 * i], cells_[3 * i + 1], cells_[3 * i + 2]};
  }
  [[nodiscard]] std::array<double, 3> point(std::size_t i) const noexcept {
    return {double{x_[3 * i]}, double{x_[3 * i + 1]}, double{x_[3 * i + 2]}};
  }

 private:
  double inverse_size_;
  typename voxel_cells<S>::signature* run_ = simd::kernel<voxel_cells<S>, typename voxel_cells<S>::signature>();
  alignas(64) std::array<S, 3 * capacity> x_{};
  alignas(64) std::array<std::int32_t, 3 * capacity> cells_{};
};

}  // namespace orbis::cloud::detail
