// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The inner loops of `ray_kernels.hpp`, eight and sixteen points at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/cloud/detail/rays/ray_kernels.hpp>
#include <orbis/core/simd.hpp>

#if ORBIS_X86
#include <immintrin.h>

namespace orbis::cloud::detail {

/// A product that is rounded, never half of a fused multiply-add.
ORBIS_TARGET("avx2")
inline __m256 product_avx2(__m256 a, __m256 b) noexcept {
  __m256 product = _mm256_mul_ps(a, b);
#if !defined(__clang__)
  asm("" : "+x"(product));
#endif
  return product;
}

ORBIS_TARGET("avx2")
inline __m256 all_avx2(float x) noexcept { return _mm256_set1_ps(x); }

ORBIS_TARGET("avx2")
inline void locate_avx2(const ray_view& view, const block_axes& points, seen_block& seen) {
  const __m256 zero = _mm256_setzero_ps();
  for (std::size_t i = 0; i != seen_block::size; i += 8) {
    __m256 d[3];
    for (std::size_t a = 0; a != 3; ++a) {
      d[a] = _mm256_sub_ps(_mm256_sub_ps(_mm256_loadu_ps(points[a] + i), all_avx2(view.origin[a])),
                           all_avx2(view.origin_rest[a]));
    }
    __m256 q[3];
    for (std::size_t a = 0; a != 3; ++a) {
      const auto& row = view.rotation[a];
      q[a] = _mm256_add_ps(_mm256_add_ps(product_avx2(all_avx2(row[0]), d[0]), product_avx2(all_avx2(row[1]), d[1])),
                           product_avx2(all_avx2(row[2]), d[2]));
    }
    const __m256 u = _mm256_add_ps(product_avx2(all_avx2(view.fx), _mm256_div_ps(q[0], q[2])), all_avx2(view.cx));
    const __m256 v = _mm256_add_ps(product_avx2(all_avx2(view.fy), _mm256_div_ps(q[1], q[2])), all_avx2(view.cy));
    __m256 inside = _mm256_and_ps(_mm256_cmp_ps(q[2], all_avx2(view.min_depth), _CMP_GT_OQ),
                                  _mm256_cmp_ps(q[2], all_avx2(view.max_depth), _CMP_LE_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(u, zero, _CMP_GE_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(u, all_avx2(static_cast<float>(view.width)), _CMP_LT_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(v, zero, _CMP_GE_OQ));
    inside = _mm256_and_ps(inside, _mm256_cmp_ps(v, all_avx2(static_cast<float>(view.height)), _CMP_LT_OQ));
    const __m256i pixel = _mm256_add_epi32(_mm256_mullo_epi32(_mm256_cvttps_epi32(v), _mm256_set1_epi32(view.width)),
                                           _mm256_cvttps_epi32(u));
    const __m256i outside = _mm256_xor_si256(_mm256_castps_si256(inside), _mm256_set1_epi32(-1));
    _mm256_store_ps(seen.depth.data() + i, q[2]);
    _mm256_store_si256(reinterpret_cast<__m256i*>(seen.pixel.data() + i), _mm256_or_si256(pixel, outside));
  }
}

ORBIS_TARGET("avx2")
inline void judge_avx2(const ray_view& view, const seen_block& seen, block_verdict& verdict) {
  const __m256 sign = _mm256_set1_ps(-0.0F);
  const __m256 none = _mm256_set1_ps(depth_windows::none);
  for (std::size_t w = 0; w != block_verdict::words; ++w) {
    std::uint32_t through = 0;
    std::uint32_t supported = 0;
    for (std::size_t half = 0; half != 2; ++half) {
      const std::size_t i = 16 * w + 8 * half;
      const __m256i pixel = _mm256_load_si256(reinterpret_cast<const __m256i*>(seen.pixel.data() + i));
      // All ones where there is a pixel: the sign of its complement.
      const __m256 inside = _mm256_castsi256_ps(_mm256_xor_si256(pixel, _mm256_set1_epi32(-1)));
      if (_mm256_movemask_ps(inside) == 0) continue;
      const __m256 z = _mm256_load_ps(seen.depth.data() + i);
      const __m256 nearest = _mm256_mask_i32gather_ps(none, view.nearest, pixel, inside, 4);
      const __m256 margin = _mm256_add_ps(_mm256_set1_ps(view.margin),
                                          product_avx2(_mm256_set1_ps(view.margin_growth), product_avx2(z, z)));
      const auto near = [&](__m256 depth) ORBIS_TARGET("avx2") {
        return _mm256_cmp_ps(_mm256_andnot_ps(sign, _mm256_sub_ps(depth, z)), margin, _CMP_LE_OQ);
      };
      // Mostly the nearest says it all, since rays do not pass through what it is near to.
      __m256 measured = _mm256_and_ps(inside, near(nearest));
      __m256 open = _mm256_andnot_ps(measured, inside);
      if (_mm256_movemask_ps(open) != 0) {
        const __m256 farthest = _mm256_mask_i32gather_ps(none, view.farthest, pixel, open, 4);
        const __m256 slack =
            _mm256_add_ps(margin, product_avx2(_mm256_set1_ps(view.slant), _mm256_sub_ps(farthest, nearest)));
        const __m256 beyond = _mm256_and_ps(open, _mm256_cmp_ps(_mm256_sub_ps(nearest, z), slack, _CMP_GT_OQ));
        through |= static_cast<std::uint32_t>(_mm256_movemask_ps(beyond)) << (8 * half);
        measured = _mm256_or_ps(measured, _mm256_and_ps(open, near(farthest)));
        open = _mm256_andnot_ps(_mm256_or_ps(measured, beyond), open);
        if (_mm256_movemask_ps(open) != 0) {
          const __m256 middle = _mm256_mask_i32gather_ps(none, view.middle, pixel, open, 4);
          measured = _mm256_or_ps(measured, _mm256_and_ps(open, near(middle)));
        }
      }
      supported |= static_cast<std::uint32_t>(_mm256_movemask_ps(measured)) << (8 * half);
    }
    verdict.through[w] = static_cast<std::uint16_t>(through);
    verdict.supported[w] = static_cast<std::uint16_t>(supported);
  }
}

ORBIS_TARGET("avx2")
inline void count_avx2(const std::array<std::uint16_t, block_verdict::words>& words, std::uint16_t* counters) {
  const __m256i bits = _mm256_set_epi16(-0x8000, 0x4000, 0x2000, 0x1000, 0x800, 0x400, 0x200, 0x100,  //
                                        0x80, 0x40, 0x20, 0x10, 8, 4, 2, 1);
  for (std::size_t w = 0; w != block_verdict::words; ++w) {
    auto* const at = reinterpret_cast<__m256i*>(counters + 16 * w);
    const __m256i word = _mm256_set1_epi16(static_cast<short>(words[w]));
    const __m256i more = _mm256_srli_epi16(_mm256_cmpeq_epi16(_mm256_and_si256(word, bits), bits), 15);
    _mm256_storeu_si256(at, _mm256_adds_epu16(_mm256_loadu_si256(at), more));
  }
}

ORBIS_TARGET("avx512f")
inline __m512 product_avx512(__m512 a, __m512 b) noexcept {
  __m512 product = _mm512_mul_ps(a, b);
#if !defined(__clang__)
  asm("" : "+v"(product));
#endif
  return product;
}

ORBIS_TARGET("avx512f")
inline __m512 all_avx512(float x) noexcept { return _mm512_set1_ps(x); }

ORBIS_TARGET("avx512f,avx512dq")
inline void locate_avx512(const ray_view& view, const block_axes& points, seen_block& seen) {
  for (std::size_t i = 0; i != seen_block::size; i += 16) {
    __m512 d[3];
    for (std::size_t a = 0; a != 3; ++a) {
      d[a] = _mm512_sub_ps(_mm512_sub_ps(_mm512_loadu_ps(points[a] + i), all_avx512(view.origin[a])),
                           all_avx512(view.origin_rest[a]));
    }
    __m512 q[3];
    for (std::size_t a = 0; a != 3; ++a) {
      const auto& row = view.rotation[a];
      q[a] = _mm512_add_ps(
          _mm512_add_ps(product_avx512(all_avx512(row[0]), d[0]), product_avx512(all_avx512(row[1]), d[1])),
          product_avx512(all_avx512(row[2]), d[2]));
    }
    const __m512 u = _mm512_add_ps(product_avx512(all_avx512(view.fx), _mm512_div_ps(q[0], q[2])), all_avx512(view.cx));
    const __m512 v = _mm512_add_ps(product_avx512(all_avx512(view.fy), _mm512_div_ps(q[1], q[2])), all_avx512(view.cy));
    const __m512 zero = _mm512_setzero_ps();
    __mmask16 inside = _mm512_cmp_ps_mask(q[2], all_avx512(view.min_depth), _CMP_GT_OQ);
    inside = _mm512_mask_cmp_ps_mask(inside, q[2], all_avx512(view.max_depth), _CMP_LE_OQ);
    inside = _mm512_mask_cmp_ps_mask(inside, u, zero, _CMP_GE_OQ);
    inside = _mm512_mask_cmp_ps_mask(inside, u, all_avx512(static_cast<float>(view.width)), _CMP_LT_OQ);
    inside = _mm512_mask_cmp_ps_mask(inside, v, zero, _CMP_GE_OQ);
    inside = _mm512_mask_cmp_ps_mask(inside, v, all_avx512(static_cast<float>(view.height)), _CMP_LT_OQ);
    const __m512i row = _mm512_maskz_cvttps_epi32(inside, v);
    const __m512i pixel =
        _mm512_add_epi32(_mm512_mullo_epi32(row, _mm512_set1_epi32(view.width)), _mm512_maskz_cvttps_epi32(inside, u));
    _mm512_store_ps(seen.depth.data() + i, q[2]);
    _mm512_store_si512(seen.pixel.data() + i, _mm512_mask_mov_epi32(_mm512_set1_epi32(-1), inside, pixel));
  }
}

ORBIS_TARGET("avx512f,avx512dq")
inline void judge_avx512(const ray_view& view, const seen_block& seen, block_verdict& verdict) {
  const __m512 none = _mm512_set1_ps(depth_windows::none);
  for (std::size_t w = 0; w != block_verdict::words; ++w) {
    const __m512i pixel = _mm512_load_si512(seen.pixel.data() + 16 * w);
    const __mmask16 inside = _mm512_cmpge_epi32_mask(pixel, _mm512_setzero_si512());
    verdict.through[w] = 0;
    verdict.supported[w] = 0;
    if (inside == 0) continue;
    const __m512 z = _mm512_load_ps(seen.depth.data() + 16 * w);
    const __m512 nearest = _mm512_mask_i32gather_ps(none, inside, pixel, view.nearest, 4);
    const __m512 margin = _mm512_add_ps(_mm512_set1_ps(view.margin),
                                        product_avx512(_mm512_set1_ps(view.margin_growth), product_avx512(z, z)));
    const auto near = [&](__mmask16 lanes, __m512 depth) ORBIS_TARGET("avx512f,avx512dq") {
      const __m512i difference = _mm512_castps_si512(_mm512_sub_ps(depth, z));
      const __m512 absolute = _mm512_castsi512_ps(_mm512_and_si512(difference, _mm512_set1_epi32(0x7fffffff)));
      return static_cast<unsigned>(_mm512_mask_cmp_ps_mask(lanes, absolute, margin, _CMP_LE_OQ));
    };
    // Mostly the nearest says it all, since rays do not pass through what it is near to.
    unsigned measured = near(inside, nearest);
    auto open = static_cast<__mmask16>(inside & ~measured);
    if (open != 0) {
      const __m512 farthest = _mm512_mask_i32gather_ps(none, open, pixel, view.farthest, 4);
      const __m512 slack =
          _mm512_add_ps(margin, product_avx512(_mm512_set1_ps(view.slant), _mm512_sub_ps(farthest, nearest)));
      const unsigned beyond = _mm512_mask_cmp_ps_mask(open, _mm512_sub_ps(nearest, z), slack, _CMP_GT_OQ);
      verdict.through[w] = static_cast<std::uint16_t>(beyond);
      measured |= near(open, farthest);
      open = static_cast<__mmask16>(open & ~(measured | beyond));
      if (open != 0) measured |= near(open, _mm512_mask_i32gather_ps(none, open, pixel, view.middle, 4));
    }
    verdict.supported[w] = static_cast<std::uint16_t>(measured);
  }
}

ORBIS_TARGET("avx512f,avx512bw,avx512vl")
inline void count_avx512(const std::array<std::uint16_t, block_verdict::words>& words, std::uint16_t* counters) {
  for (std::size_t w = 0; w != block_verdict::words; ++w) {
    const __m256i now = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(counters + 16 * w));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(counters + 16 * w),
                        _mm256_mask_adds_epu16(now, words[w], now, _mm256_set1_epi16(1)));
  }
}

}  // namespace orbis::cloud::detail
#endif

namespace orbis::cloud::detail {

/// The fastest inner loops that neither `wanted` nor the processor excludes.
[[nodiscard]] inline ray_kernels ray_kernels_at(simd::level wanted) noexcept {
#if ORBIS_X86
  const simd::level best = std::min(wanted, simd::detected());
  if (best >= simd::level::avx512) return {locate_avx512, judge_avx512, count_avx512};
  if (best >= simd::level::avx2) return {locate_avx2, judge_avx2, count_avx2};
#endif
  static_cast<void>(wanted);
  return {locate_portable, judge_portable, count_portable};
}

}  // namespace orbis::cloud::detail
