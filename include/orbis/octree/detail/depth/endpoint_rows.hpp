// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the ray of a pixel ends, and the same for a row of pixels at a time.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include <orbis/camera/depth.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/depth_points.hpp>
#include <orbis/octree/detail/points/ray_traversal.hpp>
#include <orbis/octree/key.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// The end of one ray.
struct ray_endpoint {
  enum class fate { none, used, truncated, rejected };
  fate what = fate::none;
  float3 point{};   ///< where it ends, metres
  voxel_key key{};  ///< the voxel it ends in
  float z = 0.0F;   ///< its depth along the optical axis there, up to a few roundings
};

/// The sensor of one depth image.
struct depth_sensor {
  voxel_grid grid;
  camera::float_pose pose;
  std::optional<voxel_key> key;  ///< the voxel of the camera's centre
  double max_range;
  float max_square;  ///< the largest squared distance that is within range

  depth_sensor(const voxel_grid& g, const se3& T_world_camera, double range)
      : grid{g}, pose{T_world_camera}, max_range{range}, max_square{largest_square(range)} {
    if (is_finite(pose.centre)) key = grid.key(pose.centre);
  }

  /// What becomes of the ray through (x, y, 1) that was measured to be `z` deep: the rules of point_integrator.
  [[nodiscard]] ray_endpoint end(float x, float y, float z) const noexcept {
    if (!(z > 0.0F) || std::isnan(x)) return {};
    ray_endpoint e{.what = ray_endpoint::fate::used, .point = camera::world_point(pose, x, y, z), .key = {}, .z = z};
    const float3 ray = difference(e.point, pose.centre);
    const double distance = length(ray);
    if (!(distance <= max_range)) {
      const auto scale = static_cast<float>(distance);
      const auto range = static_cast<float>(max_range);
      for (std::size_t i = 0; i != 3; ++i) e.point[i] = pose.centre[i] + rounded_product(ray[i] / scale, range);
      e.z = z * (range / scale);
      e.what = std::isfinite(scale) ? ray_endpoint::fate::truncated : ray_endpoint::fate::rejected;
    }
    if (const auto k = grid.key(e.point))
      e.key = *k;
    else
      e.what = ray_endpoint::fate::rejected;
    return e;
  }

 private:
  /// The largest float whose root (in double) is at most `range`.
  [[nodiscard]] static float largest_square(double range) noexcept {
    constexpr float most = std::numeric_limits<float>::infinity();
    if (std::isinf(range)) return most;
    auto square = static_cast<float>(range * range);
    while (square > 0.0F && std::sqrt(static_cast<double>(square)) > range) square = std::nextafter(square, 0.0F);
    for (float next; std::sqrt(static_cast<double>(next = std::nextafter(square, most))) <= range;) square = next;
    return square;
  }
};

/// One row of pixels on its way from depths to ends. Every array holds `width` values and is padded.
struct end_row {
  int width = 0;
  const float* x = nullptr;
  const float* y = nullptr;
  bool one_y = false;  ///< y is a single value
  float* z = nullptr;  ///< in: metres, 0 where there is nothing; out: where the ray ends, 0 if it is not walked
  std::array<std::int32_t*, 3> key{};  ///< out: the voxels of the ends that are used, -1 for the others
};

/// What a row or an image came to.
struct end_counts {
  std::size_t used = 0, truncated = 0, rejected = 0;
  bool leaves = false;  ///< a ray ends outside the voxel of the camera's centre
  float max_z = 0.0F;
  double sum_z = 0.0;  ///< of the rays that are walked; up to rounding

  void add(const end_counts& o) noexcept {
    used += o.used;
    truncated += o.truncated;
    rejected += o.rejected;
    leaves = leaves || o.leaves;
    max_z = std::max(max_z, o.max_z);
    sum_z += o.sum_z;
  }
};

