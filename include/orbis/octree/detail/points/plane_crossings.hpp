// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where rays from one voxel pass through a stack of planes of voxel faces, sixteen rays at a time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/plane_stack.hpp>
#include <orbis/octree/detail/storage/packed_lanes.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// Marks the rays [begin, end) in `w`. Where arithmetic cannot tell for certain which cell or which
/// order is right, the ray is appended to `doubtful` and taken out (planes = -1); what has been marked
/// of it is right. @pre the cells of the rays lie in the window
inline void mark_crossings_portable(const plane_stack& w, queued_rays& rays, std::size_t begin, std::size_t end,
                                    std::vector<std::uint32_t>& doubtful) {
  constexpr double scale = 1U << plane_stack::fraction;
  constexpr std::uint32_t inside = (1U << plane_stack::fraction) - 1;
  const auto fixed = [](double x) { return static_cast<std::uint32_t>(static_cast<std::int64_t>(x)); };
  for (std::size_t r = begin; r != end; ++r) {
    const std::int32_t last = std::min(rays.planes[r], w.first + w.count - 1);
    std::int32_t j = w.first;
    if (j > last) continue;
    const double at_u = (rays.u[r] - w.low_u + j * rays.du[r]) * scale + plane_stack::doubt;
    const double at_v = (rays.v[r] - w.low_v + j * rays.dv[r]) * scale + plane_stack::doubt;
    std::uint32_t u = fixed(at_u), v = fixed(at_v);
    const std::uint32_t du = fixed(std::floor(rays.du[r] * scale + 0.5)),
                        dv = fixed(std::floor(rays.dv[r] * scale + 0.5));
    const auto fu = static_cast<float>(std::fabs(rays.du[r])), fv = static_cast<float>(std::fabs(rays.dv[r]));
    const std::uint32_t flip_u = rays.du[r] < 0.0 ? inside : 0, flip_v = rays.dv[r] < 0.0 ? inside : 0;
    const float order_doubt = plane_stack::order_doubt * (fu + fv) * static_cast<float>(scale);
    std::uint32_t cell_u = static_cast<std::uint32_t>(-w.low_u), cell_v = static_cast<std::uint32_t>(-w.low_v);
    bool certain = true;
    for (bool start = true;; start = false) {
      if (j != 0) {
        certain = (u & inside) >= 2 * plane_stack::doubt && (v & inside) >= 2 * plane_stack::doubt;
        if (!certain) break;
        const std::uint32_t next_u = u >> plane_stack::fraction, next_v = v >> plane_stack::fraction;
        const auto map = static_cast<std::size_t>(j - w.first) * w.stride;
        if (!start && next_u != cell_u && next_v != cell_v) {
          // Which was crossed first: the face that is further behind, in units of the ray's own speed.
          const float behind_u = static_cast<float>((u ^ flip_u) & inside) * fv;
          const float behind_v = static_cast<float>((v ^ flip_v) & inside) * fu;
          certain = std::fabs(behind_u - behind_v) > order_doubt;
          if (!certain) break;
          w.layers[map - w.stride + (behind_u > behind_v ? w.at(next_u, cell_v) : w.at(cell_u, next_v))] =
              plane_stack::marked;
        }
        w.planes[map + w.at(next_u, next_v)] = plane_stack::marked;
        cell_u = next_u;
        cell_v = next_v;
      }
      if (j++ == last) break;
      u += du;
      v += dv;
    }
    if (!certain) {
      doubtful.push_back(rays.id[r]);
      rays.planes[r] = -1;
    }
  }
}

