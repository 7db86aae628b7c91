// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sums for fitting a plane to the levels of the columns around one column.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/mask.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::nav::detail {

/// Marks a column without a level.
inline constexpr int no_level = std::numeric_limits<int>::min();

/// Columns around a central column at coordinates (0, 0).
struct level_window {
  const int* levels = nullptr;  ///< points to the level of the first column
  std::ptrdiff_t stride = 0;    ///< distance between rows
  int x = 0, y = 0;             ///< coordinates of the first column, <= 0
  int width = 0, height = 0;
  int level = 0;  ///< level of the central column
  /// A column counts if its level differs from `level` by at most `step` per cell of distance; distances beyond
  /// `enough` cells count as `enough`. `step` times `enough` fits in an int.
  int step = 1, enough = 1;
};

/// Sums over the columns that count (see level_window); z is the level relative to that of the central column.
struct plane_sums {
  double n = 0, x = 0, y = 0, z = 0, xx = 0, xy = 0, yy = 0, xz = 0, yz = 0;
  int lowest = 0, highest = 0;  ///< extremes of z and 0
};

/// Computes the sums. `T`: type of the sums; exact if each sum fits in a T (for double: if it is less than 2^53).
template <class T>
struct plane_sums_kernel {
  using signature = plane_sums(const level_window&);
  template <class Target>
  static ORBIS_ALWAYS_INLINE plane_sums run(const level_window& w) {
    using integers = simd::native_vec<std::int32_t, Target>;
    using V = simd::vec<T, integers::count, Target>;
    constexpr int lanes = integers::count;
    const auto capped = [&](int distance)
                            ORBIS_INLINE_LAMBDA { return w.step * (distance < w.enough ? distance : w.enough); };
    integers lowest = 0, highest = 0;
    V n = T{0}, x = T{0}, y = T{0}, z = T{0}, xx = T{0}, xy = T{0}, yy = T{0}, xz = T{0}, yz = T{0};
    for (int first = 0; first < w.width; first += lanes) {
      const auto count = static_cast<std::size_t>(w.width - first < lanes ? w.width - first : lanes);
      const auto is_inside = integers::mask::first(count);
      const integers dx = integers(w.x + first) + integers::iota();
      const integers limit_x = min(simd::abs(dx), integers(w.enough)) * integers(w.step);
      // Sums over the columns of the block. Sums of sums weight a row by the number of rows from it to the end (t, or t
      // (t + 1) / 2), which is cheaper than products.
      V ones = T{0}, ones_t = T{0}, ones_tt = T{0}, rise = T{0}, rise_t = T{0};
      for (int row = 0; row != w.height; ++row) {
        const int dy = w.y + row;
        const integers level = integers::load(w.levels + row * w.stride + first, count);
        const integers above = level - integers(w.level);
        const integers limit = max(limit_x, integers(capped(dy < 0 ? -dy : dy)));
        const auto counts = (simd::abs(above) <= limit) & (level != integers(no_level)) & is_inside;
        const integers dz = select(counts, above, integers(0));
        lowest = min(lowest, dz);
        highest = max(highest, dz);
        ones += simd::convert<T>(select(counts, integers(1), integers(0)));
        ones_t += ones;
        ones_tt += ones_t;
        rise += simd::convert<T>(dz);
        rise_t += rise;
      }
      const V at = simd::convert<T>(dx), end = V(static_cast<T>(w.y + w.height));  // dy = end - t
      const V along = end * ones - ones_t;
      n += ones;
      x += ones * at;
      xx += ones * at * at;
      y += along;
      xy += along * at;
      yy += end * along - end * ones_t + (ones_tt + ones_tt - ones_t);
      z += rise;
      xz += rise * at;
      yz += end * rise - rise_t;
    }
    const auto total = [](const V& v) ORBIS_INLINE_LAMBDA { return static_cast<double>(simd::sum(v)); };
    return {total(n),
            total(x),
            total(y),
            total(z),
            total(xx),
            total(xy),
            total(yy),
            total(xz),
            total(yz),
            simd::least(lowest),
            simd::greatest(highest)};
  }
};

}  // namespace orbis::nav::detail