/// Fills in where the rays of a row end. All variants give the same ends and counts.
inline void find_ends_portable(const depth_sensor& s, const end_row& row, end_counts& counts) noexcept {
  for (int u = 0; u != row.width; ++u) {
    const ray_endpoint e = s.end(row.x[u], row.y[row.one_y ? 0 : u], row.z[u]);
    const bool used = e.what == ray_endpoint::fate::used, walked = used || e.what == ray_endpoint::fate::truncated;
    counts.used += used ? 1 : 0;
    counts.truncated += walked && !used ? 1 : 0;
    counts.rejected += e.what == ray_endpoint::fate::rejected ? 1 : 0;
    counts.leaves = counts.leaves || (walked && s.key && e.key != *s.key);
    row.z[u] = walked ? e.z : 0.0F;
    counts.max_z = std::max(counts.max_z, row.z[u]);
    counts.sum_z += static_cast<double>(row.z[u]);
    row.key[0][u] = used ? static_cast<std::int32_t>(e.key.x) : -1;
    row.key[1][u] = used ? static_cast<std::int32_t>(e.key.y) : -1;
    row.key[2][u] = used ? static_cast<std::int32_t>(e.key.z) : -1;
  }
}

/// Bit i: the voxel of pixel `u + i` is neither that of the pixel before it nor that of the pixel
/// above it. `key[i][-1]` and `above[i]` must be readable; pixels without a voxel have -1.
inline unsigned fresh_portable(const std::array<const std::int32_t*, 3>& key,
                               const std::array<const std::int32_t*, 3>& above, int u) noexcept {
  unsigned fresh = 0;
  for (int i = u; i != u + 16; ++i) {
    const bool left = key[0][i] == key[0][i - 1] && key[1][i] == key[1][i - 1] && key[2][i] == key[2][i - 1];
    const bool up = key[0][i] == above[0][i] && key[1][i] == above[1][i] && key[2][i] == above[2][i];
    if (key[0][i] != -1 && !left && !up) fresh |= 1U << static_cast<unsigned>(i - u);
  }
  return fresh;
}

#if ORBIS_X86
/// A product that is not fused with the sum it is part of, see rounded_product.
ORBIS_TARGET("avx2")
inline __m256 rounded_mul(__m256 a, __m256 b) noexcept {
  __m256 product = _mm256_mul_ps(a, b);
#if !defined(__clang__)
  asm("" : "+x"(product));
#endif
  return product;
}

/// The voxels along one axis as far as float arithmetic can tell; where it cannot, `unsure` is set.
/// The product errs by two roundings, so that a voxel is certain four of them away from its faces.
ORBIS_TARGET("avx2")
inline __m256i likely_keys_avx2(__m256 p, float per_metre, float half, __m256& unsure) noexcept {
  const __m256 sign = _mm256_set1_ps(-0.0F);
  const __m256 cells = _mm256_mul_ps(p, _mm256_set1_ps(per_metre)), floor = _mm256_floor_ps(cells);
  const __m256 above = _mm256_sub_ps(cells, floor), size = _mm256_andnot_ps(sign, cells);
  const __m256 room = _mm256_min_ps(above, _mm256_sub_ps(_mm256_set1_ps(1.0F), above));
  const __m256 sure = _mm256_and_ps(_mm256_cmp_ps(room, _mm256_mul_ps(size, _mm256_set1_ps(0x1p-22F)), _CMP_GT_OQ),
                                    _mm256_cmp_ps(size, _mm256_set1_ps(half - 2.0F), _CMP_LT_OQ));
  unsure = _mm256_or_ps(unsure, _mm256_xor_ps(sure, _mm256_castsi256_ps(_mm256_set1_epi32(-1))));
  return _mm256_add_epi32(_mm256_cvttps_epi32(floor), _mm256_set1_epi32(static_cast<int>(half)));
}
/// The voxels along one axis, and whether they are in the grid; see voxel_grid::key.
ORBIS_TARGET("avx2")
inline __m256i keys_avx2(__m256 p, double per_metre, double half, __m256& inside) noexcept {
  const __m256d scale = _mm256_set1_pd(per_metre), least = _mm256_set1_pd(-half), most = _mm256_set1_pd(half);
  const __m256d a = _mm256_mul_pd(_mm256_cvtps_pd(_mm256_castps256_ps128(p)), scale);
  const __m256d b = _mm256_mul_pd(_mm256_cvtps_pd(_mm256_extractf128_ps(p, 1)), scale);
  const __m256d in_a = _mm256_and_pd(_mm256_cmp_pd(a, least, _CMP_GE_OQ), _mm256_cmp_pd(a, most, _CMP_LT_OQ));
  const __m256d in_b = _mm256_and_pd(_mm256_cmp_pd(b, least, _CMP_GE_OQ), _mm256_cmp_pd(b, most, _CMP_LT_OQ));
  const __m256i narrow = _mm256_castps_si256(_mm256_shuffle_ps(_mm256_castpd_ps(in_a), _mm256_castpd_ps(in_b), 0x88));
  inside = _mm256_and_ps(inside, _mm256_castsi256_ps(_mm256_permute4x64_epi64(narrow, 0xd8)));
  const __m256d shift = _mm256_set1_pd(half);
  const __m128i ka = _mm256_cvttpd_epi32(_mm256_add_pd(_mm256_floor_pd(a), shift));
  const __m128i kb = _mm256_cvttpd_epi32(_mm256_add_pd(_mm256_floor_pd(b), shift));
  return _mm256_inserti128_si256(_mm256_castsi128_si256(ka), kb, 1);
}

