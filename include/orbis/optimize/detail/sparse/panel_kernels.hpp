// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two inner loops of a blocked Cholesky factorisation, on column-major panels whose block columns are `N` wide.
/// Every instruction set gives the same bits: each element is a sum in the same order, without fused multiply-adds.
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include <orbis/core/rounded.hpp>
#include <orbis/core/simd.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::optimize::detail {

/// The number of rows that a kernel may read and write beyond the last: panels have this much room after their end.
inline constexpr std::size_t panel_slack = 16;

/// `out = A B^T`: A has `rows` rows, B has N; both have `depth` columns `stride` apart. `out` has N
/// columns, `out_stride` apart, and room for `rows` rounded up to `panel_slack`.
using panel_product = void(const double* a, const double* b, std::size_t stride, std::size_t rows, std::size_t depth,
                           double* out, std::size_t out_stride);

/// The number of columns of a product that are computed at once, as sums in registers; the rest of the N follows.
template <std::size_t N>
inline constexpr std::size_t product_columns = N <= 9 ? N : 8;

/// `X = X L^-T` for the `rows` rows of X below the N x N lower triangle L, both in columns `stride`
/// apart; `inverse_diagonal` has 1 / L(j, j). Beyond `rows` nothing is written.
using panel_solve = void(const double* l, const double* inverse_diagonal, std::size_t stride, double* x,
                         std::size_t rows);

template <std::size_t N>
void panel_product_portable(const double* a, const double* b, std::size_t stride, std::size_t rows, std::size_t depth,
                            double* out, std::size_t out_stride) {
  constexpr std::size_t strip = 4;
  for (std::size_t i = 0; i < rows; i += strip) {
    double sum[N][strip] = {};
    for (std::size_t k = 0; k != depth; ++k)
      for (std::size_t j = 0; j != N; ++j)
        for (std::size_t r = 0; r != strip; ++r) sum[j][r] += rounded_product(a[k * stride + i + r], b[k * stride + j]);
    for (std::size_t j = 0; j != N; ++j) std::copy(sum[j], sum[j] + strip, out + j * out_stride + i);
  }
}

template <std::size_t N>
void panel_solve_portable(const double* l, const double* inverse_diagonal, std::size_t stride, double* x,
                          std::size_t rows) {
  for (std::size_t j = 0; j != N; ++j)
    for (std::size_t i = 0; i != rows; ++i) {
      double value = x[j * stride + i];
      for (std::size_t k = 0; k != j; ++k) value -= rounded_product(x[k * stride + i], l[k * stride + j]);
      x[j * stride + i] = value * inverse_diagonal[j];
    }
}

#if ORBIS_X86

ORBIS_TARGET("avx2")
inline __m256d rounded_avx2(__m256d a, __m256d b) noexcept {
  __m256d product = _mm256_mul_pd(a, b);
#if !defined(__clang__)
  asm("" : "+x"(product));  // or else it becomes half of a fused multiply-add under -march=native
#endif
  return product;
}

template <std::size_t... J>
ORBIS_TARGET("avx2")
void product_strips_avx2(std::index_sequence<J...>, const double* a, const double* b, std::size_t stride,
                         std::size_t rows, std::size_t depth, double* out, std::size_t out_stride) {
  for (std::size_t i = 0; i < rows; i += 8) {
    __m256d low[sizeof...(J)] = {(static_cast<void>(J), _mm256_setzero_pd())...};
    __m256d high[sizeof...(J)] = {(static_cast<void>(J), _mm256_setzero_pd())...};
    const double* column = a + i;
    const double* factor = b;
    for (std::size_t k = 0; k != depth; ++k, column += stride, factor += stride) {
      const __m256d x = _mm256_loadu_pd(column);
      const __m256d y = _mm256_loadu_pd(column + 4);
      ((low[J] = _mm256_add_pd(low[J], rounded_avx2(x, _mm256_broadcast_sd(factor + J))),
        high[J] = _mm256_add_pd(high[J], rounded_avx2(y, _mm256_broadcast_sd(factor + J)))),
       ...);
    }
    ((_mm256_storeu_pd(out + J * out_stride + i, low[J]), _mm256_storeu_pd(out + J * out_stride + i + 4, high[J])),
     ...);
  }
}

