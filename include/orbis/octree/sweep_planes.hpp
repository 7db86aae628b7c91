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

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// Rays that go forward along one axis. After its j-th plane (j = 1, 2 ... planes) a ray is in the cell
/// (floor(u + j * du), floor(v + j * dv)), counted from the one it starts in. @pre |du|, |dv| <= 1
struct swept_rays {
  static constexpr std::size_t lanes = 16;
  std::vector<double> u, du, v, dv;
  std::vector<std::int32_t> planes;
  std::vector<std::uint32_t> id;

  /// Room for `count` rays, and for a whole group of lanes after any of them.
  void fit(std::size_t count) {
    if (planes.size() >= count + lanes) return;
    u.resize(count + lanes);
    du.resize(count + lanes);
    v.resize(count + lanes);
    dv.resize(count + lanes);
    planes.resize(count + lanes);
    id.resize(count + lanes);
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return planes.capacity() * (4 * sizeof(double) + sizeof(std::int32_t) + sizeof(std::uint32_t));
  }
};

/// Some consecutive planes and the layers of voxels between them, each a map of bytes in tiles of 8x8,
/// a tile being a line of the cache and a layer of a brick. A byte of a plane says that a ray passes
/// through there: the voxels on both sides are crossed. A byte of a layer is a voxel that a ray enters
/// and leaves between two planes.
struct sweep_window {
  static constexpr unsigned fraction = 22;     ///< bits of a coordinate's fraction; ten are left for the cell
  static constexpr std::uint32_t doubt = 12;   ///< no coordinate is wrong by more, in units of 2^-22 cells
  static constexpr float order_doubt = 7e-6F;  ///< nor is the order of two crossings, in cells
  static constexpr std::uint8_t marked = 0xff;

  std::uint8_t* planes = nullptr;
  std::uint8_t* layers = nullptr;
  std::size_t size = 0;     ///< cells of a map
  std::size_t stride = 0;   ///< from map to map; what lies between is for rays that are not there
  unsigned log2_width = 0;  ///< of a map, in tiles, u being the fast axis
  std::int32_t low_u = 0;   ///< the map's first cell
  std::int32_t low_v = 0;
  std::int32_t first = 0;  ///< number of the first plane; 0 is where the rays start, and nothing is to be done there
  std::int32_t count = 0;  ///< planes

  /// The number of the cell (u, v).
  [[nodiscard]] std::uint32_t cell(std::int32_t u, std::int32_t v) const noexcept {
    return at(static_cast<std::uint32_t>(u - low_u), static_cast<std::uint32_t>(v - low_v));
  }
  /// The same, u and v being counted from the map's first cell.
  [[nodiscard]] std::uint32_t at(std::uint32_t u, std::uint32_t v) const noexcept {
    return ((v >> 3U << log2_width | u >> 3U) << 6U) | (v & 7U) << 3U | (u & 7U);
  }
};

