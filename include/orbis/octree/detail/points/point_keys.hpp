// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The voxels that points lie in, many points at a time.
#pragma once

#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <ranges>
#include <type_traits>

#include <orbis/core/point.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/storage/packed_lanes.hpp>
#include <orbis/octree/key.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// Some points, one array for each coordinate.
struct point_batch {
  static constexpr std::size_t capacity = 256;
  alignas(64) std::array<float, capacity> x, y, z;
};

inline void load_triples_portable(const float* points, std::size_t count, point_batch& batch) noexcept {
  for (std::size_t i = 0; i != count; ++i) {
    batch.x[i] = points[3 * i];
    batch.y[i] = points[3 * i + 1];
    batch.z[i] = points[3 * i + 2];
  }
}
#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void load_triples_avx2(const float* points, std::size_t count, point_batch& batch) noexcept {
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    const float* const p = points + 3 * i;
    const __m256 a = _mm256_loadu_ps(p), b = _mm256_loadu_ps(p + 8), c = _mm256_loadu_ps(p + 16);
    const __m256 x = _mm256_blend_ps(_mm256_blend_ps(a, b, 0x92), c, 0x24);
    const __m256 y = _mm256_blend_ps(_mm256_blend_ps(a, b, 0x24), c, 0x49);
    const __m256 z = _mm256_blend_ps(_mm256_blend_ps(a, b, 0x49), c, 0x92);
    _mm256_store_ps(batch.x.data() + i, _mm256_permutevar8x32_ps(x, _mm256_setr_epi32(0, 3, 6, 1, 4, 7, 2, 5)));
    _mm256_store_ps(batch.y.data() + i, _mm256_permutevar8x32_ps(y, _mm256_setr_epi32(1, 4, 7, 2, 5, 0, 3, 6)));
    _mm256_store_ps(batch.z.data() + i, _mm256_permutevar8x32_ps(z, _mm256_setr_epi32(2, 5, 0, 3, 6, 1, 4, 7)));
  }
  for (; i != count; ++i) {
    batch.x[i] = points[3 * i];
    batch.y[i] = points[3 * i + 1];
    batch.z[i] = points[3 * i + 2];
  }
}
ORBIS_TARGET("avx512f")
inline void load_triples_avx512(const float* points, std::size_t count, point_batch& batch) noexcept {
  // Of each coordinate the first two registers hold eleven, the third the rest.
  const __m512i every_third = _mm512_setr_epi32(0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 33, 36, 39, 42, 45);
  std::size_t i = 0;
  for (; i + 16 <= count; i += 16) {
    const float* const p = points + 3 * i;
    const __m512 a = _mm512_loadu_ps(p), b = _mm512_loadu_ps(p + 16), c = _mm512_loadu_ps(p + 32);
    const auto coordinate = [&](int first, __mmask16 in_c) ORBIS_TARGET("avx512f") {
      const __m512i at = _mm512_add_epi32(_mm512_set1_epi32(first), every_third);
      return _mm512_mask_permutexvar_ps(_mm512_permutex2var_ps(a, at, b), in_c, at, c);
    };
    _mm512_store_ps(batch.x.data() + i, coordinate(0, 0xf800));  // 33, 36 ... lie in c
    _mm512_store_ps(batch.y.data() + i, coordinate(1, 0xf800));
    _mm512_store_ps(batch.z.data() + i, coordinate(2, 0xfc00));
  }
  for (; i != count; ++i) {
    batch.x[i] = points[3 * i];
    batch.y[i] = points[3 * i + 1];
    batch.z[i] = points[3 * i + 2];
  }
}
#endif

/// Whether the points of a range are floats x, y, z, x, y, z ... in memory.
template <class Points>
concept float_triples = std::ranges::contiguous_range<Points> && requires(const std::ranges::range_value_t<Points>& p) {
  requires sizeof(p) == 3 * sizeof(float);
  { p.data() } -> std::same_as<const float*>;
  { p[0] } -> std::convertible_to<float>;
};

/// The points of a range as functions of their number; whole batches at once where that is faster.
template <point_range Points>
struct point_source {
  const Points& points;

  [[nodiscard]] std::array<float, 3> operator()(std::size_t i) const {
    return coordinates<float>(
        std::ranges::begin(points)[static_cast<std::ranges::range_difference_t<const Points>>(i)]);
  }
  void load(std::size_t begin, std::size_t count, point_batch& batch) const requires float_triples<const Points> {
    auto* const load = simd::select<void(const float*, std::size_t, point_batch&)>(simd::detected(), {
      .portable = load_triples_portable,
#if ORBIS_X86
      .popcnt = nullptr, .avx2 = load_triples_avx2, .avx512 = load_triples_avx512
#endif
    });
    load(std::ranges::data(points)[begin].data(), count, batch);
  }
};

