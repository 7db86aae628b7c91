// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// mark_crossings_kernel by hand for AVX-512: there it makes every-ray integration of point clouds about 20 % faster
/// (2 cm, 300,000 points: 80 ms instead of 97 ms).
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/plane_stack.hpp>

#if ORBIS_X86
#include <immintrin.h>

namespace orbis::octree::detail {

// The zeroing forms, because g++ 12 takes the others for uses of something uninitialised.
ORBIS_TARGET("avx512f,avx512dq") inline __m512i crossings_rounded_down(__m512d a, __m512d b) noexcept {
  return _mm512_maskz_inserti64x4(0xff, _mm512_castsi256_si512(_mm512_maskz_cvttpd_epu32(0xff, a)),
                                  _mm512_maskz_cvttpd_epu32(0xff, b), 1);
}
ORBIS_TARGET("avx512f,avx512dq") inline __m512i crossings_rounded(__m512d a, __m512d b) noexcept {
  return _mm512_maskz_inserti64x4(0xff, _mm512_castsi256_si512(_mm512_maskz_cvtpd_epi32(0xff, a)),
                                  _mm512_maskz_cvtpd_epi32(0xff, b), 1);
}
ORBIS_TARGET("avx512f,avx512dq") inline __m512 crossings_magnitudes(__m512d a, __m512d b) noexcept {
  return _mm512_abs_ps(_mm512_maskz_insertf32x8(0xffff, _mm512_castps256_ps512(_mm512_maskz_cvtpd_ps(0xff, a)),
                                                _mm512_maskz_cvtpd_ps(0xff, b), 1));
}

/// The numbers go through registers: read from memory they would have to wait for the marks before
/// them, whose addresses often agree in the last twelve bits.
ORBIS_TARGET("avx512f") inline void mark_bytes_avx512(std::uint8_t* map, __m512i cells) noexcept {
  const auto two = [map](std::uint64_t c) {
    map[static_cast<std::uint32_t>(c)] = plane_stack::marked;
    map[c >> 32U] = plane_stack::marked;
  };
  const auto four = [&](__m128i c) ORBIS_TARGET("avx512f") {
    two(static_cast<std::uint64_t>(_mm_cvtsi128_si64(c)));
    two(static_cast<std::uint64_t>(_mm_extract_epi64(c, 1)));
  };
  four(_mm512_maskz_extracti32x4_epi32(0xf, cells, 0));
  four(_mm512_maskz_extracti32x4_epi32(0xf, cells, 1));
  four(_mm512_maskz_extracti32x4_epi32(0xf, cells, 2));
  four(_mm512_maskz_extracti32x4_epi32(0xf, cells, 3));
}
ORBIS_TARGET("avx512f,avx512bw,avx512dq,avx512vl,bmi,popcnt")
inline void mark_crossings_avx512(const plane_stack& w, queued_rays& rays, std::size_t begin, std::size_t end,
                                  std::vector<std::uint32_t>& doubtful) {
  constexpr std::size_t lanes = queued_rays::lanes;
  constexpr double scale = 1U << plane_stack::fraction;
  constexpr int to_fraction = 32 - static_cast<int>(plane_stack::fraction);
  alignas(64) std::array<std::uint32_t, 20 * lanes> between;  // cells of layers, written later
  // The bits of a cell's number that come from u and from v.
  const __m512i bits_u = _mm512_set1_epi32(static_cast<int>(w.at((8U << w.log2_width) - 1, 0)));
  const __m512i bits_v = _mm512_set1_epi32(static_cast<int>(~w.at((8U << w.log2_width) - 1, 0)));
  const __m512i tile_rows = _mm512_set1_epi32(static_cast<int>(~((64U << w.log2_width) - 1)));
  const __m128i tile_row = _mm_cvtsi32_si128(static_cast<int>(plane_stack::fraction - 3 - w.log2_width));
  const __m512i columns = _mm512_set1_epi32(7), rows = _mm512_set1_epi32(7 << 3);
  const auto cell_at = [&](__m512i at_u, __m512i at_v) ORBIS_TARGET("avx512f") {
    constexpr int select = 0xca;
    __m512i cell = _mm512_ternarylogic_epi32(columns, _mm512_maskz_srli_epi32(0xffff, at_u, plane_stack::fraction),
                                             _mm512_maskz_srli_epi32(0xffff, at_u, plane_stack::fraction - 3), select);
    cell =
        _mm512_ternarylogic_epi32(rows, _mm512_maskz_srli_epi32(0xffff, at_v, plane_stack::fraction - 3), cell, select);
    return _mm512_ternarylogic_epi32(tile_rows, _mm512_maskz_srl_epi32(0xffff, at_v, tile_row), cell, select);
  };
  const __m512i nowhere = _mm512_set1_epi32(static_cast<int>(w.size));
  const __m512i doubt = _mm512_set1_epi32(static_cast<int>(2 * plane_stack::doubt << to_fraction));
  const __m512i one_map = _mm512_set1_epi32(static_cast<int>(w.stride));
  const __m512d vscale = _mm512_set1_pd(scale), bias = _mm512_set1_pd(plane_stack::doubt);
  const __m512d low_u = _mm512_set1_pd(w.low_u), low_v = _mm512_set1_pd(w.low_v), first = _mm512_set1_pd(w.first);
  const std::int32_t stop = w.first + w.count - 1;

  for (std::size_t r = begin; r < end; r += lanes) {
    const __m512i planes = _mm512_loadu_si512(rays.planes.data() + r);
    __mmask16 alive = end - r >= lanes ? __mmask16{0xffff} : static_cast<__mmask16>((1U << (end - r)) - 1U);
    alive &= _mm512_cmpge_epi32_mask(planes, _mm512_set1_epi32(w.first));
    if (alive == 0) continue;

    const __m512d du0 = _mm512_loadu_pd(rays.du.data() + r), du1 = _mm512_loadu_pd(rays.du.data() + r + 8);
    const __m512d dv0 = _mm512_loadu_pd(rays.dv.data() + r), dv1 = _mm512_loadu_pd(rays.dv.data() + r + 8);
    const auto start = [&](const double* at, __m512d low, __m512d d) ORBIS_TARGET("avx512f,avx512dq") {
      const __m512d x = _mm512_add_pd(_mm512_sub_pd(_mm512_loadu_pd(at), low), _mm512_mul_pd(first, d));
      return _mm512_add_pd(_mm512_mul_pd(x, vscale), bias);
    };
    __m512i u = crossings_rounded_down(start(rays.u.data() + r, low_u, du0), start(rays.u.data() + r + 8, low_u, du1));
    __m512i v = crossings_rounded_down(start(rays.v.data() + r, low_v, dv0), start(rays.v.data() + r + 8, low_v, dv1));
    const __m512i du = crossings_rounded(_mm512_mul_pd(du0, vscale), _mm512_mul_pd(du1, vscale));
    const __m512i dv = crossings_rounded(_mm512_mul_pd(dv0, vscale), _mm512_mul_pd(dv1, vscale));
    const __m512 fu = crossings_magnitudes(du0, du1), fv = crossings_magnitudes(dv0, dv1);
    const __m512i flip_u = _mm512_maskz_srai_epi32(0xffff, du, 31), flip_v = _mm512_maskz_srai_epi32(0xffff, dv, 31);
    const __m512 order_doubt =
        _mm512_mul_ps(_mm512_set1_ps(plane_stack::order_doubt * 4294967296.0F), _mm512_add_ps(fu, fv));

    __mmask16 doubtful_lanes = 0;
    std::size_t waiting = 0;
    std::int32_t j = w.first;
    std::uint8_t* map = w.planes;
    __m512i layer = _mm512_setzero_si512();
    __m512i last = _mm512_set1_epi32(static_cast<int>(w.cell(0, 0)));
    if (j == 0) {
      j = 1;
      u = _mm512_add_epi32(u, du);
      v = _mm512_add_epi32(v, dv);
      map += w.stride;
      alive &= _mm512_cmpge_epi32_mask(planes, _mm512_set1_epi32(1));
    } else {
      const __m512i low = _mm512_maskz_min_epu32(0xffff, _mm512_maskz_slli_epi32(0xffff, u, to_fraction),
                                                 _mm512_maskz_slli_epi32(0xffff, v, to_fraction));
      const __mmask16 unsure = _mm512_mask_cmplt_epu32_mask(alive, low, doubt);
      doubtful_lanes |= unsure;
      alive &= static_cast<__mmask16>(~unsure);
      last = cell_at(u, v);
      mark_bytes_avx512(map, _mm512_mask_mov_epi32(nowhere, alive, last));
      ++j;
      u = _mm512_add_epi32(u, du);
      v = _mm512_add_epi32(v, dv);
      map += w.stride;
      alive &= _mm512_cmpge_epi32_mask(planes, _mm512_set1_epi32(j));
    }
    while (j <= stop && alive != 0) {
      const __m512i frac_u = _mm512_maskz_slli_epi32(0xffff, u, to_fraction),
                    frac_v = _mm512_maskz_slli_epi32(0xffff, v, to_fraction);
      __mmask16 unsure = _mm512_mask_cmplt_epu32_mask(alive, _mm512_maskz_min_epu32(0xffff, frac_u, frac_v), doubt);
      const __m512i cell = cell_at(u, v);
      const __m512i changed = _mm512_xor_si512(cell, last);
      const __mmask16 both = _mm512_mask_test_epi32_mask(_mm512_test_epi32_mask(changed, bits_u), changed, bits_v);
      const __m512 behind_u = _mm512_mul_ps(_mm512_maskz_cvtepu32_ps(0xffff, _mm512_xor_si512(frac_u, flip_u)), fv);
      const __m512 behind_v = _mm512_mul_ps(_mm512_maskz_cvtepu32_ps(0xffff, _mm512_xor_si512(frac_v, flip_v)), fu);
      const __m512 order = _mm512_sub_ps(behind_u, behind_v);
      unsure |=
          static_cast<__mmask16>(alive & _mm512_mask_cmp_ps_mask(both, _mm512_abs_ps(order), order_doubt, _CMP_LE_OQ));
      doubtful_lanes |= unsure;
      alive &= static_cast<__mmask16>(~unsure);
      const __mmask16 u_first = _mm512_cmp_ps_mask(order, _mm512_setzero_ps(), _CMP_GT_OQ);
      const __m512i corner =
          _mm512_xor_si512(last, _mm512_and_si512(changed, _mm512_mask_mov_epi32(bits_v, u_first, bits_u)));
      const auto through = static_cast<__mmask16>(both & alive);
      _mm512_storeu_si512(between.data() + waiting,
                          _mm512_maskz_compress_epi32(through, _mm512_add_epi32(corner, layer)));
      waiting += static_cast<std::size_t>(__builtin_popcount(through));
      layer = _mm512_add_epi32(layer, one_map);
      mark_bytes_avx512(map, _mm512_mask_mov_epi32(nowhere, alive, cell));
      last = cell;
      ++j;
      u = _mm512_add_epi32(u, du);
      v = _mm512_add_epi32(v, dv);
      map += w.stride;
      alive &= _mm512_cmpge_epi32_mask(planes, _mm512_set1_epi32(j));
    }
    for (std::size_t i = 0; i != waiting; ++i) w.layers[between[i]] = plane_stack::marked;
    for (unsigned bits = doubtful_lanes; bits != 0; bits &= bits - 1) {
      const std::size_t i = r + static_cast<std::size_t>(std::countr_zero(bits));
      doubtful.push_back(rays.id[i]);
      rays.planes[i] = -1;
    }
  }
}

}  // namespace orbis::octree::detail
#endif