#if ORBIS_X86
/// The bytes at eight cells, by way of registers as below.
ORBIS_TARGET("avx2") inline void mark(std::uint8_t* map, __m256i cells) noexcept {
  const auto two = [map](std::uint64_t c) {
    map[static_cast<std::uint32_t>(c)] = plane_stack::marked;
    map[c >> 32U] = plane_stack::marked;
  };
  const __m128i low = _mm256_castsi256_si128(cells), high = _mm256_extracti128_si256(cells, 1);
  two(static_cast<std::uint64_t>(_mm_cvtsi128_si64(low)));
  two(static_cast<std::uint64_t>(_mm_extract_epi64(low, 1)));
  two(static_cast<std::uint64_t>(_mm_cvtsi128_si64(high)));
  two(static_cast<std::uint64_t>(_mm_extract_epi64(high, 1)));
}
ORBIS_TARGET("avx2")
inline void mark_crossings_avx2(const plane_stack& w, queued_rays& rays, std::size_t begin, std::size_t end,
                                std::vector<std::uint32_t>& doubtful) {
  constexpr std::size_t lanes = 8;
  constexpr double scale = 1U << plane_stack::fraction;
  alignas(32) std::array<std::uint32_t, 20 * lanes> between;  // cells of layers, written later
  const auto all = [&](std::uint32_t x) ORBIS_TARGET("avx2") { return _mm256_set1_epi32(static_cast<int>(x)); };
  // The bits of a cell's number that come from u and from v.
  const std::uint32_t of_u = w.at((8U << w.log2_width) - 1, 0);
  const __m256i bits_u = all(of_u), bits_v = all(~of_u);
  const __m256i tile_columns = all(of_u & ~7U), tile_rows = all(~((64U << w.log2_width) - 1));
  const __m128i tile_row = _mm_cvtsi32_si128(static_cast<int>(plane_stack::fraction - 3 - w.log2_width));
  const auto cell_at = [&](__m256i at_u, __m256i at_v) ORBIS_TARGET("avx2") {
    const __m256i eighths = _mm256_srli_epi32(at_u, plane_stack::fraction - 3);
    const __m256i columns = _mm256_or_si256(_mm256_and_si256(eighths, tile_columns),
                                            _mm256_and_si256(_mm256_srli_epi32(at_u, plane_stack::fraction), all(7)));
    const __m256i rows = _mm256_and_si256(_mm256_srli_epi32(at_v, plane_stack::fraction - 3), all(7 << 3));
    return _mm256_or_si256(_mm256_or_si256(columns, rows),
                           _mm256_and_si256(_mm256_srl_epi32(at_v, tile_row), tile_rows));
  };
  const __m256i inside = all((1U << plane_stack::fraction) - 1), doubt = all(2 * plane_stack::doubt);
  const __m256i nowhere = all(static_cast<std::uint32_t>(w.size)), one_map = all(static_cast<std::uint32_t>(w.stride));
  const __m256i zero = _mm256_setzero_si256();
  const __m256d vscale = _mm256_set1_pd(scale), bias = _mm256_set1_pd(plane_stack::doubt);
  const __m256d first = _mm256_set1_pd(w.first), half_range = _mm256_set1_pd(2147483648.0);
  const __m256 no_sign = _mm256_castsi256_ps(all(0x7fffffffU));
  const std::int32_t stop = w.first + w.count - 1;
  const auto join = [&](__m128i low, __m128i high)
                        ORBIS_TARGET("avx2") { return _mm256_inserti128_si256(_mm256_castsi128_si256(low), high, 1); };

  for (std::size_t r = begin; r < end; r += lanes) {
    const __m256i planes = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(rays.planes.data() + r));
    const auto reached = [&](std::int32_t j)
                             ORBIS_TARGET("avx2") { return _mm256_cmpgt_epi32(planes, _mm256_set1_epi32(j - 1)); };
    const auto here = static_cast<int>(std::min(end - r, lanes));
    __m256i alive = _mm256_and_si256(
        _mm256_cmpgt_epi32(_mm256_set1_epi32(here), _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7)), reached(w.first));
    if (_mm256_testz_si256(alive, alive) != 0) continue;

    const __m256d du0 = _mm256_loadu_pd(rays.du.data() + r), du1 = _mm256_loadu_pd(rays.du.data() + r + 4);
    const __m256d dv0 = _mm256_loadu_pd(rays.dv.data() + r), dv1 = _mm256_loadu_pd(rays.dv.data() + r + 4);
    const auto start = [&](const double* at, std::int32_t low, __m256d d) ORBIS_TARGET("avx2") {
      const __m256d x = _mm256_add_pd(_mm256_sub_pd(_mm256_loadu_pd(at), _mm256_set1_pd(low)), _mm256_mul_pd(first, d));
      const __m256d fixed = _mm256_floor_pd(_mm256_add_pd(_mm256_mul_pd(x, vscale), bias));
      return _mm256_cvtpd_epi32(_mm256_sub_pd(fixed, half_range));  // of what has no sign
    };
    const __m256i top = all(0x80000000U);
    __m256i u =
        _mm256_xor_si256(top, join(start(rays.u.data() + r, w.low_u, du0), start(rays.u.data() + r + 4, w.low_u, du1)));
    __m256i v =
        _mm256_xor_si256(top, join(start(rays.v.data() + r, w.low_v, dv0), start(rays.v.data() + r + 4, w.low_v, dv1)));
    const auto rounded = [&](__m256d a, __m256d b) ORBIS_TARGET("avx2") {
      return join(_mm256_cvtpd_epi32(_mm256_mul_pd(a, vscale)), _mm256_cvtpd_epi32(_mm256_mul_pd(b, vscale)));
    };
    const auto magnitudes = [&](__m256d a, __m256d b) ORBIS_TARGET("avx2") {
      return _mm256_and_ps(no_sign,
                           _mm256_insertf128_ps(_mm256_castps128_ps256(_mm256_cvtpd_ps(a)), _mm256_cvtpd_ps(b), 1));
    };
    const __m256i du = rounded(du0, du1), dv = rounded(dv0, dv1);
    const __m256 fu = magnitudes(du0, du1), fv = magnitudes(dv0, dv1);
    const __m256i flip_u = _mm256_and_si256(inside, _mm256_srai_epi32(du, 31));
    const __m256i flip_v = _mm256_and_si256(inside, _mm256_srai_epi32(dv, 31));
    const __m256 order_doubt =
        _mm256_mul_ps(_mm256_set1_ps(plane_stack::order_doubt * static_cast<float>(scale)), _mm256_add_ps(fu, fv));
    const auto is_close = [&](__m256i part_u, __m256i part_v) ORBIS_TARGET("avx2") {
      return _mm256_cmpgt_epi32(doubt, _mm256_min_epi32(part_u, part_v));
    };

    __m256i doubtful_lanes = zero, layer = zero;
    std::size_t waiting = 0;
    std::int32_t j = w.first;
    std::uint8_t* map = w.planes;
    __m256i last = all(w.cell(0, 0));
    if (j != 0) {
      const __m256i unsure =
          _mm256_and_si256(alive, is_close(_mm256_and_si256(u, inside), _mm256_and_si256(v, inside)));
      doubtful_lanes = unsure;
      alive = _mm256_andnot_si256(unsure, alive);
      last = cell_at(u, v);
      mark(map, _mm256_blendv_epi8(nowhere, last, alive));
    }
    for (;;) {
      ++j;
      u = _mm256_add_epi32(u, du);
      v = _mm256_add_epi32(v, dv);
      map += w.stride;
      alive = _mm256_and_si256(alive, reached(j));
      if (j > stop || _mm256_testz_si256(alive, alive) != 0) break;
      const __m256i part_u = _mm256_and_si256(u, inside), part_v = _mm256_and_si256(v, inside);
      const __m256i cell = cell_at(u, v), changed = _mm256_xor_si256(cell, last);
      const __m256i same = _mm256_or_si256(_mm256_cmpeq_epi32(_mm256_and_si256(changed, bits_u), zero),
                                           _mm256_cmpeq_epi32(_mm256_and_si256(changed, bits_v), zero));
      const __m256 behind_u = _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_xor_si256(part_u, flip_u)), fv);
      const __m256 behind_v = _mm256_mul_ps(_mm256_cvtepi32_ps(_mm256_xor_si256(part_v, flip_v)), fu);
      const __m256 order = _mm256_sub_ps(behind_u, behind_v);
      const __m256i close = _mm256_castps_si256(_mm256_cmp_ps(_mm256_and_ps(order, no_sign), order_doubt, _CMP_LE_OQ));
      const __m256i unsure =
          _mm256_and_si256(alive, _mm256_or_si256(is_close(part_u, part_v), _mm256_andnot_si256(same, close)));
      doubtful_lanes = _mm256_or_si256(doubtful_lanes, unsure);
      alive = _mm256_andnot_si256(unsure, alive);
      const __m256i through = _mm256_andnot_si256(same, alive);
      if (const auto bits = static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(through))); bits != 0) {
        const __m256i u_first = _mm256_castps_si256(_mm256_cmp_ps(order, _mm256_setzero_ps(), _CMP_GT_OQ));
        const __m256i corner =
            _mm256_xor_si256(last, _mm256_and_si256(changed, _mm256_blendv_epi8(bits_v, bits_u, u_first)));
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(between.data() + waiting),
                            _mm256_permutevar8x32_epi32(_mm256_add_epi32(corner, layer), packed_lanes(bits)));
        waiting += static_cast<std::size_t>(std::popcount(bits));
      }
      layer = _mm256_add_epi32(layer, one_map);
      mark(map, _mm256_blendv_epi8(nowhere, cell, alive));
      last = cell;
    }
    for (std::size_t i = 0; i != waiting; ++i) w.layers[between[i]] = plane_stack::marked;
    for (auto bits = static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(doubtful_lanes))); bits != 0;
         bits &= bits - 1) {
      const std::size_t i = r + static_cast<std::size_t>(std::countr_zero(bits));
      doubtful.push_back(rays.id[i]);
      rays.planes[i] = -1;
    }
  }
}

