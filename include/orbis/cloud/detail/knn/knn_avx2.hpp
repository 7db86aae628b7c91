// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The inner loops of `knn_kernels.hpp`, eight distances at a time.
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

/// For each mask of eight bits the lanes that it names, from the lowest on.
struct lane_table {
  std::array<std::array<std::uint8_t, 8>, 256> lanes{};
  constexpr lane_table() {
    for (std::uint32_t mask = 0; mask != 256; ++mask) {
      std::size_t n = 0;
      for (std::uint8_t lane = 0; lane != 8; ++lane) {
        if ((mask >> lane & 1U) != 0) lanes[mask][n++] = lane;
      }
    }
  }
};
alignas(64) inline constexpr lane_table lanes_of_mask;

/// `squared_distance` in lanes.
ORBIS_TARGET("avx2")
inline __m256 sum_of_squares_avx2(__m256 x, __m256 y, __m256 z) noexcept {
  __m256 xx = _mm256_mul_ps(x, x);
  __m256 yy = _mm256_mul_ps(y, y);
  __m256 zz = _mm256_mul_ps(z, z);
#if !defined(__clang__)
  asm("" : "+x"(xx), "+x"(yy), "+x"(zz));  // or else they become halves of fused multiply-adds
#endif
  return _mm256_add_ps(_mm256_add_ps(xx, yy), zz);
}

ORBIS_TARGET("avx2")
inline __m256i compacting_avx2(std::uint32_t mask) noexcept {
  return _mm256_cvtepu8_epi32(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(lanes_of_mask.lanes[mask].data())));
}

/// Squared distances between boxes `at` ... `at + 7` of a row and the one between `low` and `high`.
ORBIS_TARGET("avx2")
inline __m256 box_distances_avx2(const box_row& boxes, std::size_t at, const __m256* low, const __m256* high) noexcept {
  const auto gap = [&](std::size_t a) ORBIS_TARGET("avx2") {
    const __m256 below = _mm256_sub_ps(_mm256_load_ps(boxes.low[a].data() + at), high[a]);
    const __m256 above = _mm256_sub_ps(low[a], _mm256_load_ps(boxes.high[a].data() + at));
    return _mm256_max_ps(_mm256_max_ps(below, above), _mm256_setzero_ps());
  };
  return sum_of_squares_avx2(gap(0), gap(1), gap(2));
}

ORBIS_TARGET("avx2")
inline std::uint32_t mask_avx2(__m256 truth) noexcept { return static_cast<std::uint32_t>(_mm256_movemask_ps(truth)); }

ORBIS_TARGET("avx2")
inline std::uint32_t near_boxes_avx2(const box_row& boxes, const box3& query, float bound, float* distance) {
  __m256 low[3];
  __m256 high[3];
  for (std::size_t a = 0; a != 3; ++a) {
    low[a] = _mm256_set1_ps(query.low[a]);
    high[a] = _mm256_set1_ps(query.high[a]);
  }
  std::uint32_t mask = 0;
  for (std::size_t at = 0; at != leaf_width; at += 8) {
    const __m256 d = box_distances_avx2(boxes, at, low, high);
    _mm256_storeu_ps(distance + at, d);
    mask |= mask_avx2(_mm256_cmp_ps(d, _mm256_set1_ps(bound), _CMP_LE_OQ)) << at;
  }
  return mask;
}

ORBIS_TARGET("avx2,popcnt")
inline std::size_t keep_within_avx2(const point_row& leaf, const __m256* query, __m256 bound, float* found) noexcept {
  std::size_t count = 0;
  for (std::size_t at = 0; at != leaf_width; at += 8) {
    const auto difference = [&](std::size_t a) ORBIS_TARGET("avx2") {
      return _mm256_sub_ps(query[a], _mm256_load_ps(leaf.axis[a].data() + at));
    };
    const __m256 d = sum_of_squares_avx2(difference(0), difference(1), difference(2));
    const std::uint32_t within = mask_avx2(_mm256_cmp_ps(d, bound, _CMP_LE_OQ));
    _mm256_storeu_ps(found + count, _mm256_permutevar8x32_ps(d, compacting_avx2(within)));
    count += static_cast<std::size_t>(__builtin_popcount(within));
  }
  return count;
}

ORBIS_TARGET("avx2")
inline std::uint32_t distances_avx2(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                    float* distance) {
  std::uint32_t mask = 0;
  for (std::size_t at = 0; at != leaf_width; at += 8) {
    const auto difference = [&](std::size_t a) ORBIS_TARGET("avx2") {
      return _mm256_sub_ps(_mm256_set1_ps(query[a]), _mm256_load_ps(leaf.axis[a].data() + at));
    };
    const __m256 d = sum_of_squares_avx2(difference(0), difference(1), difference(2));
    _mm256_storeu_ps(distance + at, d);
    mask |= mask_avx2(_mm256_cmp_ps(d, _mm256_set1_ps(bound), _CMP_LE_OQ)) << at;
  }
  return mask;
}

