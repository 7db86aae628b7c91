// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a depth image says about whole nodes of the octree: no ray can touch them, or surely every
/// voxel in them is crossed.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/depth/depth_pyramid.hpp>
#include <orbis/octree/detail/depth/direction_index.hpp>
#include <orbis/octree/detail/depth/endpoint_image.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// What the tests of nodes need to know about a frame. Positions are relative to the camera's centre.
///
/// The rays that are walked are those from the centre to the world points, rounded to float; the tests
/// know the rays of the pixels, and nodes whose centres are rounded as well. With u = 2^-24 and c a
/// node's centre:
/// - the sum that makes a world point p errs by at most 10 u |p - t|_1 + u |t|_1, and seen from the node
///   the first part shrinks with the distance;
/// - rotating c with the rotation rounded to float errs by 7 u |c|_1, on top of 2 u |c|_1 with which c
///   came, and each step down the octree adds u |c|_1: less than 25 u |c|_1 from a root of 16 levels;
/// - the walk has its direction in float: u |c|_1; its sums in double are nothing beside.
/// - the ray of a pinhole's pixel may be taken as (pixel - c) / f in float: 5 u |c|_1.
/// All in all less than 45 u |c|_1 + 2 u |t|_1: `margin` is 64 u |c|_1 + 8 u |t|_1.
struct depth_scene {
  float3 x_axis{}, y_axis{}, z_axis{};               ///< of the camera, in the world
  float fx = 1, fy = 1, cx = 0, cy = 0;              ///< pixel = f * ray + c
  float per_fx = 1, per_fy = 1;                      ///< 1 / f
  float last_u = 0, last_v = 0;                      ///< the last column and row
  float min_x = 0, max_x = 0, min_y = 0, max_y = 0;  ///< of all rays
  float margin_0 = 0, margin_1 = 0;                  ///< metres; and for each metre of |c|_1
  float pixel_margin = 0.01F;                        ///< pixels, for the rounding of pixels
  float near_z = 0;                                  ///< nodes that come closer than this are not projected
  /// Up to this depth a ball inside a voxel surely holds the ray of a pixel, an aligned tile of 2x2
  /// pixels' rays, of 4x4; of pinholes, see dense().
  std::array<float, 3> dense_z{};
  float ball = 0, ball_slope = 0;        ///< the ball's radius is more than `ball - ball_slope * z`
  float voxel = 0;                       ///< metres
  const direction_index* map = nullptr;  ///< of cameras that are not pinholes
  const depth_pyramid* pyramid = nullptr;
  const endpoint_image* rays = nullptr;

  /// The same where every direction has a ray within `spacing` at z = 1: that many times as far off
  /// are all rays of a tile that contains the nearest one.
  static constexpr std::array<float, 3> tiles{1.02F, 3.06F, 7.14F};
  [[nodiscard]] float dense(std::size_t kind, float spacing) const noexcept {
    return ball / (tiles[kind] * spacing + ball_slope);
  }
  [[nodiscard]] float margin(float l1) const noexcept { return margin_0 + margin_1 * l1; }
};

/// The offsets of a node's children from its centre.
struct child_offsets {
  alignas(32) std::array<float, 8> x{}, y{}, z{};                    ///< in the camera frame
  alignas(32) std::array<float, 8> world_x{}, world_y{}, world_z{};  ///< in the world frame
  float half = 0;                                                    ///< half a child's edge
  float half_z = 0;                                                  ///< half of what it measures along z
  std::array<float, 4> half_side{};                                  ///< and across the sides of the view

  child_offsets() = default;
  child_offsets(const depth_scene& s, float half_edge) : half{half_edge} {
    for (unsigned i = 0; i != 8; ++i) {
      const float wx = (i & 1U) != 0 ? half : -half, wy = (i & 2U) != 0 ? half : -half;
      const float wz = (i & 4U) != 0 ? half : -half;
      world_x[i] = wx;
      world_y[i] = wy;
      world_z[i] = wz;
      const auto along = [&](const float3& a) { return a[0] * wx + a[1] * wy + a[2] * wz; };
      x[i] = along(s.x_axis);
      y[i] = along(s.y_axis);
      z[i] = along(s.z_axis);
    }
    const auto reach = [&](const float3& a, float slope) {
      float sum = 0;
      for (std::size_t j = 0; j != 3; ++j) sum += std::fabs(a[j] - slope * s.z_axis[j]);
      return half * sum;
    };
    half_z = half * (std::fabs(s.z_axis[0]) + std::fabs(s.z_axis[1]) + std::fabs(s.z_axis[2]));
    half_side = {reach(s.x_axis, s.min_x), reach(s.x_axis, s.max_x), reach(s.y_axis, s.min_y),
                 reach(s.y_axis, s.max_y)};
  }
};