// The zeroing forms, because g++ 12 takes the others for uses of something uninitialised.
ORBIS_TARGET("avx512f,avx512dq") inline __m512i rounded_down(__m512d a, __m512d b) noexcept {
  return _mm512_maskz_inserti64x4(0xff, _mm512_castsi256_si512(_mm512_maskz_cvttpd_epu32(0xff, a)),
                                  _mm512_maskz_cvttpd_epu32(0xff, b), 1);
}
ORBIS_TARGET("avx512f,avx512dq") inline __m512i rounded(__m512d a, __m512d b) noexcept {
  return _mm512_maskz_inserti64x4(0xff, _mm512_castsi256_si512(_mm512_maskz_cvtpd_epi32(0xff, a)),
                                  _mm512_maskz_cvtpd_epi32(0xff, b), 1);
}
ORBIS_TARGET("avx512f,avx512dq") inline __m512 magnitudes(__m512d a, __m512d b) noexcept {
  return _mm512_abs_ps(_mm512_maskz_insertf32x8(0xffff, _mm512_castps256_ps512(_mm512_maskz_cvtpd_ps(0xff, a)),
                                                _mm512_maskz_cvtpd_ps(0xff, b), 1));
}

/// The numbers go through registers: read from memory they would have to wait for the marks before
/// them, whose addresses often agree in the last twelve bits.
ORBIS_TARGET("avx512f") inline void mark(std::uint8_t* map, __m512i cells) noexcept {
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
    __m512i u = rounded_down(start(rays.u.data() + r, low_u, du0), start(rays.u.data() + r + 8, low_u, du1));
    __m512i v = rounded_down(start(rays.v.data() + r, low_v, dv0), start(rays.v.data() + r + 8, low_v, dv1));
    const __m512i du = rounded(_mm512_mul_pd(du0, vscale), _mm512_mul_pd(du1, vscale));
    const __m512i dv = rounded(_mm512_mul_pd(dv0, vscale), _mm512_mul_pd(dv1, vscale));
    const __m512 fu = magnitudes(du0, du1), fv = magnitudes(dv0, dv1);
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
      mark(map, _mm512_mask_mov_epi32(nowhere, alive, last));
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
      mark(map, _mm512_mask_mov_epi32(nowhere, alive, cell));
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
#endif

using crossings_kernel = void(const plane_stack&, queued_rays&, std::size_t, std::size_t, std::vector<std::uint32_t>&);

[[nodiscard]] inline crossings_kernel* mark_crossings(simd::level level) noexcept {
  return simd::select<crossings_kernel>(level, {
    .portable = mark_crossings_portable,
#if ORBIS_X86
    .popcnt = nullptr, .avx2 = mark_crossings_avx2, .avx512 = mark_crossings_avx512
#endif
  });
}

}  // namespace orbis::octree::detail