ORBIS_TARGET("avx2,popcnt")
inline std::size_t in_leaf_avx2(const point_row& leaf, const std::array<float, 3>& query, float bound, float* found) {
  const __m256 q[3] = {_mm256_set1_ps(query[0]), _mm256_set1_ps(query[1]), _mm256_set1_ps(query[2])};
  return keep_within_avx2(leaf, q, _mm256_set1_ps(bound), found);
}

ORBIS_TARGET("avx2,popcnt")
inline std::size_t near_points_avx2(const point_row* leaves, const nearby_leaves& near,
                                    const std::array<float, 3>& query, float bound, std::uint32_t* scratch,
                                    float* found, std::size_t capacity) {
  const __m256 q[3] = {_mm256_set1_ps(query[0]), _mm256_set1_ps(query[1]), _mm256_set1_ps(query[2])};
  const __m256 within = _mm256_set1_ps(bound);
  std::size_t chosen = 0;
  for (std::size_t first = 0; first < near.count; first += 8) {
    const __m256 d = box_distances_avx2(near.boxes[first / leaf_width], first % leaf_width, q, q);
    const std::uint32_t mask = mask_avx2(_mm256_cmp_ps(d, within, _CMP_LE_OQ));
    const __m256i leaf = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(near.leaves.data() + first));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(scratch + chosen),
                        _mm256_permutevar8x32_epi32(leaf, compacting_avx2(mask)));
    chosen += static_cast<std::size_t>(__builtin_popcount(mask));
  }
  std::size_t count = 0;
  for (std::size_t i = 0; i != chosen; ++i) {
    count += keep_within_avx2(leaves[scratch[i]], q, within, found + count);
    if (count > capacity) break;
  }
  const __m256 none = _mm256_set1_ps(std::numeric_limits<float>::infinity());
  _mm256_storeu_ps(found + count, none);
  _mm256_storeu_ps(found + count + 8, none);
  return count;
}

/// The `rank`-th smallest (from 1) of sixteen values.
ORBIS_TARGET("avx2")
inline float ranked_avx2(const float* values, std::size_t rank) noexcept {
  const __m256 v[2] = {_mm256_loadu_ps(values), _mm256_loadu_ps(values + 8)};
  __m256i smaller[2] = {_mm256_setzero_si256(), _mm256_setzero_si256()};  // for each value, minus how many are
  for (std::size_t i = 0; i != leaf_width; ++i) {
    const __m256 other = _mm256_set1_ps(values[i]);
    for (std::size_t h = 0; h != 2; ++h) {
      smaller[h] = _mm256_add_epi32(smaller[h], _mm256_castps_si256(_mm256_cmp_ps(other, v[h], _CMP_LT_OQ)));
    }
  }
  const __m256i border = _mm256_set1_epi32(-static_cast<int>(rank));
  __m256 largest = _mm256_setzero_ps();
  for (std::size_t h = 0; h != 2; ++h) {
    const __m256 up_to = _mm256_castsi256_ps(_mm256_cmpgt_epi32(smaller[h], border));
    largest = _mm256_max_ps(largest, _mm256_and_ps(up_to, v[h]));
  }
  __m128 m = _mm_max_ps(_mm256_castps256_ps128(largest), _mm256_extractf128_ps(largest, 1));
  m = _mm_max_ps(m, _mm_movehl_ps(m, m));
  return _mm_cvtss_f32(_mm_max_ss(m, _mm_shuffle_ps(m, m, 1)));
}