ORBIS_TARGET("avx2,popcnt")
inline void find_ends_avx2(const depth_sensor& s, const end_row& row, end_counts& counts) noexcept {
  const double per_metre = 1.0 / s.grid.resolution(), half = 0.5 * s.grid.cells();
  const auto per_metre_f = static_cast<float>(per_metre), half_f = static_cast<float>(half);
  const __m256 zero = _mm256_setzero_ps(), max_square = _mm256_set1_ps(s.max_square);
  const __m256 range = _mm256_set1_ps(static_cast<float>(s.max_range));
  const __m256 infinite = _mm256_set1_ps(std::numeric_limits<float>::infinity());
  const voxel_key from = s.key.value_or(voxel_key{});
  const __m256i from_x = _mm256_set1_epi32(static_cast<int>(from.x)), none = _mm256_set1_epi32(-1);
  const __m256i from_y = _mm256_set1_epi32(static_cast<int>(from.y));
  const __m256i from_z = _mm256_set1_epi32(static_cast<int>(from.z));
  __m256 stays = _mm256_castsi256_ps(none), max_z = zero, sum_z = zero;
  std::size_t used_count = 0, truncated_count = 0, rejected_count = 0;
  for (int u = 0; u < row.width; u += 8) {
    const __m256 z = _mm256_loadu_ps(row.z + u), x = _mm256_loadu_ps(row.x + u);
    const __m256 y = row.one_y ? _mm256_set1_ps(*row.y) : _mm256_loadu_ps(row.y + u);
    const __m256 valid = _mm256_and_ps(_mm256_cmp_ps(z, zero, _CMP_GT_OQ), _mm256_cmp_ps(x, x, _CMP_ORD_Q));
    const __m256 cx = rounded_mul(x, z), cy = rounded_mul(y, z);
    const auto along = [&](std::size_t i) ORBIS_TARGET("avx2") {
      const float3& r = s.pose.rows[i];
      const __m256 xy = _mm256_add_ps(rounded_mul(_mm256_set1_ps(r[0]), cx), rounded_mul(_mm256_set1_ps(r[1]), cy));
      return _mm256_add_ps(_mm256_add_ps(xy, rounded_mul(_mm256_set1_ps(r[2]), z)), _mm256_set1_ps(s.pose.centre[i]));
    };
    __m256 px = along(0), py = along(1), pz = along(2), end_z = z;
    const __m256 ox = _mm256_set1_ps(s.pose.centre[0]), oy = _mm256_set1_ps(s.pose.centre[1]);
    const __m256 oz = _mm256_set1_ps(s.pose.centre[2]);
    const __m256 dx = _mm256_sub_ps(px, ox), dy = _mm256_sub_ps(py, oy), dz = _mm256_sub_ps(pz, oz);
    const __m256 square = _mm256_add_ps(_mm256_add_ps(rounded_mul(dx, dx), rounded_mul(dy, dy)), rounded_mul(dz, dz));
    const __m256 within = _mm256_cmp_ps(square, max_square, _CMP_LE_OQ);
    __m256 good = valid;
    if (_mm256_movemask_ps(_mm256_andnot_ps(within, valid)) != 0) {
      // The root of a float, taken in double and rounded, is the root taken in float.
      const __m256 scale = _mm256_sqrt_ps(square);
      const auto cut = [&](__m256 d, __m256 o) ORBIS_TARGET("avx2") {
        return _mm256_add_ps(o, rounded_mul(_mm256_div_ps(d, scale), range));
      };
      px = _mm256_blendv_ps(cut(dx, ox), px, within);
      py = _mm256_blendv_ps(cut(dy, oy), py, within);
      pz = _mm256_blendv_ps(cut(dz, oz), pz, within);
      end_z = _mm256_blendv_ps(_mm256_mul_ps(z, _mm256_div_ps(range, scale)), z, within);
      good = _mm256_and_ps(good, _mm256_or_ps(within, _mm256_cmp_ps(scale, infinite, _CMP_LT_OQ)));
    }
    __m256 unsure = zero;
    __m256i kx = likely_keys_avx2(px, per_metre_f, half_f, unsure),
            ky = likely_keys_avx2(py, per_metre_f, half_f, unsure);
    __m256i kz = likely_keys_avx2(pz, per_metre_f, half_f, unsure);
    if (_mm256_movemask_ps(_mm256_and_ps(unsure, good)) != 0) {
      kx = keys_avx2(px, per_metre, half, good);
      ky = keys_avx2(py, per_metre, half, good);
      kz = keys_avx2(pz, per_metre, half, good);
    }
    const __m256 used = _mm256_and_ps(good, within);
    const auto count = [&](__m256 m) ORBIS_TARGET("avx2,popcnt") {
      return static_cast<std::size_t>(_mm_popcnt_u32(static_cast<unsigned>(_mm256_movemask_ps(m))));
    };
    const std::size_t good_count = count(good), used_here = count(used);
    used_count += used_here;
    truncated_count += good_count - used_here;
    rejected_count += count(valid) - good_count;
    const __m256i same =
        _mm256_and_si256(_mm256_and_si256(_mm256_cmpeq_epi32(kx, from_x), _mm256_cmpeq_epi32(ky, from_y)),
                         _mm256_cmpeq_epi32(kz, from_z));
    stays =
        _mm256_and_ps(stays, _mm256_or_ps(_mm256_castsi256_ps(same), _mm256_xor_ps(good, _mm256_castsi256_ps(none))));
    end_z = _mm256_and_ps(end_z, good);
    max_z = _mm256_max_ps(max_z, end_z);
    sum_z = _mm256_add_ps(sum_z, end_z);
    _mm256_storeu_ps(row.z + u, end_z);
    const __m256i keep = _mm256_castps_si256(used);
    const auto store = [&](std::size_t i, __m256i k) ORBIS_TARGET("avx2") {
      _mm256_storeu_si256(reinterpret_cast<__m256i*>(row.key[i] + u), _mm256_blendv_epi8(none, k, keep));
    };
    store(0, kx);
    store(1, ky);
    store(2, kz);
  }
  alignas(32) std::array<float, 8> lanes;
  _mm256_store_ps(lanes.data(), max_z);
  for (const float v : lanes) counts.max_z = std::max(counts.max_z, v);
  _mm256_store_ps(lanes.data(), sum_z);
  for (const float v : lanes) counts.sum_z += static_cast<double>(v);
  counts.used += used_count;
  counts.truncated += truncated_count;
  counts.rejected += rejected_count;
  counts.leaves = counts.leaves || (s.key && _mm256_movemask_ps(stays) != 0xff);
}