/// Loads the points [begin, begin + count) of a source, which is any function of their number.
template <class Source>
void load_points(Source&& source, std::size_t begin, std::size_t count, point_batch& batch) {
  if constexpr (requires { source.load(begin, count, batch); }) {
    source.load(begin, count, batch);
  } else {
    for (std::size_t i = 0; i != count; ++i) {
      const std::array<float, 3> p = source(begin + i);
      batch.x[i] = p[0];
      batch.y[i] = p[1];
      batch.z[i] = p[2];
    }
  }
}

/// The voxels of some points, in their order, without those that equal the one before; and the number
/// of points that lie in none.
struct batch_keys {
  alignas(64) std::array<std::uint32_t, point_batch::capacity + 16> x, y, z;
  std::size_t count = 0;
  std::size_t outside = 0;
};

inline void find_keys_portable(const voxel_grid& grid, const point_batch& points, std::size_t begin, std::size_t count,
                               batch_keys& keys) noexcept {
  for (std::size_t i = begin; i != count; ++i) {
    const auto key = grid.key(std::array{points.x[i], points.y[i], points.z[i]});
    if (!key) {
      ++keys.outside;
      continue;
    }
    keys.x[keys.count] = key->x;
    keys.y[keys.count] = key->y;
    keys.z[keys.count] = key->z;
    const std::size_t n = keys.count;
    keys.count += n == 0 || key->x != keys.x[n - 1] || key->y != keys.y[n - 1] || key->z != keys.z[n - 1] ? 1 : 0;
  }
}
inline void find_keys_portable(const voxel_grid& grid, const point_batch& points, std::size_t count,
                               batch_keys& keys) noexcept {
  keys.count = keys.outside = 0;
  find_keys_portable(grid, points, 0, count, keys);
}

#if ORBIS_X86
/// What voxel_grid::key does, of eight coordinates; clears the lanes of those outside in `inside`.
ORBIS_TARGET("avx2")
inline __m256i cells_avx2(const float* at, double per_metre, double half, __m256i& inside) noexcept {
  const __m256d scale = _mm256_set1_pd(per_metre), high = _mm256_set1_pd(half), low = _mm256_set1_pd(-half);
  const __m256d a = _mm256_mul_pd(_mm256_cvtps_pd(_mm_load_ps(at)), scale);
  const __m256d b = _mm256_mul_pd(_mm256_cvtps_pd(_mm_load_ps(at + 4)), scale);
  const auto in = [&](__m256d x) ORBIS_TARGET("avx2") {
    return _mm256_and_pd(_mm256_cmp_pd(x, low, _CMP_GE_OQ), _mm256_cmp_pd(x, high, _CMP_LT_OQ));
  };
  const __m256 halves = _mm256_shuffle_ps(_mm256_castpd_ps(in(a)), _mm256_castpd_ps(in(b)), 0x88);
  inside = _mm256_and_si256(inside, _mm256_permute4x64_epi64(_mm256_castps_si256(halves), 0xd8));
  const __m256i cells = _mm256_inserti128_si256(_mm256_castsi128_si256(_mm256_cvtpd_epi32(_mm256_floor_pd(a))),
                                                _mm256_cvtpd_epi32(_mm256_floor_pd(b)), 1);
  return _mm256_add_epi32(cells, _mm256_set1_epi32(static_cast<int>(half)));
}
ORBIS_TARGET("avx2,popcnt")
inline void find_keys_avx2(const voxel_grid& grid, const point_batch& points, std::size_t count,
                           batch_keys& keys) noexcept {
  const double per_metre = 1.0 / grid.resolution(), half = 0.5 * grid.cells();
  const __m256i none = _mm256_set1_epi32(-1), rotation = _mm256_setr_epi32(7, 0, 1, 2, 3, 4, 5, 6);
  __m256i x0 = none, y0 = none, z0 = none;  // of the voxel before, rotated; no voxel at first
  std::size_t i = 0, n = 0, outside = 0;
  for (; i + 8 <= count; i += 8) {
    __m256i inside = none;
    __m256i x = cells_avx2(points.x.data() + i, per_metre, half, inside);
    const __m256i y = cells_avx2(points.y.data() + i, per_metre, half, inside);
    const __m256i z = cells_avx2(points.z.data() + i, per_metre, half, inside);
    x = _mm256_blendv_epi8(none, x, inside);  // what lies outside equals no voxel
    const auto same = [&](__m256i k, __m256i& before) ORBIS_TARGET("avx2") {
      const __m256i turned = _mm256_permutevar8x32_epi32(k, rotation);
      const __m256i equal = _mm256_cmpeq_epi32(k, _mm256_blend_epi32(turned, before, 1));
      before = turned;
      return equal;
    };
    const __m256i same_x = same(x, x0), same_y = same(y, y0), same_z = same(z, z0);
    const __m256i repeated = _mm256_and_si256(same_x, _mm256_and_si256(same_y, same_z));
    const auto bits = [](__m256i mask) ORBIS_TARGET("avx2") {
      return static_cast<std::uint32_t>(_mm256_movemask_ps(_mm256_castsi256_ps(mask)));
    };
    const std::uint32_t fresh = bits(_mm256_andnot_si256(repeated, inside));
    const __m256i packed = packed_lanes(fresh);
    const auto store = [&](std::uint32_t* to, __m256i k) ORBIS_TARGET("avx2") {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + n), _mm256_permutevar8x32_epi32(k, packed));
    };
    store(keys.x.data(), x);
    store(keys.y.data(), y);
    store(keys.z.data(), z);
    n += static_cast<std::size_t>(__builtin_popcount(fresh));
    outside += static_cast<std::size_t>(8 - __builtin_popcount(bits(inside)));
  }
  keys.count = n;
  keys.outside = outside;
  find_keys_portable(grid, points, i, count, keys);
}