/// Marks the rays [begin, end) in `w`. Where arithmetic cannot tell for certain which cell or which
/// order is right, the ray is appended to `doubtful` and taken out (planes = -1); what has been marked
/// of it is right. @pre the cells of the rays lie in the window
inline void sweep_portable(const sweep_window& w, swept_rays& rays, std::size_t begin, std::size_t end,
                           std::vector<std::uint32_t>& doubtful) {
  constexpr double scale = 1U << sweep_window::fraction;
  constexpr std::uint32_t inside = (1U << sweep_window::fraction) - 1;
  const auto fixed = [](double x) { return static_cast<std::uint32_t>(static_cast<std::int64_t>(x)); };
  for (std::size_t r = begin; r != end; ++r) {
    const std::int32_t last = std::min(rays.planes[r], w.first + w.count - 1);
    std::int32_t j = w.first;
    if (j > last) continue;
    const double at_u = (rays.u[r] - w.low_u + j * rays.du[r]) * scale + sweep_window::doubt;
    const double at_v = (rays.v[r] - w.low_v + j * rays.dv[r]) * scale + sweep_window::doubt;
    std::uint32_t u = fixed(at_u), v = fixed(at_v);
    const std::uint32_t du = fixed(std::floor(rays.du[r] * scale + 0.5)),
                        dv = fixed(std::floor(rays.dv[r] * scale + 0.5));
    const auto fu = static_cast<float>(std::fabs(rays.du[r])), fv = static_cast<float>(std::fabs(rays.dv[r]));
    const std::uint32_t flip_u = rays.du[r] < 0.0 ? inside : 0, flip_v = rays.dv[r] < 0.0 ? inside : 0;
    const float order_doubt = sweep_window::order_doubt * (fu + fv) * static_cast<float>(scale);
    std::uint32_t cell_u = static_cast<std::uint32_t>(-w.low_u), cell_v = static_cast<std::uint32_t>(-w.low_v);
    bool certain = true;
    for (bool start = true;; start = false) {
      if (j != 0) {
        certain = (u & inside) >= 2 * sweep_window::doubt && (v & inside) >= 2 * sweep_window::doubt;
        if (!certain) break;
        const std::uint32_t next_u = u >> sweep_window::fraction, next_v = v >> sweep_window::fraction;
        const auto map = static_cast<std::size_t>(j - w.first) * w.stride;
        if (!start && next_u != cell_u && next_v != cell_v) {
          // Which was crossed first: the face that is further behind, in units of the ray's own speed.
          const float behind_u = static_cast<float>((u ^ flip_u) & inside) * fv;
          const float behind_v = static_cast<float>((v ^ flip_v) & inside) * fu;
          certain = std::fabs(behind_u - behind_v) > order_doubt;
          if (!certain) break;
          w.layers[map - w.stride + (behind_u > behind_v ? w.at(next_u, cell_v) : w.at(cell_u, next_v))] =
              sweep_window::marked;
        }
        w.planes[map + w.at(next_u, next_v)] = sweep_window::marked;
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
    map[static_cast<std::uint32_t>(c)] = sweep_window::marked;
    map[c >> 32U] = sweep_window::marked;
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
inline void sweep_avx512(const sweep_window& w, swept_rays& rays, std::size_t begin, std::size_t end,
                         std::vector<std::uint32_t>& doubtful) {
  constexpr std::size_t lanes = swept_rays::lanes;
  constexpr double scale = 1U << sweep_window::fraction;
  constexpr int to_fraction = 32 - static_cast<int>(sweep_window::fraction);
  alignas(64) std::array<std::uint32_t, 20 * lanes> between;  // cells of layers, written later
  // The bits of a cell's number that come from u and from v.
  const __m512i bits_u = _mm512_set1_epi32(static_cast<int>(w.at((8U << w.log2_width) - 1, 0)));
  const __m512i bits_v = _mm512_set1_epi32(static_cast<int>(~w.at((8U << w.log2_width) - 1, 0)));
  const __m512i tile_rows = _mm512_set1_epi32(static_cast<int>(~((64U << w.log2_width) - 1)));
  const __m128i tile_row = _mm_cvtsi32_si128(static_cast<int>(sweep_window::fraction - 3 - w.log2_width));
  const __m512i columns = _mm512_set1_epi32(7), rows = _mm512_set1_epi32(7 << 3);
  const auto cell_at = [&](__m512i at_u, __m512i at_v) ORBIS_TARGET("avx512f") {
    constexpr int select = 0xca;
    __m512i cell = _mm512_ternarylogic_epi32(columns, _mm512_maskz_srli_epi32(0xffff, at_u, sweep_window::fraction),
                                             _mm512_maskz_srli_epi32(0xffff, at_u, sweep_window::fraction - 3), select);
    cell = _mm512_ternarylogic_epi32(rows, _mm512_maskz_srli_epi32(0xffff, at_v, sweep_window::fraction - 3), cell,
                                     select);
    return _mm512_ternarylogic_epi32(tile_rows, _mm512_maskz_srl_epi32(0xffff, at_v, tile_row), cell, select);
  };
  const __m512i nowhere = _mm512_set1_epi32(static_cast<int>(w.size));
  const __m512i doubt = _mm512_set1_epi32(static_cast<int>(2 * sweep_window::doubt << to_fraction));
  const __m512i one_map = _mm512_set1_epi32(static_cast<int>(w.stride));
  const __m512d vscale = _mm512_set1_pd(scale), bias = _mm512_set1_pd(sweep_window::doubt);
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
        _mm512_mul_ps(_mm512_set1_ps(sweep_window::order_doubt * 4294967296.0F), _mm512_add_ps(fu, fv));

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
    for (std::size_t i = 0; i != waiting; ++i) w.layers[between[i]] = sweep_window::marked;
    for (unsigned bits = doubtful_lanes; bits != 0; bits &= bits - 1) {
      const std::size_t i = r + static_cast<std::size_t>(std::countr_zero(bits));
      doubtful.push_back(rays.id[i]);
      rays.planes[i] = -1;
    }
  }
}
#endif

}  // namespace orbis::octree::detail