/// What is known about the eight children of a node.
struct children {
  alignas(32) std::array<float, 8> x, y, z;                ///< centres in the camera frame
  alignas(32) std::array<std::int32_t, 8> u0, u1, v0, v1;  ///< the pixels whose rays may touch them
  alignas(32) std::array<float, 8> near_z;                 ///< rays that end before this do not touch them
  unsigned live = 0;                                       ///< bit i: a ray may touch child i
  unsigned full = 0;                                       ///< every voxel of child i is surely crossed by a ray
  unsigned inside = 0;                                     ///< child i projects into the image
};

/// Judges the children of the node whose centre is (x, y, z) in the camera frame. `inside`: the node
/// projects into the image. All variants are right, but may differ in what they leave undecided.
inline void classify_children_portable(const depth_scene& s, const child_offsets& o, const float3& c, bool inside,
                                       children& out) noexcept {
  out.live = out.full = out.inside = 0;
  const depth_pyramid& pyramid = *s.pyramid;
  for (unsigned i = 0; i != 8; ++i) {
    const float x = c[0] + o.x[i], y = c[1] + o.y[i], z = c[2] + o.z[i];
    const float margin = s.margin(std::fabs(x) + std::fabs(y) + std::fabs(z));
    const float reach = o.half_z + margin, near = z - reach, far = z + reach;
    out.x[i] = x;
    out.y[i] = y;
    out.z[i] = z;
    out.near_z[i] = near;
    if (!(far > 0.0F)) continue;
    if (!inside && (x - s.min_x * z + o.half_side[0] + margin * (1.0F + std::fabs(s.min_x)) < 0.0F ||
                    s.max_x * z - x + o.half_side[1] + margin * (1.0F + std::fabs(s.max_x)) < 0.0F ||
                    y - s.min_y * z + o.half_side[2] + margin * (1.0F + std::fabs(s.min_y)) < 0.0F ||
                    s.max_y * z - y + o.half_side[3] + margin * (1.0F + std::fabs(s.max_y)) < 0.0F))
      continue;
    const bool projects = near > s.near_z;
    float u0 = 0.0F, u1 = s.last_u, v0 = 0.0F, v1 = s.last_v;
    bool inner = false, covered = false;
    std::array<float, 3> dense_z = s.dense_z;
    if (projects) {
      const float u = x / z, v = y / z;
      float wide = 0, high = 0;
      for (std::size_t j = 0; j != 3; ++j) {
        wide += std::fabs(s.x_axis[j] - u * s.z_axis[j]);
        high += std::fabs(s.y_axis[j] - v * s.z_axis[j]);
      }
      const float du = (wide * o.half + margin * (1.0F + std::fabs(u))) / near;
      const float dv = (high * o.half + margin * (1.0F + std::fabs(v))) / near;
      u0 = s.fx * (u - du) + s.cx - s.pixel_margin;
      u1 = s.fx * (u + du) + s.cx + s.pixel_margin;
      v0 = s.fy * (v - dv) + s.cy - s.pixel_margin;
      v1 = s.fy * (v + dv) + s.cy + s.pixel_margin;
      if (s.map != nullptr) {
        const auto& off = s.map->at(u - du, u + du, v - dv, v + dv);
        u0 += off.least_u;
        u1 += off.most_u;
        v0 += off.least_v;
        v1 += off.most_v;
        for (std::size_t kind = 0; kind != 3; ++kind) dense_z[kind] = s.dense(kind, off.spacing);
        covered = true;
      } else {
        covered = inner = u0 >= 0.0F && v0 >= 0.0F && u1 <= s.last_u && v1 <= s.last_v;
      }
      u0 = std::clamp(u0, 0.0F, s.last_u + 1.0F);
      v0 = std::clamp(v0, 0.0F, s.last_v + 1.0F);
      u1 = std::clamp(u1, -1.0F, s.last_u);
      v1 = std::clamp(v1, -1.0F, s.last_v);
    }
    const auto iu0 = static_cast<std::int32_t>(std::ceil(u0)), iu1 = static_cast<std::int32_t>(std::floor(u1));
    const auto iv0 = static_cast<std::int32_t>(std::ceil(v0)), iv1 = static_cast<std::int32_t>(std::floor(v1));
    if (iu0 > iu1 || iv0 > iv1) continue;
    out.u0[i] = iu0;
    out.u1[i] = iu1;
    out.v0[i] = iv0;
    out.v1[i] = iv1;
    int level = 1;
    while (3 << level < std::max(iu1 - iu0, iv1 - iv0) && level < pyramid.levels()) ++level;
    const auto k = static_cast<std::size_t>(level);
    std::size_t kind = 0;
    while (kind != 2 && far < dense_z[kind + 1]) ++kind;
    const std::uint32_t* const cells = pyramid.data() + kind * pyramid.family() + pyramid.begin()[k];
    const std::int32_t a = iu0 >> level, b = std::max(a, (iu1 >> level) - 1);
    const std::int32_t d = iv0 >> level, e = std::max(d, (iv1 >> level) - 1), w = pyramid.width()[k];
    const std::uint32_t ends = larger_halves(larger_halves(cells[d * w + a], cells[d * w + b]),
                                             larger_halves(cells[e * w + a], cells[e * w + b]));
    if (ends >> 16U == 0 || static_cast<float>(ends >> 16U) < near * pyramid.scale()) continue;
    out.live |= 1U << i;
    if (inner) out.inside |= 1U << i;
    if (covered && far < dense_z[0] && static_cast<float>(65535U - (ends & 0xffffU)) > far * pyramid.scale())
      out.full |= 1U << i;
  }
}

