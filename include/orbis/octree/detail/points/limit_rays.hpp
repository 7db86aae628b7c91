// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the rays of points end, many points at a time.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/point_keys.hpp>
#include <orbis/octree/detail/points/ray_traversal.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// The ray from `origin` to a point, cut off at `limit` metres. @pre the point lies further away, at
/// `distance`; limit >= 0
[[nodiscard]] inline float3 cut_off(const float3& origin, const float3& ray, double distance, double limit) noexcept {
  const auto scale = static_cast<float>(distance), range = static_cast<float>(limit);
  float3 end;
  for (std::size_t i = 0; i != 3; ++i) end[i] = origin[i] + rounded_product(ray[i] / scale, range);
  return end;
}

/// Some rays: their ends, and the way there in voxels from the origin's.
struct ray_batch {
  static constexpr std::size_t capacity = point_batch::capacity;
  static constexpr std::size_t lanes = 8;
  using bits = std::array<std::uint64_t, capacity / 64>;

  alignas(64) std::array<std::array<float, capacity>, 3> end{};
  alignas(64) std::array<std::array<std::int32_t, capacity>, 3> way{};
  bits hit{};  ///< bit i: ray i ends at a point
  bits cut{};  ///< bit i: ray i is cut off; neither: there is no ray i

  void set(std::size_t i, const float3& to, const std::array<std::int32_t, 3>& cells, bool is_hit) noexcept {
    for (std::size_t axis = 0; axis != 3; ++axis) {
      end[axis][i] = to[axis];
      way[axis][i] = cells[axis];
    }
    (is_hit ? hit : cut)[i >> 6U] |= std::uint64_t{1} << (i & 63U);
  }
  void clear() noexcept { hit = cut = {}; }
  /// Eight bits from bit i on. @pre i is a multiple of eight
  [[nodiscard]] static std::uint32_t eight(const bits& b, std::size_t i) noexcept {
    return static_cast<std::uint32_t>(b[i >> 6U] >> (i & 63U)) & 0xffU;
  }
  [[nodiscard]] static std::size_t count(const bits& b) noexcept {
    std::size_t n = 0;
    for (const std::uint64_t word : b) n += static_cast<std::size_t>(std::popcount(word));
    return n;
  }
};

/// From where and in what rays go.
struct ray_frame {
  const voxel_grid& grid;
  float3 origin;
  voxel_key from;  ///< where the way begins
};