ORBIS_TARGET("avx2")
inline unsigned fresh_avx2(const std::array<const std::int32_t*, 3>& key,
                           const std::array<const std::int32_t*, 3>& above, int u) noexcept {
  const auto eight = [&](int i) ORBIS_TARGET("avx2") {
    const auto load = [&](const std::int32_t* p)
                          ORBIS_TARGET("avx2") { return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p)); };
    const __m256i x = load(key[0] + i), y = load(key[1] + i), z = load(key[2] + i);
    const auto same = [&](const __m256i a, const __m256i b, const __m256i c) ORBIS_TARGET("avx2") {
      return _mm256_and_si256(_mm256_and_si256(_mm256_cmpeq_epi32(x, a), _mm256_cmpeq_epi32(y, b)),
                              _mm256_cmpeq_epi32(z, c));
    };
    const __m256i left = same(load(key[0] + i - 1), load(key[1] + i - 1), load(key[2] + i - 1));
    const __m256i up = same(load(above[0] + i), load(above[1] + i), load(above[2] + i));
    const __m256i known = _mm256_or_si256(_mm256_or_si256(left, up), _mm256_cmpeq_epi32(x, _mm256_set1_epi32(-1)));
    return static_cast<unsigned>(_mm256_movemask_ps(_mm256_castsi256_ps(known)));
  };
  return ~(eight(u) | eight(u + 8) << 8U) & 0xffffU;
}

ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline __m512 rounded_mul(const __m512& a, const __m512& b) noexcept {
  __m512 product = _mm512_mul_ps(a, b);
#if !defined(__clang__)
  asm("" : "+v"(product));
#endif
  return product;
}