ORBIS_TARGET("avx2,fma,popcnt")
inline nearest_sum sum_nearest_avx2(float* found, std::size_t count, std::size_t wanted, float bound) {
  const __m256 inf = _mm256_set1_ps(std::numeric_limits<float>::infinity());
  const auto count_within = [&](float at) ORBIS_TARGET("avx2,popcnt") {
    const __m256 border = _mm256_set1_ps(at);
    std::size_t n = 0;
    for (std::size_t i = 0; i < count; i += 8) {
      n += static_cast<std::size_t>(
          __builtin_popcount(mask_avx2(_mm256_cmp_ps(_mm256_loadu_ps(found + i), border, _CMP_LE_OQ))));
    }
    return n;
  };
  const auto count_three = [&](const std::array<float, 3>& at) ORBIS_TARGET("avx2,popcnt") {
    const __m256 border[3] = {_mm256_set1_ps(at[0]), _mm256_set1_ps(at[1]), _mm256_set1_ps(at[2])};
    std::array<std::size_t, 3> n{};
    for (std::size_t i = 0; i < count; i += 8) {
      const __m256 v = _mm256_loadu_ps(found + i);
      n[0] += static_cast<std::size_t>(__builtin_popcount(mask_avx2(_mm256_cmp_ps(v, border[0], _CMP_LE_OQ))));
      n[1] += static_cast<std::size_t>(__builtin_popcount(mask_avx2(_mm256_cmp_ps(v, border[1], _CMP_LE_OQ))));
      n[2] += static_cast<std::size_t>(__builtin_popcount(mask_avx2(_mm256_cmp_ps(v, border[2], _CMP_LE_OQ))));
    }
    return n;
  };
  const rank_bracket bracket = bracket_rank(bound, count, wanted, count_within, count_three);
  nearest_sum out;
  out.largest_squared = bracket.high;
  if (bracket.at_high - bracket.at_low <= leaf_width) {
    std::array<float, 2 * leaf_width> between;
    const __m256 low = _mm256_set1_ps(bracket.low);
    const __m256 high = _mm256_set1_ps(bracket.high);
    std::size_t n = 0;
    for (std::size_t i = 0; i < count; i += 8) {
      const __m256 v = _mm256_loadu_ps(found + i);
      const std::uint32_t in =
          mask_avx2(_mm256_and_ps(_mm256_cmp_ps(v, high, _CMP_LE_OQ), _mm256_cmp_ps(v, low, _CMP_GT_OQ)));
      _mm256_storeu_ps(between.data() + n, _mm256_permutevar8x32_ps(v, compacting_avx2(in)));
      n += static_cast<std::size_t>(__builtin_popcount(in));
    }
    _mm256_storeu_ps(between.data() + n, inf);
    _mm256_storeu_ps(between.data() + std::min(n + 8, leaf_width), inf);
    out.largest_squared = ranked_avx2(between.data(), wanted - bracket.at_low);
  }

  // See the wider version.
  const __m256 border = _mm256_set1_ps(out.largest_squared);
  const __m256 smallest = _mm256_set1_ps(0x1p-70F);
  const __m256 zero = _mm256_setzero_ps();
  const __m256 half = _mm256_set1_ps(0.5F);
  __m256d sum = _mm256_setzero_pd();
  __m256 corrections = zero;
  std::size_t smaller = 0;
  __m256 tiny = zero;
  for (std::size_t i = 0; i < count; i += 8) {
    const __m256 all = _mm256_loadu_ps(found + i);
    const __m256 in = _mm256_cmp_ps(all, border, _CMP_LT_OQ);
    smaller += static_cast<std::size_t>(__builtin_popcount(mask_avx2(in)));
    const __m256 usual = _mm256_and_ps(in, _mm256_cmp_ps(all, smallest, _CMP_GE_OQ));
    tiny = _mm256_or_ps(tiny, _mm256_andnot_ps(usual, _mm256_and_ps(in, _mm256_cmp_ps(all, zero, _CMP_GT_OQ))));
    const __m256 v = _mm256_and_ps(usual, all);
    const __m256 y0 = _mm256_and_ps(usual, _mm256_rsqrt_ps(v));
    const __m256 h = _mm256_mul_ps(half, y0);
    const __m256 y = _mm256_fmadd_ps(y0, _mm256_fnmadd_ps(_mm256_mul_ps(h, v), y0, half), y0);
    const __m256 s = _mm256_mul_ps(v, y);
    const __m256 rest = _mm256_fnmadd_ps(s, s, v);
    corrections = _mm256_fmadd_ps(rest, _mm256_mul_ps(half, y), corrections);
    sum = _mm256_add_pd(sum, _mm256_cvtps_pd(_mm256_castps256_ps128(s)));
    sum = _mm256_add_pd(sum, _mm256_cvtps_pd(_mm256_extractf128_ps(s, 1)));
  }
  sum = _mm256_add_pd(sum, _mm256_cvtps_pd(_mm256_castps256_ps128(corrections)));
  sum = _mm256_add_pd(sum, _mm256_cvtps_pd(_mm256_extractf128_ps(corrections, 1)));
  const __m128d pair = _mm_add_pd(_mm256_castpd256_pd128(sum), _mm256_extractf128_pd(sum, 1));
  const double total = _mm_cvtsd_f64(_mm_add_sd(pair, _mm_unpackhi_pd(pair, pair)));
  const double border_root = std::sqrt(double{out.largest_squared});
  out.roots = mask_avx2(tiny) != 0 ? -1.0 : total + static_cast<double>(wanted - smaller) * border_root;
  return out;
}

}  // namespace orbis::cloud::detail
#endif