#if ORBIS_X86
ORBIS_TARGET("avx2,fma")
inline void classify_children_avx2(const depth_scene& s, const child_offsets& o, const float3& c, bool inside,
                                   children& out) noexcept {
  const auto set = [&](float v) ORBIS_TARGET("avx2") { return _mm256_set1_ps(v); };
  const auto abs = [&](const __m256 v) ORBIS_TARGET("avx2") { return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), v); };
  const __m256 zero = _mm256_setzero_ps(), one = set(1.0F);
  const __m256 x = _mm256_add_ps(set(c[0]), _mm256_load_ps(o.x.data()));
  const __m256 y = _mm256_add_ps(set(c[1]), _mm256_load_ps(o.y.data()));
  const __m256 z = _mm256_add_ps(set(c[2]), _mm256_load_ps(o.z.data()));
  _mm256_store_ps(out.x.data(), x);
  _mm256_store_ps(out.y.data(), y);
  _mm256_store_ps(out.z.data(), z);
  const __m256 l1 = _mm256_add_ps(_mm256_add_ps(abs(x), abs(y)), abs(z));
  const __m256 margin = _mm256_fmadd_ps(set(s.margin_1), l1, set(s.margin_0));
  const __m256 reach = _mm256_add_ps(set(o.half_z), margin);
  const __m256 near = _mm256_sub_ps(z, reach), far = _mm256_add_ps(z, reach);
  _mm256_store_ps(out.near_z.data(), near);
  __m256 live = _mm256_cmp_ps(far, zero, _CMP_GT_OQ);
  if (!inside) {
    const auto side = [&](const __m256 at, float sign, float slope, float half) ORBIS_TARGET("avx2,fma") {
      const __m256 room = _mm256_fmadd_ps(margin, _mm256_set1_ps(1.0F + std::fabs(slope)), _mm256_set1_ps(half));
      const __m256 off = _mm256_fnmadd_ps(_mm256_set1_ps(slope), z, at);  // positive towards larger slopes
      return _mm256_cmp_ps(_mm256_fmadd_ps(_mm256_set1_ps(sign), off, room), _mm256_setzero_ps(), _CMP_GE_OQ);
    };
    live = _mm256_and_ps(
        live,
        _mm256_and_ps(_mm256_and_ps(side(x, 1.0F, s.min_x, o.half_side[0]), side(x, -1.0F, s.max_x, o.half_side[1])),
                      _mm256_and_ps(side(y, 1.0F, s.min_y, o.half_side[2]), side(y, -1.0F, s.max_y, o.half_side[3]))));
  }
  out.live = out.full = out.inside = 0;
  if (_mm256_movemask_ps(live) == 0) return;

  // The pixels that a child may project to: its centre's, plus or minus its extent across that ray.
  const __m256 projects = _mm256_cmp_ps(near, set(s.near_z), _CMP_GT_OQ);
  const __m256 near_1 = _mm256_blendv_ps(one, near, projects), z_1 = _mm256_blendv_ps(one, z, projects);
  const __m256 inverse = _mm256_div_ps(one, _mm256_mul_ps(near_1, z_1));
  const __m256 per_z = _mm256_mul_ps(inverse, near_1), per_near = _mm256_mul_ps(inverse, z_1);
  const __m256 u = _mm256_mul_ps(x, per_z), v = _mm256_mul_ps(y, per_z);
  const auto across = [&](const float3& axis, const __m256 slope) ORBIS_TARGET("avx2,fma") {
    const __m256 sign = _mm256_set1_ps(-0.0F);
    const __m256 a = _mm256_fnmadd_ps(slope, _mm256_set1_ps(s.z_axis[0]), _mm256_set1_ps(axis[0]));
    const __m256 b = _mm256_fnmadd_ps(slope, _mm256_set1_ps(s.z_axis[1]), _mm256_set1_ps(axis[1]));
    const __m256 d = _mm256_fnmadd_ps(slope, _mm256_set1_ps(s.z_axis[2]), _mm256_set1_ps(axis[2]));
    const __m256 sum =
        _mm256_add_ps(_mm256_add_ps(_mm256_andnot_ps(sign, a), _mm256_andnot_ps(sign, b)), _mm256_andnot_ps(sign, d));
    const __m256 slack = _mm256_fmadd_ps(margin, _mm256_andnot_ps(sign, slope), margin);
    return _mm256_mul_ps(_mm256_fmadd_ps(sum, _mm256_set1_ps(o.half), slack), per_near);
  };
  const __m256 wide = across(s.x_axis, u), high = across(s.y_axis, v);
  const __m256 du = _mm256_fmadd_ps(wide, set(s.fx), set(s.pixel_margin));
  const __m256 dv = _mm256_fmadd_ps(high, set(s.fy), set(s.pixel_margin));
  const __m256 cu = _mm256_fmadd_ps(u, set(s.fx), set(s.cx)), cv = _mm256_fmadd_ps(v, set(s.fy), set(s.cy));
  const __m256 last_u = set(s.last_u), last_v = set(s.last_v);
  __m256 u0 = _mm256_sub_ps(cu, du), u1 = _mm256_add_ps(cu, du), v0 = _mm256_sub_ps(cv, dv), v1 = _mm256_add_ps(cv, dv);
  __m256 dense_0 = set(s.dense_z[0]), dense_1 = set(s.dense_z[1]), dense_2 = set(s.dense_z[2]);
  if (s.map != nullptr) {
    const direction_index& map = *s.map;
    const auto cell = [&](const __m256 at, float least, float per, std::int32_t count) ORBIS_TARGET("avx2") {
      const __m256 c = _mm256_mul_ps(_mm256_sub_ps(at, _mm256_set1_ps(least)), _mm256_set1_ps(per));
      return _mm256_cvttps_epi32(
          _mm256_min_ps(_mm256_max_ps(c, _mm256_setzero_ps()), _mm256_set1_ps(static_cast<float>(count - 1))));
    };
    const __m256i i0 = cell(_mm256_sub_ps(u, wide), map.min_x(), map.per_x(), map.width()[0]);
    const __m256i i1 = cell(_mm256_add_ps(u, wide), map.min_x(), map.per_x(), map.width()[0]);
    const __m256i j0 = cell(_mm256_sub_ps(v, high), map.min_y(), map.per_y(), map.height()[0]);
    const __m256i j1 = cell(_mm256_add_ps(v, high), map.min_y(), map.per_y(), map.height()[0]);
    const __m256 extent = _mm256_cvtepi32_ps(_mm256_max_epi32(_mm256_sub_epi32(i1, i0), _mm256_sub_epi32(j1, j0)));
    __m256i k = _mm256_sub_epi32(
        _mm256_srli_epi32(_mm256_add_epi32(_mm256_castps_si256(extent), _mm256_set1_epi32(0x7fffff)), 23),
        _mm256_set1_epi32(127));
    k = _mm256_min_epi32(_mm256_max_epi32(k, _mm256_setzero_si256()), _mm256_set1_epi32(map.levels()));
    __m256i at = _mm256_mullo_epi32(_mm256_srlv_epi32(j0, k), _mm256_i32gather_epi32(map.width().data(), k, 4));
    at = _mm256_add_epi32(_mm256_add_epi32(at, _mm256_srlv_epi32(i0, k)),
                          _mm256_i32gather_epi32(map.begin().data(), k, 4));
    at = _mm256_slli_epi32(at, 3);
    const float* const entries = &map.entries()->least_u;
    u0 = _mm256_add_ps(u0, _mm256_i32gather_ps(entries, at, 4));
    u1 = _mm256_add_ps(u1, _mm256_i32gather_ps(entries + 1, at, 4));
    v0 = _mm256_add_ps(v0, _mm256_i32gather_ps(entries + 2, at, 4));
    v1 = _mm256_add_ps(v1, _mm256_i32gather_ps(entries + 3, at, 4));
    const __m256 spacing = _mm256_i32gather_ps(entries + 4, at, 4);
    const auto dense = [&](std::size_t kind) ORBIS_TARGET("avx2,fma") {
      return _mm256_div_ps(_mm256_set1_ps(s.ball), _mm256_fmadd_ps(_mm256_set1_ps(depth_scene::tiles[kind]), spacing,
                                                                   _mm256_set1_ps(s.ball_slope)));
    };
    dense_0 = dense(0);
    dense_1 = dense(1);
    dense_2 = dense(2);
  }
  u0 = _mm256_and_ps(u0, projects);
  v0 = _mm256_and_ps(v0, projects);
  u1 = _mm256_blendv_ps(last_u, u1, projects);
  v1 = _mm256_blendv_ps(last_v, v1, projects);
  const __m256 inner = _mm256_and_ps(
      projects,
      _mm256_and_ps(_mm256_and_ps(_mm256_cmp_ps(u0, zero, _CMP_GE_OQ), _mm256_cmp_ps(v0, zero, _CMP_GE_OQ)),
                    _mm256_and_ps(_mm256_cmp_ps(u1, last_u, _CMP_LE_OQ), _mm256_cmp_ps(v1, last_v, _CMP_LE_OQ))));
  const auto first = [&](const __m256 p, const __m256 last) ORBIS_TARGET("avx2") {
    return _mm256_cvttps_epi32(_mm256_ceil_ps(
        _mm256_min_ps(_mm256_max_ps(p, _mm256_setzero_ps()), _mm256_add_ps(last, _mm256_set1_ps(1.0F)))));
  };
  const auto last = [&](const __m256 p, const __m256 end) ORBIS_TARGET("avx2") {
    return _mm256_cvttps_epi32(_mm256_floor_ps(_mm256_max_ps(_mm256_min_ps(p, end), _mm256_set1_ps(-1.0F))));
  };
  __m256i a = first(u0, last_u), b = last(u1, last_u), d = first(v0, last_v), e = last(v1, last_v);
  live =
      _mm256_andnot_ps(_mm256_castsi256_ps(_mm256_or_si256(_mm256_cmpgt_epi32(a, b), _mm256_cmpgt_epi32(d, e))), live);
  if (_mm256_movemask_ps(live) == 0) return;
  const __m256i alive = _mm256_castps_si256(live);
  a = _mm256_and_si256(a, alive);
  b = _mm256_and_si256(b, alive);
  d = _mm256_and_si256(d, alive);
  e = _mm256_and_si256(e, alive);
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.u0.data()), a);
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.u1.data()), b);
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.v0.data()), d);
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.v1.data()), e);

  // The level on which that many pixels are at most four cells: the logarithm of a third, rounded up.
  const __m256i extent = _mm256_max_epi32(_mm256_sub_epi32(b, a), _mm256_sub_epi32(e, d));
  const __m256 third = _mm256_mul_ps(_mm256_cvtepi32_ps(extent), set(1.0F / 3.0F));
  __m256i level =
      _mm256_sub_epi32(_mm256_srli_epi32(_mm256_add_epi32(_mm256_castps_si256(third), _mm256_set1_epi32(0x7fffff)), 23),
                       _mm256_set1_epi32(127));
  const depth_pyramid& pyramid = *s.pyramid;
  level = _mm256_min_epi32(_mm256_max_epi32(level, _mm256_set1_epi32(1)), _mm256_set1_epi32(pyramid.levels()));
  const auto of_level = [&](const std::int32_t* table) ORBIS_TARGET("avx2") {
    if (pyramid.levels() > 8) return _mm256_i32gather_epi32(table, level, 4);
    const __m256i from_1 = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(table + 1));
    return _mm256_permutevar8x32_epi32(from_1, _mm256_sub_epi32(level, _mm256_set1_epi32(1)));
  };
  const __m256i width = of_level(pyramid.width().data());
  __m256i begin = of_level(pyramid.begin().data());
  const __m256i family = _mm256_set1_epi32(static_cast<int>(pyramid.family()));
  const __m256 pairs = _mm256_cmp_ps(far, dense_1, _CMP_LT_OQ);
  const __m256 fours = _mm256_cmp_ps(far, dense_2, _CMP_LT_OQ);  // implies the one before
  begin = _mm256_add_epi32(begin, _mm256_and_si256(family, _mm256_castps_si256(pairs)));
  begin = _mm256_add_epi32(begin, _mm256_and_si256(family, _mm256_castps_si256(fours)));
  const auto before_last = [&](const __m256i from, const __m256i to) ORBIS_TARGET("avx2") {
    return _mm256_max_epi32(from, _mm256_sub_epi32(to, _mm256_set1_epi32(1)));
  };
  const __m256i i0 = _mm256_srlv_epi32(a, level), i1 = before_last(i0, _mm256_srlv_epi32(b, level));
  const __m256i j0 = _mm256_srlv_epi32(d, level), j1 = before_last(j0, _mm256_srlv_epi32(e, level));
  const __m256i row0 = _mm256_add_epi32(begin, _mm256_mullo_epi32(j0, width));
  const __m256i row1 = _mm256_add_epi32(begin, _mm256_mullo_epi32(j1, width));
  const int* const cells = reinterpret_cast<const int*>(pyramid.data());
  const __m256i ends = _mm256_max_epu16(_mm256_max_epu16(_mm256_i32gather_epi32(cells, _mm256_add_epi32(row0, i0), 4),
                                                         _mm256_i32gather_epi32(cells, _mm256_add_epi32(row0, i1), 4)),
                                        _mm256_max_epu16(_mm256_i32gather_epi32(cells, _mm256_add_epi32(row1, i0), 4),
                                                         _mm256_i32gather_epi32(cells, _mm256_add_epi32(row1, i1), 4)));
  const __m256 farthest = _mm256_cvtepi32_ps(_mm256_srli_epi32(ends, 16)), scale = set(pyramid.scale());
  live = _mm256_and_ps(live, _mm256_and_ps(_mm256_cmp_ps(farthest, _mm256_mul_ps(near, scale), _CMP_GE_OQ),
                                           _mm256_cmp_ps(farthest, zero, _CMP_GT_OQ)));
  const __m256 nearest =
      _mm256_cvtepi32_ps(_mm256_sub_epi32(_mm256_set1_epi32(65535), _mm256_and_si256(ends, _mm256_set1_epi32(65535))));
  const __m256 filled = _mm256_and_ps(_mm256_cmp_ps(nearest, _mm256_mul_ps(far, scale), _CMP_GT_OQ),
                                      _mm256_cmp_ps(far, dense_0, _CMP_LT_OQ));
  out.live = static_cast<unsigned>(_mm256_movemask_ps(live));
  // Where there is a map, it is the spacing that says whether there are rays all over a child.
  const bool mapped = s.map != nullptr;
  out.inside = mapped ? 0 : out.live & static_cast<unsigned>(_mm256_movemask_ps(inner));
  out.full = (mapped ? out.live & static_cast<unsigned>(_mm256_movemask_ps(projects)) : out.inside) &
             static_cast<unsigned>(_mm256_movemask_ps(filled));
}
#endif

}  // namespace orbis::octree::detail
