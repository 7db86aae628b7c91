// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two inner loops of a blocked Cholesky factorisation, on column-major panels whose block columns are `N` wide.
/// Every instruction set gives the same bits: the terms of each element are added in the same order, without fused
/// multiply-adds.
#pragma once

#include <cstddef>

#include <orbis/core/rounded.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/detail/unroll.hpp>

namespace orbis::optimize::detail {

/// The number of rows beyond the last that a kernel may read and write: the padding at the end of a panel.
inline constexpr std::size_t panel_slack = 16;

/// Computes `out = A B^T`: A has `rows` rows, B has N; both have `depth` columns, `stride` apart. `out` has N columns,
/// `out_stride` apart, and room for `rows` rounded up to `panel_slack`.
using panel_product = void(const double* a, const double* b, std::size_t stride, std::size_t rows, std::size_t depth,
                           double* out, std::size_t out_stride);

/// Computes `X = X L^-T` for the `rows` rows of X below the N x N lower triangle L, both in columns `stride` apart;
/// `inverse_diagonal` contains 1 / L(j, j). Writes nothing beyond `rows`.
using panel_solve = void(const double* l, const double* inverse_diagonal, std::size_t stride, double* x,
                         std::size_t rows);

template <int N>
struct panel_product_kernel {
  /// Number of columns of the product that are computed in one pass, with the sums in registers; further passes compute
  /// the remaining columns.
  static constexpr int columns = N <= 9 ? N : 8;

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const double* a, const double* b, std::size_t stride, std::size_t rows,
                                      std::size_t depth, double* out, std::size_t out_stride) {
    using strip = simd::vec<double, 2 * Target::bytes / sizeof(double), Target>;  // two registers
    for (std::size_t i = 0; i < rows; i += strip::count) {
      strip sum[columns];
      unroll<columns>([&](auto j) ORBIS_INLINE_LAMBDA { sum[j] = 0.0; });
      const double* column = a + i;
      const double* factor = b;
      for (std::size_t k = 0; k != depth; ++k, column += stride, factor += stride) {
        const strip x = strip::load(column);
        unroll<columns>([&](auto j) ORBIS_INLINE_LAMBDA { sum[j] += x * strip(factor[j]); });
      }
      unroll<columns>([&](auto j) ORBIS_INLINE_LAMBDA { sum[j].store(out + j * out_stride + i); });
    }
    if constexpr (columns != N)
      panel_product_kernel<N - columns>::template run<Target>(a, b + columns, stride, rows, depth,
                                                              out + columns * out_stride, out_stride);
  }
};

template <int N>
struct panel_solve_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const double* l, const double* inverse_diagonal, std::size_t stride, double* x,
                                      std::size_t rows) {
    using strip = simd::vec<double, 4, Target>;
    const std::size_t whole = rows - rows % strip::count;
    for (std::size_t j = 0; j != N; ++j) {
      for (std::size_t i = 0; i != whole; i += strip::count) {
        strip value = strip::load(x + j * stride + i);
        for (std::size_t k = 0; k != j; ++k) value -= strip::load(x + k * stride + i) * strip(l[k * stride + j]);
        (value * strip(inverse_diagonal[j])).store(x + j * stride + i);
      }
      for (std::size_t i = whole; i != rows; ++i) {
        double value = x[j * stride + i];
        for (std::size_t k = 0; k != j; ++k) value -= rounded_product(x[k * stride + i], l[k * stride + j]);
        x[j * stride + i] = value * inverse_diagonal[j];
      }
    }
  }
};

/// Pointers to the kernels for this processor's instruction set.
template <int N>
struct panel_kernels {
  panel_product* product;
  panel_solve* solve;
  panel_kernels();
};
template <int N>
panel_kernels<N>::panel_kernels()
    : product{simd::kernel<panel_product_kernel<N>, panel_product>()},
      solve{simd::kernel<panel_solve_kernel<N>, panel_solve, simd::avx2>()} {}

}  // namespace orbis::optimize::detail