/// The rays to `count` points, each cut off at its limit in metres; a limit that is negative or NaN, an
/// end that lies outside the grid: no ray.
inline void limit_rays_portable(const ray_frame& f, const point_batch& points, const double* limits, std::size_t count,
                                ray_batch& rays) noexcept {
  rays.clear();
  for (std::size_t i = 0; i != count; ++i) {
    float3 end{points.x[i], points.y[i], points.z[i]};
    const float3 ray = difference(end, f.origin);
    const double distance = length(ray);
    const bool hit = distance <= limits[i];
    if (!hit) {
      if (!(limits[i] >= 0.0) || !std::isfinite(static_cast<float>(distance))) continue;
      end = cut_off(f.origin, ray, distance, limits[i]);
    }
    if (const auto k = f.grid.key(end))
      rays.set(i, end,
               {static_cast<std::int32_t>(k->x - f.from.x), static_cast<std::int32_t>(k->y - f.from.y),
                static_cast<std::int32_t>(k->z - f.from.z)},
               hit);
  }
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void limit_rays_avx2(const ray_frame& f, const point_batch& points, const double* limits, std::size_t count,
                            ray_batch& rays) noexcept {
  rays.clear();
  const std::array<const float*, 3> at{points.x.data(), points.y.data(), points.z.data()};
  const std::array<std::uint32_t, 3> from{f.from.x, f.from.y, f.from.z};
  const __m256d per_metre = _mm256_set1_pd(1.0 / f.grid.resolution());
  const __m256d high = _mm256_set1_pd(0.5 * f.grid.cells()), low = _mm256_set1_pd(-0.5 * f.grid.cells());
  const __m128 most = _mm_set1_ps(std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < count; i += 4) {
    __m128 ray[3], square[3];
    for (std::size_t axis = 0; axis != 3; ++axis) {
      ray[axis] = _mm_sub_ps(_mm_load_ps(at[axis] + i), _mm_set1_ps(f.origin[axis]));
      square[axis] = _mm_mul_ps(ray[axis], ray[axis]);
#if !defined(__clang__)
      asm("" : "+x"(square[axis]));  // rounded: see rounded_product
#endif
    }
    const __m128 squares = _mm_add_ps(_mm_add_ps(square[0], square[1]), square[2]);
    const __m256d distance = _mm256_sqrt_pd(_mm256_cvtps_pd(squares)), limit = _mm256_loadu_pd(limits + i);
    const __m256d within = _mm256_cmp_pd(distance, limit, _CMP_LE_OQ);
    const __m128 scale = _mm256_cvtpd_ps(distance), range = _mm256_cvtpd_ps(limit);
    const __m256d may_be_cut = _mm256_cmp_pd(limit, _mm256_setzero_pd(), _CMP_GE_OQ);
    const int hit = _mm256_movemask_pd(within);
    const int finite = _mm_movemask_ps(_mm_cmp_ps(scale, most, _CMP_LE_OQ));
    __m256d inside = _mm256_cmp_pd(low, low, _CMP_EQ_OQ);
    for (std::size_t axis = 0; axis != 3; ++axis) {
      __m128 end = _mm_load_ps(at[axis] + i);
      if (hit != 15) {
        __m128 step = _mm_mul_ps(_mm_div_ps(ray[axis], scale), range);
#if !defined(__clang__)
        asm("" : "+x"(step));
#endif
        const __m128i hits = _mm256_castsi256_si128(
            _mm256_permutevar8x32_epi32(_mm256_castpd_si256(within), _mm256_setr_epi32(0, 2, 4, 6, 0, 2, 4, 6)));
        end = _mm_blendv_ps(_mm_add_ps(_mm_set1_ps(f.origin[axis]), step), end, _mm_castsi128_ps(hits));
      }
      _mm_store_ps(rays.end[axis].data() + i, end);
      const __m256d cells = _mm256_mul_pd(_mm256_cvtps_pd(end), per_metre);
      inside = _mm256_and_pd(
          inside, _mm256_and_pd(_mm256_cmp_pd(cells, low, _CMP_GE_OQ), _mm256_cmp_pd(cells, high, _CMP_LT_OQ)));
      const __m128i cell = _mm256_cvtpd_epi32(_mm256_floor_pd(cells));
      const __m128i to_way = _mm_set1_epi32(static_cast<int>((f.grid.cells() >> 1U) - from[axis]));
      _mm_store_si128(reinterpret_cast<__m128i*>(rays.way[axis].data() + i), _mm_add_epi32(cell, to_way));
    }
    int live = _mm256_movemask_pd(inside);
    if (count - i < 4) live &= (1 << (count - i)) - 1;
    const int cut = live & ~hit & finite & _mm256_movemask_pd(may_be_cut);
    rays.hit[i >> 6U] |= std::uint64_t{static_cast<unsigned>(live & hit)} << (i & 63U);
    rays.cut[i >> 6U] |= std::uint64_t{static_cast<unsigned>(cut)} << (i & 63U);
  }
}

ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline void limit_rays_avx512(const ray_frame& f, const point_batch& points, const double* limits, std::size_t count,
                              ray_batch& rays) noexcept {
  rays.clear();
  constexpr __mmask8 all = 0xff;
  const std::array<const float*, 3> at{points.x.data(), points.y.data(), points.z.data()};
  const std::array<std::uint32_t, 3> from{f.from.x, f.from.y, f.from.z};
  const __m512d per_metre = _mm512_set1_pd(1.0 / f.grid.resolution());
  const __m512d high = _mm512_set1_pd(0.5 * f.grid.cells()), low = _mm512_set1_pd(-0.5 * f.grid.cells());
  const __m256 most = _mm256_set1_ps(std::numeric_limits<float>::max());
  for (std::size_t i = 0; i < count; i += 8) {
    __m256 ray[3], square[3];
    for (std::size_t axis = 0; axis != 3; ++axis) {
      ray[axis] = _mm256_sub_ps(_mm256_load_ps(at[axis] + i), _mm256_set1_ps(f.origin[axis]));
      square[axis] = _mm256_mul_ps(ray[axis], ray[axis]);
#if !defined(__clang__)
      asm("" : "+v"(square[axis]));  // rounded: see rounded_product
#endif
    }
    const __m256 squares = _mm256_add_ps(_mm256_add_ps(square[0], square[1]), square[2]);
    const __m512d distance = _mm512_maskz_sqrt_pd(all, _mm512_maskz_cvtps_pd(all, squares));
    const __m512d limit = _mm512_loadu_pd(limits + i);
    const __mmask8 hit = _mm512_cmp_pd_mask(distance, limit, _CMP_LE_OQ);
    const __m256 scale = _mm512_maskz_cvtpd_ps(all, distance), range = _mm512_maskz_cvtpd_ps(all, limit);
    __mmask8 live = count - i >= 8 ? all : static_cast<__mmask8>((1U << (count - i)) - 1U);
    for (std::size_t axis = 0; axis != 3; ++axis) {
      __m256 end = _mm256_load_ps(at[axis] + i);
      if (hit != all) {
        __m256 step = _mm256_mul_ps(_mm256_div_ps(ray[axis], scale), range);
#if !defined(__clang__)
        asm("" : "+v"(step));
#endif
        end = _mm256_mask_mov_ps(_mm256_add_ps(_mm256_set1_ps(f.origin[axis]), step), hit, end);
      }
      _mm256_store_ps(rays.end[axis].data() + i, end);
      const __m512d cells = _mm512_mul_pd(_mm512_maskz_cvtps_pd(all, end), per_metre);
      live &= _mm512_cmp_pd_mask(cells, low, _CMP_GE_OQ);
      live &= _mm512_cmp_pd_mask(cells, high, _CMP_LT_OQ);
      const __m256i cell = _mm512_maskz_cvt_roundpd_epi32(all, cells, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
      const __m256i to_way = _mm256_set1_epi32(static_cast<int>((f.grid.cells() >> 1U) - from[axis]));
      _mm256_store_si256(reinterpret_cast<__m256i*>(rays.way[axis].data() + i), _mm256_add_epi32(cell, to_way));
    }
    const unsigned may_be_cut = static_cast<unsigned>(_mm512_cmp_pd_mask(limit, _mm512_setzero_pd(), _CMP_GE_OQ)) &
                                _mm256_cmp_ps_mask(scale, most, _CMP_LE_OQ);
    rays.hit[i >> 6U] |= std::uint64_t{static_cast<unsigned>(live & hit)} << (i & 63U);
    rays.cut[i >> 6U] |= std::uint64_t{live & ~static_cast<unsigned>(hit) & may_be_cut} << (i & 63U);
  }
}
#endif

using limit_kernel = void(const ray_frame&, const point_batch&, const double*, std::size_t, ray_batch&);

[[nodiscard]] inline limit_kernel* limit_rays(simd::level level) noexcept {
  return simd::select<limit_kernel>(level, {
    .portable = limit_rays_portable,
#if ORBIS_X86
    .popcnt = nullptr, .avx2 = limit_rays_avx2, .avx512 = limit_rays_avx512
#endif
  });
}
}  // namespace orbis::octree::detail