/// What voxel_grid::key does, of sixteen coordinates; clears the bits of those outside in `inside`.
ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline __m512i cells_avx512(const float* at, double per_metre, double half, __mmask16& inside) noexcept {
  const __m512d scale = _mm512_set1_pd(per_metre), high = _mm512_set1_pd(half), low = _mm512_set1_pd(-half);
  const __m512d a = _mm512_mul_pd(_mm512_maskz_cvtps_pd(0xff, _mm256_loadu_ps(at)), scale);
  const __m512d b = _mm512_mul_pd(_mm512_maskz_cvtps_pd(0xff, _mm256_loadu_ps(at + 8)), scale);
  const auto in_a =
      static_cast<__mmask8>(_mm512_cmp_pd_mask(a, low, _CMP_GE_OQ) & _mm512_cmp_pd_mask(a, high, _CMP_LT_OQ));
  const auto in_b =
      static_cast<__mmask8>(_mm512_cmp_pd_mask(b, low, _CMP_GE_OQ) & _mm512_cmp_pd_mask(b, high, _CMP_LT_OQ));
  inside &= static_cast<__mmask16>(in_a | in_b << 8U);
  constexpr int down = _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC;
  const __m512i cells =
      _mm512_maskz_inserti64x4(0xff, _mm512_castsi256_si512(_mm512_maskz_cvt_roundpd_epi32(in_a, a, down)),
                               _mm512_maskz_cvt_roundpd_epi32(in_b, b, down), 1);
  return _mm512_add_epi32(cells, _mm512_set1_epi32(static_cast<int>(half)));
}
ORBIS_TARGET("avx512f,avx512dq,avx512vl,popcnt")
inline void find_keys_avx512(const voxel_grid& grid, const point_batch& points, std::size_t count,
                             batch_keys& keys) noexcept {
  const double per_metre = 1.0 / grid.resolution(), half = 0.5 * grid.cells();
  __m512i x0 = _mm512_set1_epi32(-1), y0 = x0, z0 = x0;  // of the voxel before; no voxel at first
  const __m512i before = _mm512_setr_epi32(15, 16, 17, 18, 19, 20, 21, 22, 23, 24, 25, 26, 27, 28, 29, 30);
  std::size_t i = 0, n = 0, outside = 0;
  for (; i + 16 <= count; i += 16) {
    __mmask16 inside = 0xffff;
    const __m512i x = cells_avx512(points.x.data() + i, per_metre, half, inside);
    const __m512i y = cells_avx512(points.y.data() + i, per_metre, half, inside);
    const __m512i z = cells_avx512(points.z.data() + i, per_metre, half, inside);
    const auto fresh =
        static_cast<__mmask16>(inside & (_mm512_cmpneq_epi32_mask(x, _mm512_permutex2var_epi32(x0, before, x)) |
                                         _mm512_cmpneq_epi32_mask(y, _mm512_permutex2var_epi32(y0, before, y)) |
                                         _mm512_cmpneq_epi32_mask(z, _mm512_permutex2var_epi32(z0, before, z)) |
                                         // The one before lies outside: its cell means nothing.
                                         static_cast<unsigned>(static_cast<__mmask16>(~inside)) << 1U));
    _mm512_storeu_si512(keys.x.data() + n, _mm512_maskz_compress_epi32(fresh, x));
    _mm512_storeu_si512(keys.y.data() + n, _mm512_maskz_compress_epi32(fresh, y));
    _mm512_storeu_si512(keys.z.data() + n, _mm512_maskz_compress_epi32(fresh, z));
    n += static_cast<std::size_t>(__builtin_popcount(fresh));
    outside += static_cast<std::size_t>(16 - __builtin_popcount(inside));
    const __m512i last = _mm512_set1_epi32(-1);
    x0 = (inside & 0x8000U) != 0 ? x : last;
    y0 = y;
    z0 = z;
  }
  keys.count = n;
  keys.outside = outside;
  find_keys_portable(grid, points, i, count, keys);
}
#endif

using keys_kernel = void(const voxel_grid&, const point_batch&, std::size_t, batch_keys&);

[[nodiscard]] inline keys_kernel* find_keys(simd::level level) noexcept {
  return simd::select<keys_kernel>(level, {
    .portable = find_keys_portable,
#if ORBIS_X86
    .popcnt = nullptr, .avx2 = find_keys_avx2, .avx512 = find_keys_avx512
#endif
  });
}

}  // namespace orbis::octree::detail
