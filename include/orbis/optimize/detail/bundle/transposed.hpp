// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Loads and stores eight rows of four numbers as columns of eight.
#pragma once

#include <orbis/core/simd/shuffle.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/detail/unroll.hpp>

namespace orbis::optimize::detail {

/// Reads the first `Columns` (three or four) numbers of eight rows of four: the k-th numbers of all rows are written to
/// `out[k]`.
template <int Columns, simd::target Target>
ORBIS_ALWAYS_INLINE void load_transposed(const double* const* from, simd::vec<double, 8, Target>* out) {
  static_assert(Columns == 3 || Columns == 4);
  using quarter = simd::vec<double, 4, Target>;
  using simd::shuffle;
  if constexpr (Target::bytes == 64) {
    quarter row[8];
    unroll<8>([&](auto i) ORBIS_INLINE_LAMBDA { row[i] = quarter::load(from[i]); });
    const auto r04 = shuffle<0, 1, 2, 3, 4, 5, 6, 7>(row[0], row[4]);
    const auto r15 = shuffle<0, 1, 2, 3, 4, 5, 6, 7>(row[1], row[5]);
    const auto r26 = shuffle<0, 1, 2, 3, 4, 5, 6, 7>(row[2], row[6]);
    const auto r37 = shuffle<0, 1, 2, 3, 4, 5, 6, 7>(row[3], row[7]);
    const auto xz01 = shuffle<0, 8, 2, 10, 4, 12, 6, 14>(r04, r15), yw01 = shuffle<1, 9, 3, 11, 5, 13, 7, 15>(r04, r15);
    const auto xz23 = shuffle<0, 8, 2, 10, 4, 12, 6, 14>(r26, r37), yw23 = shuffle<1, 9, 3, 11, 5, 13, 7, 15>(r26, r37);
    out[0] = shuffle<0, 1, 8, 9, 4, 5, 12, 13>(xz01, xz23);
    out[1] = shuffle<0, 1, 8, 9, 4, 5, 12, 13>(yw01, yw23);
    out[2] = shuffle<2, 3, 10, 11, 6, 7, 14, 15>(xz01, xz23);
    if constexpr (Columns == 4) out[3] = shuffle<2, 3, 10, 11, 6, 7, 14, 15>(yw01, yw23);
  } else if constexpr (Target::bytes == 32) {
    unroll<2>([&](auto half) ORBIS_INLINE_LAMBDA {
      const auto part = [&](int k) ORBIS_INLINE_LAMBDA -> quarter& { return half == 0 ? out[k].v.low : out[k].v.high; };
      quarter row[4];
      unroll<4>([&](auto i) ORBIS_INLINE_LAMBDA { row[i] = quarter::load(from[4 * half + i]); });
      const auto xz01 = shuffle<0, 4, 2, 6>(row[0], row[1]), yw01 = shuffle<1, 5, 3, 7>(row[0], row[1]);
      const auto xz23 = shuffle<0, 4, 2, 6>(row[2], row[3]), yw23 = shuffle<1, 5, 3, 7>(row[2], row[3]);
      part(0) = shuffle<0, 1, 4, 5>(xz01, xz23);
      part(1) = shuffle<0, 1, 4, 5>(yw01, yw23);
      part(2) = shuffle<2, 3, 6, 7>(xz01, xz23);
      if constexpr (Columns == 4) part(3) = shuffle<2, 3, 6, 7>(yw01, yw23);
    });
  } else {
    double columns[Columns][8];
    for (int i = 0; i != 8; ++i)
      for (int k = 0; k != Columns; ++k) columns[k][i] = from[i][k];
    for (int k = 0; k != Columns; ++k) out[k] = simd::vec<double, 8, Target>::load(columns[k]);
  }
}

/// Transposes four columns of eight numbers to eight rows of four: calls `f(i, row)` with i from 0 to 7.
template <simd::target Target, class F>
ORBIS_ALWAYS_INLINE void for_each_row(const simd::vec<double, 8, Target>& a, const simd::vec<double, 8, Target>& b,
                                      const simd::vec<double, 8, Target>& c, const simd::vec<double, 8, Target>& d,
                                      const F& f) {
  using quarter = simd::vec<double, 4, Target>;
  using simd::shuffle;
  if constexpr (Target::bytes == 64) {
    const auto ab0 = shuffle<0, 8, 2, 10, 4, 12, 6, 14>(a, b), ab1 = shuffle<1, 9, 3, 11, 5, 13, 7, 15>(a, b);
    const auto cd0 = shuffle<0, 8, 2, 10, 4, 12, 6, 14>(c, d), cd1 = shuffle<1, 9, 3, 11, 5, 13, 7, 15>(c, d);
    const auto r04 = shuffle<0, 1, 8, 9, 4, 5, 12, 13>(ab0, cd0), r15 = shuffle<0, 1, 8, 9, 4, 5, 12, 13>(ab1, cd1);
    const auto r26 = shuffle<2, 3, 10, 11, 6, 7, 14, 15>(ab0, cd0), r37 = shuffle<2, 3, 10, 11, 6, 7, 14, 15>(ab1, cd1);
    f(0, r04.low()), f(1, r15.low()), f(2, r26.low()), f(3, r37.low());
    f(4, r04.high()), f(5, r15.high()), f(6, r26.high()), f(7, r37.high());
  } else if constexpr (Target::bytes == 32) {
    const auto part = [&](const quarter& x, const quarter& y, const quarter& z, const quarter& w, int first)
                          ORBIS_INLINE_LAMBDA {
                            const auto xy0 = shuffle<0, 4, 2, 6>(x, y), xy1 = shuffle<1, 5, 3, 7>(x, y);
                            const auto zw0 = shuffle<0, 4, 2, 6>(z, w), zw1 = shuffle<1, 5, 3, 7>(z, w);
                            f(first, shuffle<0, 1, 4, 5>(xy0, zw0)), f(first + 1, shuffle<0, 1, 4, 5>(xy1, zw1));
                            f(first + 2, shuffle<2, 3, 6, 7>(xy0, zw0)), f(first + 3, shuffle<2, 3, 6, 7>(xy1, zw1));
                          };
    part(a.v.low, b.v.low, c.v.low, d.v.low, 0);
    part(a.v.high, b.v.high, c.v.high, d.v.high, 4);
  } else {
    double columns[4][8];
    a.store(columns[0]), b.store(columns[1]), c.store(columns[2]), d.store(columns[3]);
    for (int i = 0; i != 8; ++i) {
      double row[4];
      for (int k = 0; k != 4; ++k) row[k] = columns[k][i];
      f(i, quarter::load(row));
    }
  }
}

/// Writes four columns of eight numbers as eight rows of four: row i is written to `to[i] + offset`.
template <simd::target Target>
ORBIS_ALWAYS_INLINE void store_transposed(const simd::vec<double, 8, Target>& a, const simd::vec<double, 8, Target>& b,
                                          const simd::vec<double, 8, Target>& c, const simd::vec<double, 8, Target>& d,
                                          double* const* to, int offset) {
  for_each_row(a, b, c, d, [&](int i, const auto& row) ORBIS_INLINE_LAMBDA { row.store(to[i] + offset); });
}
/// Like `store_transposed`, but adds the rows to memory; destinations may coincide.
template <simd::target Target>
ORBIS_ALWAYS_INLINE void add_transposed(const simd::vec<double, 8, Target>& a, const simd::vec<double, 8, Target>& b,
                                        const simd::vec<double, 8, Target>& c, const simd::vec<double, 8, Target>& d,
                                        double* const* to, int offset) {
  for_each_row(a, b, c, d, [&](int i, const auto& row) ORBIS_INLINE_LAMBDA {
    double* const at = to[i] + offset;
    (simd::vec<double, 4, Target>::load(at) + row).store(at);
  });
}

}  // namespace orbis::optimize::detail
