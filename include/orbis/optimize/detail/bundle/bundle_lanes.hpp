// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Unrolled loops and transpositions for the kernels of bundle adjustment.
#pragma once

#include <cstddef>
#include <cstring>
#include <type_traits>
#include <utility>

#include <orbis/core/lanes.hpp>

namespace orbis::optimize::detail {

/// Calls `f` with the constants 0 ... N - 1.
template <int N, class F>
ORBIS_ALWAYS_INLINE void unroll(const F& f) {
  [&]<int... I>(std::integer_sequence<int, I...>) ORBIS_INLINE_LAMBDA { (f(std::integral_constant<int, I>{}), ...); }
  (std::make_integer_sequence<int, N>{});
}

using quarter = typename simd::lanes<4, 4>::native;

/// Three numbers of eight rows of four: number k of all rows goes to `out[k]`.
template <simd::vector L>
ORBIS_ALWAYS_INLINE void load_transposed(const double* const* from, L* out) {
  constexpr std::size_t W = L::target_type::bytes / sizeof(double);
  if constexpr (W == 8) {
    quarter row[8];
    unroll<8>([&](auto i) ORBIS_INLINE_LAMBDA { std::memcpy(&row[i], from[i], sizeof(quarter)); });
    const auto r04 = __builtin_shufflevector(row[0], row[4], 0, 1, 2, 3, 4, 5, 6, 7);
    const auto r15 = __builtin_shufflevector(row[1], row[5], 0, 1, 2, 3, 4, 5, 6, 7);
    const auto r26 = __builtin_shufflevector(row[2], row[6], 0, 1, 2, 3, 4, 5, 6, 7);
    const auto r37 = __builtin_shufflevector(row[3], row[7], 0, 1, 2, 3, 4, 5, 6, 7);
    const auto xz01 = __builtin_shufflevector(r04, r15, 0, 8, 2, 10, 4, 12, 6, 14);
    const auto yw01 = __builtin_shufflevector(r04, r15, 1, 9, 3, 11, 5, 13, 7, 15);
    const auto xz23 = __builtin_shufflevector(r26, r37, 0, 8, 2, 10, 4, 12, 6, 14);
    const auto yw23 = __builtin_shufflevector(r26, r37, 1, 9, 3, 11, 5, 13, 7, 15);
    out[0].v = __builtin_shufflevector(xz01, xz23, 0, 1, 8, 9, 4, 5, 12, 13);
    out[1].v = __builtin_shufflevector(yw01, yw23, 0, 1, 8, 9, 4, 5, 12, 13);
    out[2].v = __builtin_shufflevector(xz01, xz23, 2, 3, 10, 11, 6, 7, 14, 15);
  } else if constexpr (W == 4) {
    const auto part = [&](int at, quarter& x, quarter& y, quarter& z) ORBIS_INLINE_LAMBDA {
      quarter row[4];
      unroll<4>([&](auto i) ORBIS_INLINE_LAMBDA { std::memcpy(&row[i], from[at + i], sizeof(quarter)); });
      const auto xz01 = __builtin_shufflevector(row[0], row[1], 0, 4, 2, 6);
      const auto yw01 = __builtin_shufflevector(row[0], row[1], 1, 5, 3, 7);
      const auto xz23 = __builtin_shufflevector(row[2], row[3], 0, 4, 2, 6);
      const auto yw23 = __builtin_shufflevector(row[2], row[3], 1, 5, 3, 7);
      x = __builtin_shufflevector(xz01, xz23, 0, 1, 4, 5);
      y = __builtin_shufflevector(yw01, yw23, 0, 1, 4, 5);
      z = __builtin_shufflevector(xz01, xz23, 2, 3, 6, 7);
    };
    part(0, out[0].v.low.v, out[1].v.low.v, out[2].v.low.v);
    part(4, out[0].v.high.v, out[1].v.high.v, out[2].v.high.v);
  } else {
    double columns[3][8];
    for (int i = 0; i != 8; ++i)
      for (int k = 0; k != 3; ++k) columns[k][i] = from[i][k];
    for (int k = 0; k != 3; ++k) out[k] = L::load(columns[k]);
  }
}

/// Four rows of eight numbers, as eight rows of four: row i of them goes to `to[i] + offset`.
template <simd::vector L>
ORBIS_ALWAYS_INLINE void store_transposed(const L& a, const L& b, const L& c, const L& d, double* const* to,
                                          int offset) {
  constexpr std::size_t W = L::target_type::bytes / sizeof(double);
  if constexpr (W == 8) {
    const auto ab0 = __builtin_shufflevector(a.v, b.v, 0, 8, 2, 10, 4, 12, 6, 14);
    const auto ab1 = __builtin_shufflevector(a.v, b.v, 1, 9, 3, 11, 5, 13, 7, 15);
    const auto cd0 = __builtin_shufflevector(c.v, d.v, 0, 8, 2, 10, 4, 12, 6, 14);
    const auto cd1 = __builtin_shufflevector(c.v, d.v, 1, 9, 3, 11, 5, 13, 7, 15);
    const auto r04 = __builtin_shufflevector(ab0, cd0, 0, 1, 8, 9, 4, 5, 12, 13);
    const auto r15 = __builtin_shufflevector(ab1, cd1, 0, 1, 8, 9, 4, 5, 12, 13);
    const auto r26 = __builtin_shufflevector(ab0, cd0, 2, 3, 10, 11, 6, 7, 14, 15);
    const auto r37 = __builtin_shufflevector(ab1, cd1, 2, 3, 10, 11, 6, 7, 14, 15);
    const quarter rows[8] = {
        __builtin_shufflevector(r04, r04, 0, 1, 2, 3), __builtin_shufflevector(r15, r15, 0, 1, 2, 3),
        __builtin_shufflevector(r26, r26, 0, 1, 2, 3), __builtin_shufflevector(r37, r37, 0, 1, 2, 3),
        __builtin_shufflevector(r04, r04, 4, 5, 6, 7), __builtin_shufflevector(r15, r15, 4, 5, 6, 7),
        __builtin_shufflevector(r26, r26, 4, 5, 6, 7), __builtin_shufflevector(r37, r37, 4, 5, 6, 7)};
    unroll<8>([&](auto i) ORBIS_INLINE_LAMBDA { std::memcpy(to[i] + offset, &rows[i], sizeof(quarter)); });
    return;
  }
  if constexpr (W == 4) {
    const auto part = [&](const auto& x, const auto& y, const auto& z, const auto& w, int from) ORBIS_INLINE_LAMBDA {
      const auto xy0 = __builtin_shufflevector(x, y, 0, 4, 2, 6), xy1 = __builtin_shufflevector(x, y, 1, 5, 3, 7);
      const auto zw0 = __builtin_shufflevector(z, w, 0, 4, 2, 6), zw1 = __builtin_shufflevector(z, w, 1, 5, 3, 7);
      const quarter rows[4] = {
          __builtin_shufflevector(xy0, zw0, 0, 1, 4, 5), __builtin_shufflevector(xy1, zw1, 0, 1, 4, 5),
          __builtin_shufflevector(xy0, zw0, 2, 3, 6, 7), __builtin_shufflevector(xy1, zw1, 2, 3, 6, 7)};
      unroll<4>([&](auto i) ORBIS_INLINE_LAMBDA { std::memcpy(to[from + i] + offset, &rows[i], sizeof(quarter)); });
    };
    part(a.v.low.v, b.v.low.v, c.v.low.v, d.v.low.v, 0);
    part(a.v.high.v, b.v.high.v, c.v.high.v, d.v.high.v, 4);
    return;
  }
  if constexpr (W <= 2) {
    double rows[4][8];
    a.store(rows[0]);
    b.store(rows[1]);
    c.store(rows[2]);
    d.store(rows[3]);
    for (int i = 0; i != 8; ++i)
      for (int k = 0; k != 4; ++k) to[i][offset + k] = rows[k][i];
  }
}

}  // namespace orbis::optimize::detail