/// See likely_keys_avx2; `room` falls to 0 and below where that cannot tell, `size` grows to the largest coordinate.
ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline __m512i likely_keys_avx512(const __m512& p, float per_metre, float half, __m512& room, __m512& size) noexcept {
  const __m512 cells = _mm512_mul_ps(p, _mm512_set1_ps(per_metre));
  const __m512 floor = _mm512_maskz_roundscale_ps(0xffff, cells, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
  const __m512 above = _mm512_sub_ps(cells, floor), own = _mm512_abs_ps(cells);
  const __m512 to_face = _mm512_maskz_min_ps(0xffff, above, _mm512_sub_ps(_mm512_set1_ps(1.0F), above));
  // Of a minimum and a maximum with NaN the second operand comes out.
  room = _mm512_maskz_min_ps(0xffff, room, _mm512_fnmadd_ps(own, _mm512_set1_ps(0x1p-22F), to_face));
  size = _mm512_maskz_max_ps(0xffff, size, own);
  return _mm512_add_epi32(_mm512_maskz_cvttps_epi32(0xffff, floor), _mm512_set1_epi32(static_cast<int>(half)));
}

/// Ends of sixteen rays at a time; where float arithmetic cannot tell all of their voxels, it leaves
/// the sixteen to the narrower kernel.
ORBIS_TARGET("avx512f,avx512dq,avx512vl,popcnt")
inline void find_ends_avx512(const depth_sensor& s, const end_row& row, end_counts& counts) noexcept {
  const auto per_metre = static_cast<float>(1.0 / s.grid.resolution()),
             half = 0.5F * static_cast<float>(s.grid.cells());
  const __m512 zero = _mm512_setzero_ps(), max_square = _mm512_set1_ps(s.max_square);
  const voxel_key from = s.key.value_or(voxel_key{});
  const __m512i none = _mm512_set1_epi32(-1), from_x = _mm512_set1_epi32(static_cast<int>(from.x));
  const __m512i from_y = _mm512_set1_epi32(static_cast<int>(from.y));
  const __m512i from_z = _mm512_set1_epi32(static_cast<int>(from.z));
  const auto set = [&](float v) ORBIS_TARGET("avx512f") { return _mm512_set1_ps(v); };
  const __m512 r00 = set(s.pose.rows[0][0]), r01 = set(s.pose.rows[0][1]), r02 = set(s.pose.rows[0][2]);
  const __m512 r10 = set(s.pose.rows[1][0]), r11 = set(s.pose.rows[1][1]), r12 = set(s.pose.rows[1][2]);
  const __m512 r20 = set(s.pose.rows[2][0]), r21 = set(s.pose.rows[2][1]), r22 = set(s.pose.rows[2][2]);
  const __m512 ox = set(s.pose.centre[0]), oy = set(s.pose.centre[1]), oz = set(s.pose.centre[2]);
  __m512 max_z = zero, sum_z = zero;
  unsigned leaves = 0;
  std::size_t used = 0;
  for (int u = 0; u < row.width; u += 16) {
    const __m512 z = _mm512_loadu_ps(row.z + u), x = _mm512_loadu_ps(row.x + u);
    const __m512 y = row.one_y ? set(*row.y) : _mm512_loadu_ps(row.y + u);
    const __mmask16 valid = _mm512_mask_cmp_ps_mask(_mm512_cmp_ps_mask(z, zero, _CMP_GT_OQ), x, x, _CMP_ORD_Q);
    const __m512 cx = rounded_mul(x, z), cy = rounded_mul(y, z);
    const auto along = [&](const __m512& a, const __m512& b, const __m512& c, const __m512& o)
                           ORBIS_TARGET("avx512f,avx512dq,avx512vl") {
                             const __m512 xy = _mm512_add_ps(rounded_mul(a, cx), rounded_mul(b, cy));
                             return _mm512_add_ps(_mm512_add_ps(xy, rounded_mul(c, z)), o);
                           };
    const __m512 px = along(r00, r01, r02, ox), py = along(r10, r11, r12, oy), pz = along(r20, r21, r22, oz);
    const __m512 dx = _mm512_sub_ps(px, ox), dy = _mm512_sub_ps(py, oy), dz = _mm512_sub_ps(pz, oz);
    const __m512 square = _mm512_add_ps(_mm512_add_ps(rounded_mul(dx, dx), rounded_mul(dy, dy)), rounded_mul(dz, dz));
    __m512 room = _mm512_set1_ps(1.0F), size = zero;
    const __m512i kx = likely_keys_avx512(px, per_metre, half, room, size);
    const __m512i ky = likely_keys_avx512(py, per_metre, half, room, size);
    const __m512i kz = likely_keys_avx512(pz, per_metre, half, room, size);
    // NaN can get lost in room and size, but not in the square.
    const __mmask16 sure = static_cast<__mmask16>(_mm512_mask_cmp_ps_mask(valid, square, max_square, _CMP_LE_OQ) &
                                                  _mm512_cmp_ps_mask(room, zero, _CMP_GT_OQ) &
                                                  _mm512_cmp_ps_mask(size, _mm512_set1_ps(half - 2.0F), _CMP_LT_OQ));
    if (sure != valid) {
      find_ends_avx2(s,
                     {16,
                      row.x + u,
                      row.one_y ? row.y : row.y + u,
                      row.one_y,
                      row.z + u,
                      {row.key[0] + u, row.key[1] + u, row.key[2] + u}},
                     counts);
      continue;
    }
    used += static_cast<std::size_t>(_mm_popcnt_u32(valid));
    const unsigned away = _mm512_mask_cmpneq_epi32_mask(valid, kx, from_x) |
                          _mm512_mask_cmpneq_epi32_mask(valid, ky, from_y) |
                          _mm512_mask_cmpneq_epi32_mask(valid, kz, from_z);
    leaves |= away;
    const __m512 end_z = _mm512_maskz_mov_ps(valid, z);
    max_z = _mm512_maskz_max_ps(0xffff, max_z, end_z);
    sum_z = _mm512_add_ps(sum_z, end_z);
    _mm512_storeu_ps(row.z + u, end_z);
    _mm512_storeu_si512(row.key[0] + u, _mm512_mask_mov_epi32(none, valid, kx));
    _mm512_storeu_si512(row.key[1] + u, _mm512_mask_mov_epi32(none, valid, ky));
    _mm512_storeu_si512(row.key[2] + u, _mm512_mask_mov_epi32(none, valid, kz));
  }
  alignas(64) std::array<float, 16> lanes;
  _mm512_store_ps(lanes.data(), max_z);
  for (const float v : lanes) counts.max_z = std::max(counts.max_z, v);
  _mm512_store_ps(lanes.data(), sum_z);
  for (const float v : lanes) counts.sum_z += static_cast<double>(v);
  counts.used += used;
  counts.leaves = counts.leaves || (s.key && leaves != 0);
}

ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline unsigned fresh_avx512(const std::array<const std::int32_t*, 3>& key,
                             const std::array<const std::int32_t*, 3>& above, int u) noexcept {
  const __m512i x = _mm512_loadu_si512(key[0] + u), y = _mm512_loadu_si512(key[1] + u);
  const __m512i z = _mm512_loadu_si512(key[2] + u);
  const auto differ = [&](const std::array<const std::int32_t*, 3>& from, int at) ORBIS_TARGET("avx512f") {
    return _mm512_cmpneq_epi32_mask(x, _mm512_loadu_si512(from[0] + at)) |
           _mm512_cmpneq_epi32_mask(y, _mm512_loadu_si512(from[1] + at)) |
           _mm512_cmpneq_epi32_mask(z, _mm512_loadu_si512(from[2] + at));
  };
  return static_cast<unsigned>(differ(key, u - 1) & differ(above, u) &
                               _mm512_cmpneq_epi32_mask(x, _mm512_set1_epi32(-1)));
}
#endif

/// What a depth_view stores.
template <class T>
T stored_type(const camera::depth_view<T>&);

/// Metres of a row of stored depths; see depth_view::operator().
template <class T>
struct metres_row {
  const T* stored;
  float* metres;
  int width;
  float scale, min, max;
};

template <class T>
void to_metres_portable(const metres_row<T>& row) noexcept {
  for (int u = 0; u != row.width; ++u) {
    const T stored = row.stored[u];
    const float z = static_cast<float>(stored) / row.scale;
    bool valid = stored > T{0} && z >= row.min && z <= row.max;
    if constexpr (std::same_as<T, float>)
      valid = valid && stored < std::numeric_limits<float>::infinity();
    else
      valid = valid && stored != std::numeric_limits<T>::max();
    row.metres[u] = valid ? z : 0.0F;
  }
}

#if ORBIS_X86
template <class T>
ORBIS_TARGET("avx2")
void to_metres_avx2(const metres_row<T>& row) noexcept {
  const __m256 scale = _mm256_set1_ps(row.scale), min = _mm256_set1_ps(row.min), max = _mm256_set1_ps(row.max);
  int u = 0;
  for (; u + 8 <= row.width; u += 8) {
    __m256 stored, most;
    if constexpr (std::same_as<T, float>) {
      stored = _mm256_loadu_ps(row.stored + u);
      most = _mm256_set1_ps(std::numeric_limits<float>::infinity());
    } else {
      stored =
          _mm256_cvtepi32_ps(_mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(row.stored + u))));
      most = _mm256_set1_ps(65535.0F);
    }
    const __m256 z = _mm256_div_ps(stored, scale);
    const __m256 measured =
        _mm256_and_ps(_mm256_cmp_ps(stored, _mm256_setzero_ps(), _CMP_GT_OQ), _mm256_cmp_ps(stored, most, _CMP_LT_OQ));
    const __m256 inside = _mm256_and_ps(_mm256_cmp_ps(z, min, _CMP_GE_OQ), _mm256_cmp_ps(z, max, _CMP_LE_OQ));
    _mm256_storeu_ps(row.metres + u, _mm256_and_ps(z, _mm256_and_ps(measured, inside)));
  }
  to_metres_portable<T>({row.stored + u, row.metres + u, row.width - u, row.scale, row.min, row.max});
}
#endif

}  // namespace orbis::octree::detail
