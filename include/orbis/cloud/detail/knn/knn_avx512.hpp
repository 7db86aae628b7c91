// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The inner loops of `knn_kernels.hpp`, sixteen distances at a time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/rank_bracket.hpp>
#include <orbis/core/simd.hpp>

#if ORBIS_X86
#include <immintrin.h>

namespace orbis::cloud::detail {

/// For the masked forms of instructions, which g++ 12 does not warn of.
inline constexpr __mmask16 all_lanes = 0xffff;

/// `(x^2 + y^2) + z^2`, each operation rounded: `squared_distance` in lanes.
ORBIS_TARGET("avx512f")
inline __m512 sum_of_squares_avx512(__m512 x, __m512 y, __m512 z) noexcept {
  __m512 xx = _mm512_mul_ps(x, x);
  __m512 yy = _mm512_mul_ps(y, y);
  __m512 zz = _mm512_mul_ps(z, z);
#if !defined(__clang__)
  asm("" : "+v"(xx), "+v"(yy), "+v"(zz));  // or else they become halves of fused multiply-adds
#endif
  return _mm512_add_ps(_mm512_add_ps(xx, yy), zz);
}

/// Squared distances between sixteen boxes and the one between `low` and `high`.
ORBIS_TARGET("avx512f")
inline __m512 box_distances_avx512(const box_row& boxes, const __m512* low, const __m512* high) noexcept {
  const auto gap = [&](std::size_t a) ORBIS_TARGET("avx512f") {
    const __m512 below = _mm512_sub_ps(_mm512_load_ps(boxes.low[a].data()), high[a]);
    const __m512 above = _mm512_sub_ps(low[a], _mm512_load_ps(boxes.high[a].data()));
    return _mm512_maskz_max_ps(all_lanes, _mm512_maskz_max_ps(all_lanes, below, above), _mm512_setzero_ps());
  };
  return sum_of_squares_avx512(gap(0), gap(1), gap(2));
}

ORBIS_TARGET("avx512f")
inline std::uint32_t near_boxes_avx512(const box_row& boxes, const box3& query, float bound, float* distance) {
  __m512 low[3];
  __m512 high[3];
  for (std::size_t a = 0; a != 3; ++a) {
    low[a] = _mm512_set1_ps(query.low[a]);
    high[a] = _mm512_set1_ps(query.high[a]);
  }
  const __m512 d = box_distances_avx512(boxes, low, high);
  _mm512_storeu_ps(distance, d);
  return _mm512_cmp_ps_mask(d, _mm512_set1_ps(bound), _CMP_LE_OQ);
}

ORBIS_TARGET("avx512f")
inline void gather_avx512(const box_row& boxes, std::uint32_t mask, std::uint32_t first, nearby_leaves& near) {
  const auto wanted = static_cast<__mmask16>(mask);
  // What does not fit into the row goes to the next.
  const std::size_t at = near.count % leaf_width;
  box_row& row = near.boxes[near.count / leaf_width];
  box_row& next = near.boxes[near.count / leaf_width + 1];
  const auto number = static_cast<std::size_t>(std::popcount(mask));
  const __m512i lanes = _mm512_set_epi32(15, 14, 13, 12, 11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0);
  const __m512i turn = _mm512_sub_epi32(lanes, _mm512_set1_epi32(static_cast<int>(at)));  // taken modulo 16
  const std::uint32_t places = ((1U << number) - 1) << at;
  const auto put = [&](const float* from, float* to, float* beyond) ORBIS_TARGET("avx512f") {
    const __m512 turned =
        _mm512_maskz_permutexvar_ps(all_lanes, turn, _mm512_maskz_compress_ps(wanted, _mm512_load_ps(from)));
    _mm512_mask_store_ps(to, static_cast<__mmask16>(places), turned);
    _mm512_mask_store_ps(beyond, static_cast<__mmask16>(places >> 16U), turned);
  };
  for (std::size_t a = 0; a != 3; ++a) {
    put(boxes.low[a].data(), row.low[a].data(), next.low[a].data());
    put(boxes.high[a].data(), row.high[a].data(), next.high[a].data());
  }
  const __m512i leaf = _mm512_add_epi32(lanes, _mm512_set1_epi32(static_cast<int>(first)));
  _mm512_storeu_si512(near.leaves.data() + near.count, _mm512_maskz_compress_epi32(wanted, leaf));
  near.count += number;
}

ORBIS_TARGET("avx512f")
inline std::size_t keep_within_avx512(const point_row& leaf, const __m512* query, __m512 bound, float* found) noexcept {
  const auto difference = [&](std::size_t a) ORBIS_TARGET("avx512f") {
    return _mm512_sub_ps(query[a], _mm512_load_ps(leaf.axis[a].data()));
  };
  const __m512 d = sum_of_squares_avx512(difference(0), difference(1), difference(2));
  const __mmask16 within = _mm512_cmp_ps_mask(d, bound, _CMP_LE_OQ);
  _mm512_storeu_ps(found, _mm512_maskz_compress_ps(within, d));
  return static_cast<std::size_t>(__builtin_popcount(within));
}

ORBIS_TARGET("avx512f")
inline std::uint32_t distances_avx512(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                      float* distance) {
  const auto difference = [&](std::size_t a) ORBIS_TARGET("avx512f") {
    return _mm512_sub_ps(_mm512_set1_ps(query[a]), _mm512_load_ps(leaf.axis[a].data()));
  };
  const __m512 d = sum_of_squares_avx512(difference(0), difference(1), difference(2));
  _mm512_storeu_ps(distance, d);
  return _mm512_cmp_ps_mask(d, _mm512_set1_ps(bound), _CMP_LE_OQ);
}

ORBIS_TARGET("avx512f,popcnt")
inline std::size_t in_leaf_avx512(const point_row& leaf, const std::array<float, 3>& query, float bound, float* found) {
  const __m512 q[3] = {_mm512_set1_ps(query[0]), _mm512_set1_ps(query[1]), _mm512_set1_ps(query[2])};
  return keep_within_avx512(leaf, q, _mm512_set1_ps(bound), found);
}

ORBIS_TARGET("avx512f,popcnt")
inline std::size_t near_points_avx512(const point_row* leaves, const nearby_leaves& near,
                                      const std::array<float, 3>& query, float bound, std::uint32_t* scratch,
                                      float* found, std::size_t capacity) {
  const __m512 q[3] = {_mm512_set1_ps(query[0]), _mm512_set1_ps(query[1]), _mm512_set1_ps(query[2])};
  const __m512 within = _mm512_set1_ps(bound);
  std::size_t chosen = 0;
  for (std::size_t first = 0; first < near.count; first += leaf_width) {
    const __m512 d = box_distances_avx512(near.boxes[first / leaf_width], q, q);
    const __mmask16 mask = _mm512_cmp_ps_mask(d, within, _CMP_LE_OQ);
    _mm512_storeu_si512(scratch + chosen,
                        _mm512_maskz_compress_epi32(mask, _mm512_loadu_si512(near.leaves.data() + first)));
    chosen += static_cast<std::size_t>(__builtin_popcount(mask));
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i != chosen; ++i) {
    count += keep_within_avx512(leaves[scratch[i]], q, within, found + count);
    if (count > capacity) break;
  }
  _mm512_storeu_ps(found + count, _mm512_set1_ps(std::numeric_limits<float>::infinity()));
  return count;
}

template <int Half>
ORBIS_TARGET("avx512f")
inline __m256 half_avx512(__m512 v) noexcept {
  return _mm256_castpd_ps(_mm512_maskz_extractf64x4_pd(0xff, _mm512_castps_pd(v), Half));
}

/// `sum + v`, in double.
ORBIS_TARGET("avx512f")
inline __m512d add_wide_avx512(__m512d sum, __m512 v) noexcept {
  sum = _mm512_add_pd(sum, _mm512_maskz_cvtps_pd(0xff, half_avx512<0>(v)));
  return _mm512_add_pd(sum, _mm512_maskz_cvtps_pd(0xff, half_avx512<1>(v)));
}

ORBIS_TARGET("avx512f")
inline double total_avx512(__m512d v) noexcept {
  const __m256d d = _mm256_add_pd(_mm512_maskz_extractf64x4_pd(0xff, v, 0), _mm512_maskz_extractf64x4_pd(0xff, v, 1));
  const __m128d pair = _mm_add_pd(_mm256_castpd256_pd128(d), _mm256_extractf128_pd(d, 1));
  return _mm_cvtsd_f64(_mm_add_sd(pair, _mm_unpackhi_pd(pair, pair)));
}

/// The `rank`-th smallest (from 1) of sixteen values.
ORBIS_TARGET("avx512f")
inline float ranked_avx512(const float* values, std::size_t rank) noexcept {
  const __m512 v = _mm512_loadu_ps(values);
  const __m512i one = _mm512_set1_epi32(1);
  __m512i smaller = _mm512_setzero_si512();  // for each value, how many are
  __m512i smaller2 = _mm512_setzero_si512();
  for (std::size_t i = 0; i != leaf_width; i += 2) {
    smaller =
        _mm512_mask_add_epi32(smaller, _mm512_cmp_ps_mask(_mm512_set1_ps(values[i]), v, _CMP_LT_OQ), smaller, one);
    smaller2 = _mm512_mask_add_epi32(smaller2, _mm512_cmp_ps_mask(_mm512_set1_ps(values[i + 1]), v, _CMP_LT_OQ),
                                     smaller2, one);
  }
  const __mmask16 up_to =
      _mm512_cmplt_epi32_mask(_mm512_add_epi32(smaller, smaller2), _mm512_set1_epi32(static_cast<int>(rank)));
  const __m512 low = _mm512_maskz_mov_ps(up_to, v);
  const __m256 m8 = _mm256_max_ps(half_avx512<0>(low), half_avx512<1>(low));
  __m128 m = _mm_max_ps(_mm256_castps256_ps128(m8), _mm256_extractf128_ps(m8, 1));
  m = _mm_max_ps(m, _mm_movehl_ps(m, m));
  return _mm_cvtss_f32(_mm_max_ss(m, _mm_shuffle_ps(m, m, 1)));
}

ORBIS_TARGET("avx512f,popcnt")
inline nearest_sum sum_nearest_avx512(float* found, std::size_t count, std::size_t wanted, float bound) {
  const __m512 inf = _mm512_set1_ps(std::numeric_limits<float>::infinity());
  const auto count_within = [&](float at) ORBIS_TARGET("avx512f,popcnt") {
    const __m512 border = _mm512_set1_ps(at);
    std::size_t n = 0;
    for (std::size_t i = 0; i < count; i += leaf_width) {
      n += static_cast<std::size_t>(
          __builtin_popcount(_mm512_cmp_ps_mask(_mm512_loadu_ps(found + i), border, _CMP_LE_OQ)));
    }
    return n;
  };
  const auto count_three = [&](const std::array<float, 3>& at) ORBIS_TARGET("avx512f,popcnt") {
    const __m512 border[3] = {_mm512_set1_ps(at[0]), _mm512_set1_ps(at[1]), _mm512_set1_ps(at[2])};
    std::array<std::size_t, 3> n{};
    for (std::size_t i = 0; i < count; i += leaf_width) {
      const __m512 v = _mm512_loadu_ps(found + i);
      n[0] += static_cast<std::size_t>(__builtin_popcount(_mm512_cmp_ps_mask(v, border[0], _CMP_LE_OQ)));
      n[1] += static_cast<std::size_t>(__builtin_popcount(_mm512_cmp_ps_mask(v, border[1], _CMP_LE_OQ)));
      n[2] += static_cast<std::size_t>(__builtin_popcount(_mm512_cmp_ps_mask(v, border[2], _CMP_LE_OQ)));
    }
    return n;
  };
  const rank_bracket bracket = bracket_rank(bound, count, wanted, count_within, count_three);
  nearest_sum out;
  out.largest_squared = bracket.high;
  if (bracket.at_high - bracket.at_low <= leaf_width) {
    std::array<float, 2 * leaf_width> between;
    const __m512 low = _mm512_set1_ps(bracket.low);
    const __m512 high = _mm512_set1_ps(bracket.high);
    std::size_t n = 0;
    for (std::size_t i = 0; i < count; i += leaf_width) {
      const __m512 v = _mm512_loadu_ps(found + i);
      const __mmask16 in = _mm512_mask_cmp_ps_mask(_mm512_cmp_ps_mask(v, high, _CMP_LE_OQ), v, low, _CMP_GT_OQ);
      _mm512_storeu_ps(between.data() + n, _mm512_maskz_compress_ps(in, v));
      n += static_cast<std::size_t>(__builtin_popcount(in));
    }
    _mm512_storeu_ps(between.data() + n, inf);
    out.largest_squared = ranked_avx512(between.data(), wanted - bracket.at_low);
  }

  // Roots to twice the precision of float: s = v / sqrt(v) with a Newton step, and the remainder
  // v - s^2, which a fused multiply-add gives exactly enough, as a correction.
  const __m512 border = _mm512_set1_ps(out.largest_squared);
  const __m512 smallest = _mm512_set1_ps(0x1p-70F);  // below this, remainders underflow
  const __m512 half = _mm512_set1_ps(0.5F);
  __m512d sum = _mm512_setzero_pd();
  __m512 corrections = _mm512_setzero_ps();
  std::size_t smaller = 0;
  std::uint32_t tiny = 0;
  for (std::size_t i = 0; i < count; i += leaf_width) {
    const __m512 v = _mm512_loadu_ps(found + i);
    const __mmask16 in = _mm512_cmp_ps_mask(v, border, _CMP_LT_OQ);
    smaller += static_cast<std::size_t>(__builtin_popcount(in));
    const __mmask16 usual = _mm512_mask_cmp_ps_mask(in, v, smallest, _CMP_GE_OQ);
    tiny |= _mm512_mask_cmp_ps_mask(static_cast<__mmask16>(in & ~usual), v, _mm512_setzero_ps(), _CMP_GT_OQ);
    const __m512 y0 = _mm512_maskz_rsqrt14_ps(usual, v);
    const __m512 vz = _mm512_maskz_mov_ps(usual, v);
    const __m512 h = _mm512_mul_ps(half, y0);
    const __m512 y = _mm512_fmadd_ps(y0, _mm512_fnmadd_ps(_mm512_mul_ps(h, vz), y0, half), y0);
    const __m512 s = _mm512_mul_ps(vz, y);
    const __m512 rest = _mm512_fnmadd_ps(s, s, vz);
    corrections = _mm512_fmadd_ps(rest, _mm512_mul_ps(half, y), corrections);
    sum = add_wide_avx512(sum, s);
  }
  sum = add_wide_avx512(sum, corrections);
  const double border_root = std::sqrt(double{out.largest_squared});
  out.roots = tiny != 0 ? -1.0 : total_avx512(sum) + static_cast<double>(wanted - smaller) * border_root;
  return out;
}

}  // namespace orbis::cloud::detail
#endif