template <std::size_t N>
ORBIS_TARGET("avx2")
void panel_product_avx2(const double* a, const double* b, std::size_t stride, std::size_t rows, std::size_t depth,
                        double* out, std::size_t out_stride) {
  product_strips_avx2(std::make_index_sequence<product_columns<N>>{}, a, b, stride, rows, depth, out, out_stride);
  if constexpr (constexpr std::size_t done = product_columns<N>; done != N)
    panel_product_avx2<N - done>(a, b + done, stride, rows, depth, out + done * out_stride, out_stride);
}

template <std::size_t N>
ORBIS_TARGET("avx2")
void panel_solve_avx2(const double* l, const double* inverse_diagonal, std::size_t stride, double* x,
                      std::size_t rows) {
  const std::size_t whole = rows - rows % 4;
  for (std::size_t j = 0; j != N; ++j)
    for (std::size_t i = 0; i != whole; i += 4) {
      __m256d value = _mm256_loadu_pd(x + j * stride + i);
      for (std::size_t k = 0; k != j; ++k)
        value = _mm256_sub_pd(
            value, rounded_avx2(_mm256_loadu_pd(x + k * stride + i), _mm256_broadcast_sd(l + k * stride + j)));
      _mm256_storeu_pd(x + j * stride + i, _mm256_mul_pd(value, _mm256_broadcast_sd(inverse_diagonal + j)));
    }
  panel_solve_portable<N>(l, inverse_diagonal, stride, x + whole, rows - whole);
}

ORBIS_TARGET("avx512f")
inline __m512d rounded_avx512(__m512d a, __m512d b) noexcept {
  __m512d product = _mm512_mul_pd(a, b);
#if !defined(__clang__)
  asm("" : "+v"(product));  // avx512f has the fused multiply-add
#endif
  return product;
}

template <std::size_t... J>
ORBIS_TARGET("avx512f")
void product_strips_avx512(std::index_sequence<J...>, const double* a, const double* b, std::size_t stride,
                           std::size_t rows, std::size_t depth, double* out, std::size_t out_stride) {
  for (std::size_t i = 0; i < rows; i += 16) {
    __m512d low[sizeof...(J)] = {(static_cast<void>(J), _mm512_setzero_pd())...};
    __m512d high[sizeof...(J)] = {(static_cast<void>(J), _mm512_setzero_pd())...};
    const double* column = a + i;
    const double* factor = b;
    for (std::size_t k = 0; k != depth; ++k, column += stride, factor += stride) {
      const __m512d x = _mm512_loadu_pd(column);
      const __m512d y = _mm512_loadu_pd(column + 8);
      ((low[J] = _mm512_add_pd(low[J], rounded_avx512(x, _mm512_set1_pd(factor[J]))),
        high[J] = _mm512_add_pd(high[J], rounded_avx512(y, _mm512_set1_pd(factor[J])))),
       ...);
    }
    ((_mm512_storeu_pd(out + J * out_stride + i, low[J]), _mm512_storeu_pd(out + J * out_stride + i + 8, high[J])),
     ...);
  }
}

template <std::size_t N>
ORBIS_TARGET("avx512f")
void panel_product_avx512(const double* a, const double* b, std::size_t stride, std::size_t rows, std::size_t depth,
                          double* out, std::size_t out_stride) {
  product_strips_avx512(std::make_index_sequence<product_columns<N>>{}, a, b, stride, rows, depth, out, out_stride);
  if constexpr (constexpr std::size_t done = product_columns<N>; done != N)
    panel_product_avx512<N - done>(a, b + done, stride, rows, depth, out + done * out_stride, out_stride);
}
#endif

/// The kernels for one instruction set, or the best below it that the processor has.
template <std::size_t N>
struct panel_kernels {
  panel_product* product;
  panel_solve* solve;

  [[nodiscard]] static panel_kernels at(simd::level level) {
#if ORBIS_X86
    return {simd::select<panel_product>(level, {.portable = panel_product_portable<N>,
                                                .avx2 = panel_product_avx2<N>,
                                                .avx512 = panel_product_avx512<N>}),
            simd::select<panel_solve>(level, {.portable = panel_solve_portable<N>, .avx2 = panel_solve_avx2<N>})};
#else
    static_cast<void>(level);
    return {panel_product_portable<N>, panel_solve_portable<N>};
#endif
  }
};

}  // namespace orbis::optimize::detail
