// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Which rays of a depth image cross a voxel: surely, surely not, or only the walk itself can tell.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/depth/endpoint_image.hpp>
#include <orbis/octree/detail/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/depth/node_classifier.hpp>
#include <orbis/octree/detail/points/ray_traversal.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// Whether traverse_ray visits `voxel` on its way to `end`.
[[nodiscard]] inline bool crosses(const depth_sensor& sensor, const ray_endpoint& end,
                                  const voxel_key& voxel) noexcept {
  const voxel_key& from = *sensor.key;
  if (from == end.key) return false;
  if (voxel == from) return true;
  auto cursor = ray_traversal::between(sensor.grid, from, sensor.pose.centre, end.point);
  if (!cursor) return false;
  const std::array<std::uint32_t, 3> wanted{voxel.x, voxel.y, voxel.z};
  for (;;) {
    const std::size_t axis = cursor->axis();
    if (cursor->at[axis] == wanted[axis] || !cursor->can_step(axis)) return false;  // it never turns back
    cursor->advance(axis);
    if (cursor->key() == end.key) return false;
    if (std::min(std::min(cursor->next[0], cursor->next[1]), cursor->next[2]) > cursor->reach) return false;
    if (cursor->key() == voxel) return true;
  }
}

/// One voxel that is to be tested against rays.
///
/// A line in direction g crosses a cube with centre c and half edge h if no axis across an edge
/// separates them: |c x g|_i <= h (|g_j| + |g_k|) for all i (S. Gottschalk, M. C. Lin, D. Manocha,
/// "OBBTree", SIGGRAPH 1996). A ray that is cut off at z g has left the cube again if that point lies
/// beyond a far face, and has not reached it if it lies before a near one. Nothing is divided.
///
/// Directions err by at most margin / |c| of their length (see depth_scene), which is `slack` beside
/// twice the margin in h. The axes are flipped so that c has no negative coordinate.
struct voxel_test {
  float3 centre{}, x_axis{}, y_axis{}, z_axis{};  ///< relative to the camera's centre; flipped
  float half = 0, inner_half = 0, outer_half = 0, slack = 0, margin = 0, margin_1 = 0;
  float3 before{};  ///< how far before the centre a ray may end along an axis: half, or no limit

  voxel_test(const depth_scene& s, const float3& c, float half_edge) noexcept
      : half{half_edge}, margin{s.margin(std::fabs(c[0]) + std::fabs(c[1]) + std::fabs(c[2]))}, margin_1{s.margin_1} {
    float l1 = 0;
    for (std::size_t i = 0; i != 3; ++i) {
      centre[i] = std::fabs(c[i]);
      x_axis[i] = std::copysign(1.0F, c[i]) * s.x_axis[i];
      y_axis[i] = std::copysign(1.0F, c[i]) * s.y_axis[i];
      z_axis[i] = std::copysign(1.0F, c[i]) * s.z_axis[i];
      // Within the slab of the camera itself there is no near face.
      before[i] = centre[i] < half + 2.0F * margin ? std::numeric_limits<float>::infinity() : half;
      l1 += centre[i];
    }
    inner_half = half - 2.0F * margin;
    outer_half = half + 2.0F * margin;
    slack = 4.0F * half * margin / std::max(l1, half);
  }

  enum class answer { no, unsure, yes };
  [[nodiscard]] answer test(float x, float y, float z) const noexcept {
    if (!(z > 0.0F)) return answer::no;
    float3 g, a, d;
    for (std::size_t i = 0; i != 3; ++i) {
      g[i] = x_axis[i] * x + (y_axis[i] * y + z_axis[i]);
      a[i] = std::fabs(g[i]);
    }
    const float length = a[0] + a[1] + a[2], close = margin + margin_1 * (z * length);
    bool inner = true;
    for (std::size_t i = 0; i != 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const float off = std::fabs(centre[j] * g[k] - centre[k] * g[j]);
      const float width = a[j] + a[k];
      if (!(off <= width * outer_half + slack * length)) return answer::no;
      inner = inner && off < width * inner_half - slack * length;
      d[i] = z * g[i] - centre[i];
      if (!(d[i] >= -before[i] - close)) return answer::no;
    }
    const float beyond = std::max(std::max(std::fabs(d[0]), std::fabs(d[1])), std::fabs(d[2]));
    if (!(beyond >= half - close)) return answer::no;
    return inner && beyond > half + close ? answer::yes : answer::unsure;
  }
  /// Whether a ray of a tile of directions may cross the voxel.
  [[nodiscard]] bool may_cross(float x0, float x1, float y0, float y1) const noexcept {
    const float x = 0.5F * (x0 + x1), y = 0.5F * (y0 + y1), dx = 0.501F * (x1 - x0), dy = 0.501F * (y1 - y0);
    float3 g, e;
    for (std::size_t i = 0; i != 3; ++i) {
      g[i] = x_axis[i] * x + (y_axis[i] * y + z_axis[i]);
      e[i] = std::fabs(x_axis[i]) * dx + std::fabs(y_axis[i]) * dy;
    }
    const float length = std::fabs(g[0]) + std::fabs(g[1]) + std::fabs(g[2]) + e[0] + e[1] + e[2];
    bool may = true;
    for (std::size_t i = 0; i != 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      const float off = std::fabs(centre[j] * g[k] - centre[k] * g[j]) - (centre[j] * e[k] + centre[k] * e[j]);
      const float width = std::fabs(g[j]) + e[j] + std::fabs(g[k]) + e[k];
      may = may && off <= width * outer_half + slack * length;
    }
    return may;
  }
};

/// A box of pixels, its last row and column included.
struct pixel_box {
  std::int32_t u0, u1, v0, v1;
};

/// Whether a ray of the box surely crosses the voxel. If not, the pixels whose rays may cross it are
/// appended to `unsure`. Rays that end before `near_z` do not.
inline bool test_pixels_portable(const depth_scene& s, const voxel_test& t, const pixel_box& box, float near_z,
                                 std::vector<std::array<std::int32_t, 2>>& unsure) {
  for (std::int32_t v = box.v0; v <= box.v1; ++v)
    for (std::int32_t u = box.u0; u <= box.u1; ++u) {
      const float z = s.rays->z(v)[u];
      if (!(z > 0.0F && z >= near_z)) continue;
      const auto [x, y] = s.rays->rays().at(u, v);
      const auto answer = t.test(x, y, z);
      if (answer == voxel_test::answer::yes) return true;
      if (answer == voxel_test::answer::unsure) unsure.push_back({u, v});
    }
  return false;
}

/// Where in a voxel's projection rays are sampled, and how far from its centre, in its edges.
inline constexpr std::array<std::array<float, 2>, 5> sample_places{{{0, 0}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
inline constexpr float sample_spread = 0.3F;

/// The children that are surely crossed by the deepest of a few rays that pass close to their centres.
/// `world`: the parent's centre relative to the camera's.
inline unsigned sample_children_portable(const depth_scene& s, const child_offsets& o, const float3& world,
                                         const children& c, unsigned wanted) noexcept {
  unsigned sure = 0;
  for (unsigned i = 0; i != 8; ++i) {
    if ((wanted >> i & 1U) == 0) continue;
    const bool projects = c.near_z[i] > s.near_z, mapped = s.map != nullptr || !projects;
    const float per_z = projects ? 1.0F / c.z[i] : 0.0F;
    const auto middle = [&](float p, float f, float centre, std::int32_t first, std::int32_t last) {
      return mapped ? 0.5F * static_cast<float>(first + last) : f * (p * per_z) + centre;
    };
    const float mid_u = middle(c.x[i], s.fx, s.cx, c.u0[i], c.u1[i]);
    const float mid_v = middle(c.y[i], s.fy, s.cy, c.v0[i], c.v1[i]);
    const float spread = s.voxel * sample_spread * per_z;
    const auto nearest = [](float at, std::int32_t first, std::int32_t last) {
      return static_cast<std::int32_t>(std::clamp(at + 0.5F, static_cast<float>(first), static_cast<float>(last)));
    };
    float best_z = -1.0F;
    std::int32_t best_u = 0, best_v = 0;
    for (const auto& [du, dv] : sample_places) {
      const std::int32_t u = nearest(mid_u + du * spread * s.fx, c.u0[i], c.u1[i]);
      const std::int32_t v = nearest(mid_v + dv * spread * s.fy, c.v0[i], c.v1[i]);
      const float z = s.rays->z(v)[u];
      if (z <= best_z) continue;
      best_z = z;
      best_u = u;
      best_v = v;
    }
    const auto [x, y] = s.rays->rays().at(best_u, best_v);
    const voxel_test test{s, {world[0] + o.world_x[i], world[1] + o.world_y[i], world[2] + o.world_z[i]}, o.half};
    if (test.test(x, y, best_z) == voxel_test::answer::yes) sure |= 1U << i;
  }
  return sure;
}

#if ORBIS_X86
ORBIS_TARGET("avx2,fma")
inline bool test_pixels_avx2(const depth_scene& s, const voxel_test& t, const pixel_box& box, float near_z,
                             std::vector<std::array<std::int32_t, 2>>& unsure) {
  const auto set = [&](float v) ORBIS_TARGET("avx2") { return _mm256_set1_ps(v); };
  const auto abs = [&](const __m256 v) ORBIS_TARGET("avx2") { return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), v); };
  const __m256 least_z = set(std::max(near_z, std::numeric_limits<float>::min()));
  const __m256 half = set(t.half), inner = set(t.inner_half), outer = set(t.outer_half), slack = set(t.slack);
  const __m256 c0 = set(t.centre[0]), c1 = set(t.centre[1]), c2 = set(t.centre[2]);
  const bool separable = s.rays->rays().separable();
  for (std::int32_t v = box.v0; v <= box.v1; ++v) {
    const float* const row_z = s.rays->z(v);
    const float* const row_x = s.rays->rays().x(v);
    const float* const row_y = s.rays->rays().y(v);
    for (std::int32_t u = box.u0; u <= box.u1; u += 8) {
      const __m256 z = _mm256_loadu_ps(row_z + u);
      const __m256 reaches = _mm256_cmp_ps(z, least_z, _CMP_GE_OQ);
      if (_mm256_movemask_ps(reaches) == 0) continue;
      const __m256 x = _mm256_loadu_ps(row_x + u), y = separable ? set(*row_y) : _mm256_loadu_ps(row_y + u);
      const auto along = [&](std::size_t i) ORBIS_TARGET("avx2,fma") {
        return _mm256_fmadd_ps(_mm256_set1_ps(t.x_axis[i]), x,
                               _mm256_fmadd_ps(_mm256_set1_ps(t.y_axis[i]), y, _mm256_set1_ps(t.z_axis[i])));
      };
      const __m256 g0 = along(0), g1 = along(1), g2 = along(2);
      const __m256 a0 = abs(g0), a1 = abs(g1), a2 = abs(g2);
      const __m256 w0 = _mm256_add_ps(a1, a2), w1 = _mm256_add_ps(a2, a0), w2 = _mm256_add_ps(a0, a1);
      const __m256 length = _mm256_add_ps(a0, w0), loose = _mm256_mul_ps(slack, length);
      const __m256 off0 = abs(_mm256_fmsub_ps(c1, g2, _mm256_mul_ps(c2, g1)));
      const __m256 off1 = abs(_mm256_fmsub_ps(c2, g0, _mm256_mul_ps(c0, g2)));
      const __m256 off2 = abs(_mm256_fmsub_ps(c0, g1, _mm256_mul_ps(c1, g0)));
      const auto under = [&](const __m256 off, const __m256 w) ORBIS_TARGET("avx2,fma") {
        return _mm256_cmp_ps(off, _mm256_fmadd_ps(w, outer, loose), _CMP_LE_OQ);
      };
      __m256 may =
          _mm256_and_ps(_mm256_and_ps(reaches, under(off0, w0)), _mm256_and_ps(under(off1, w1), under(off2, w2)));
      if (_mm256_movemask_ps(may) == 0) continue;
      const __m256 d0 = _mm256_fmsub_ps(z, g0, c0), d1 = _mm256_fmsub_ps(z, g1, c1), d2 = _mm256_fmsub_ps(z, g2, c2);
      const __m256 close = _mm256_fmadd_ps(set(t.margin_1), _mm256_mul_ps(z, length), set(t.margin));
      const auto reached = [&](const __m256 d, float before) ORBIS_TARGET("avx2") {
        return _mm256_cmp_ps(_mm256_add_ps(_mm256_add_ps(d, close), _mm256_set1_ps(before)), _mm256_setzero_ps(),
                             _CMP_GE_OQ);
      };
      may = _mm256_and_ps(_mm256_and_ps(may, reached(d0, t.before[0])),
                          _mm256_and_ps(reached(d1, t.before[1]), reached(d2, t.before[2])));
      const __m256 beyond = _mm256_max_ps(_mm256_max_ps(abs(d0), abs(d1)), abs(d2));
      may = _mm256_and_ps(may, _mm256_cmp_ps(beyond, _mm256_sub_ps(half, close), _CMP_GE_OQ));
      unsigned bits = static_cast<unsigned>(_mm256_movemask_ps(may));
      if (bits == 0) continue;
      const auto well_under = [&](const __m256 off, const __m256 w) ORBIS_TARGET("avx2,fma") {
        return _mm256_cmp_ps(off, _mm256_fmsub_ps(w, inner, loose), _CMP_LT_OQ);
      };
      const __m256 sure =
          _mm256_and_ps(_mm256_and_ps(may, _mm256_cmp_ps(beyond, _mm256_add_ps(half, close), _CMP_GT_OQ)),
                        _mm256_and_ps(_mm256_and_ps(well_under(off0, w0), well_under(off1, w1)), well_under(off2, w2)));
      if (_mm256_movemask_ps(sure) != 0) return true;
      for (; bits != 0; bits &= bits - 1) unsure.push_back({u + std::countr_zero(bits), v});
    }
  }
  return false;
}

/// The same, sixteen pixels at a time.
ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline bool test_pixels_avx512(const depth_scene& s, const voxel_test& t, const pixel_box& box, float near_z,
                               std::vector<std::array<std::int32_t, 2>>& unsure) {
  const auto set = [&](float v) ORBIS_TARGET("avx512f") { return _mm512_set1_ps(v); };
  const auto max = [&](const __m512& a, const __m512& b) ORBIS_TARGET("avx512f") {
    return _mm512_maskz_max_ps(0xffff, a, b);
  };  // g++ 12 warns of the other
  const __m512 least_z = set(std::max(near_z, std::numeric_limits<float>::min()));
  const __m512 half = set(t.half), inner = set(t.inner_half), outer = set(t.outer_half), slack = set(t.slack);
  const __m512 c0 = set(t.centre[0]), c1 = set(t.centre[1]), c2 = set(t.centre[2]);
  const __m512 x0 = set(t.x_axis[0]), x1 = set(t.x_axis[1]), x2 = set(t.x_axis[2]);
  const bool separable = s.rays->rays().separable();
  for (std::int32_t v = box.v0; v <= box.v1; ++v) {
    const float* const row_z = s.rays->z(v);
    const float* const row_x = s.rays->rays().x(v);
    const float* const row_y = s.rays->rays().y(v);
    for (std::int32_t u = box.u0; u <= box.u1; u += 16) {
      const __m512 z = _mm512_loadu_ps(row_z + u);
      const __mmask16 reaches = _mm512_cmp_ps_mask(z, least_z, _CMP_GE_OQ);
      if (reaches == 0) continue;
      const __m512 x = _mm512_loadu_ps(row_x + u), y = separable ? set(*row_y) : _mm512_loadu_ps(row_y + u);
      const auto along = [&](const __m512& x_axis, std::size_t i) ORBIS_TARGET("avx512f") {
        return _mm512_fmadd_ps(x_axis, x, _mm512_fmadd_ps(_mm512_set1_ps(t.y_axis[i]), y, _mm512_set1_ps(t.z_axis[i])));
      };
      const __m512 g0 = along(x0, 0), g1 = along(x1, 1), g2 = along(x2, 2);
      const __m512 a0 = _mm512_abs_ps(g0), a1 = _mm512_abs_ps(g1), a2 = _mm512_abs_ps(g2);
      const __m512 w0 = _mm512_add_ps(a1, a2), w1 = _mm512_add_ps(a2, a0), w2 = _mm512_add_ps(a0, a1);
      const __m512 length = _mm512_add_ps(a0, w0), loose = _mm512_mul_ps(slack, length);
      const __m512 off0 = _mm512_abs_ps(_mm512_fmsub_ps(c1, g2, _mm512_mul_ps(c2, g1)));
      const __m512 off1 = _mm512_abs_ps(_mm512_fmsub_ps(c2, g0, _mm512_mul_ps(c0, g2)));
      const __m512 off2 = _mm512_abs_ps(_mm512_fmsub_ps(c0, g1, _mm512_mul_ps(c1, g0)));
      const auto under = [&](__mmask16 of, const __m512& off, const __m512& w) ORBIS_TARGET("avx512f") {
        return _mm512_mask_cmp_ps_mask(of, off, _mm512_fmadd_ps(w, outer, loose), _CMP_LE_OQ);
      };
      __mmask16 may = under(under(under(reaches, off0, w0), off1, w1), off2, w2);
      if (may == 0) continue;
      const __m512 d0 = _mm512_fmsub_ps(z, g0, c0), d1 = _mm512_fmsub_ps(z, g1, c1), d2 = _mm512_fmsub_ps(z, g2, c2);
      const __m512 close = _mm512_fmadd_ps(set(t.margin_1), _mm512_mul_ps(z, length), set(t.margin));
      const auto reached = [&](__mmask16 of, const __m512& d, float before) ORBIS_TARGET("avx512f") {
        return _mm512_mask_cmp_ps_mask(of, _mm512_add_ps(_mm512_add_ps(d, close), _mm512_set1_ps(before)),
                                       _mm512_setzero_ps(), _CMP_GE_OQ);
      };
      may = reached(reached(reached(may, d0, t.before[0]), d1, t.before[1]), d2, t.before[2]);
      const __m512 beyond = max(max(_mm512_abs_ps(d0), _mm512_abs_ps(d1)), _mm512_abs_ps(d2));
      may = _mm512_mask_cmp_ps_mask(may, beyond, _mm512_sub_ps(half, close), _CMP_GE_OQ);
      if (may == 0) continue;
      const auto well_under = [&](__mmask16 of, const __m512& off, const __m512& w) ORBIS_TARGET("avx512f") {
        return _mm512_mask_cmp_ps_mask(of, off, _mm512_fmsub_ps(w, inner, loose), _CMP_LT_OQ);
      };
      const __mmask16 left = _mm512_mask_cmp_ps_mask(may, beyond, _mm512_add_ps(half, close), _CMP_GT_OQ);
      if (well_under(well_under(well_under(left, off0, w0), off1, w1), off2, w2) != 0) return true;
      for (unsigned bits = may; bits != 0; bits &= bits - 1) unsure.push_back({u + std::countr_zero(bits), v});
    }
  }
  return false;
}

ORBIS_TARGET("avx2,fma")
inline unsigned sample_children_avx2(const depth_scene& s, const child_offsets& o, const float3& world,
                                     const children& c, unsigned wanted) noexcept {
  const auto set = [&](float v) ORBIS_TARGET("avx2") { return _mm256_set1_ps(v); };
  const auto abs = [&](const __m256 v) ORBIS_TARGET("avx2") { return _mm256_andnot_ps(_mm256_set1_ps(-0.0F), v); };
  const auto ints = [&](const std::array<std::int32_t, 8>& a)
                        ORBIS_TARGET("avx2") { return _mm256_load_si256(reinterpret_cast<const __m256i*>(a.data())); };
  const __m256 cz = _mm256_load_ps(c.z.data());
  const __m256 projects = _mm256_cmp_ps(_mm256_load_ps(c.near_z.data()), set(s.near_z), _CMP_GT_OQ);
  const __m256 per_z = _mm256_and_ps(_mm256_div_ps(set(1.0F), cz), projects);
  const __m256i bits = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  const __m256i asked = _mm256_cmpeq_epi32(_mm256_and_si256(_mm256_set1_epi32(static_cast<int>(wanted)), bits), bits);
  const __m256 mapped = s.map != nullptr ? set(-1.0F) : _mm256_xor_ps(projects, set(-0.0F));
  const auto middle = [&](const __m256 p, float f, float centre, const __m256i first,
                          const __m256i last) ORBIS_TARGET("avx2,fma") {
    const __m256 at = _mm256_fmadd_ps(_mm256_mul_ps(p, per_z), _mm256_set1_ps(f), _mm256_set1_ps(centre));
    const __m256 box = _mm256_mul_ps(_mm256_set1_ps(0.5F), _mm256_cvtepi32_ps(_mm256_add_epi32(first, last)));
    return _mm256_blendv_ps(at, box, mapped);
  };
  const auto nearest = [&](const __m256 at, const __m256i first, const __m256i last) ORBIS_TARGET("avx2") {
    return _mm256_and_si256(_mm256_min_epi32(_mm256_max_epi32(_mm256_cvtps_epi32(at), first), last), asked);
  };
  const __m256i u0 = ints(c.u0), u1 = ints(c.u1), v0 = ints(c.v0), v1 = ints(c.v1);
  const __m256 mid_u = middle(_mm256_load_ps(c.x.data()), s.fx, s.cx, u0, u1);
  const __m256 mid_v = middle(_mm256_load_ps(c.y.data()), s.fy, s.cy, v0, v1);
  const __m256 spread = _mm256_mul_ps(set(s.voxel * sample_spread), per_z);
  const __m256 spread_u = _mm256_mul_ps(spread, set(s.fx)), spread_v = _mm256_mul_ps(spread, set(s.fy));
  const pixel_rays& rays = s.rays->rays();
  const __m256i row_size = _mm256_set1_epi32(static_cast<int>(s.rays->stride()));
  __m256 z = set(-1.0F);
  __m256i u = _mm256_setzero_si256(), v = u;
  for (const auto& [du, dv] : sample_places) {
    const __m256i at_u = nearest(_mm256_fmadd_ps(spread_u, set(du), mid_u), u0, u1);
    const __m256i at_v = nearest(_mm256_fmadd_ps(spread_v, set(dv), mid_v), v0, v1);
    const __m256 at_z =
        _mm256_i32gather_ps(s.rays->z(0), _mm256_add_epi32(_mm256_mullo_epi32(at_v, row_size), at_u), 4);
    const __m256 deeper = _mm256_cmp_ps(at_z, z, _CMP_GT_OQ);
    z = _mm256_blendv_ps(z, at_z, deeper);
    u = _mm256_blendv_epi8(u, at_u, _mm256_castps_si256(deeper));
    v = _mm256_blendv_epi8(v, at_v, _mm256_castps_si256(deeper));
  }
  __m256 x, y;
  if (rays.separable()) {
    x = _mm256_mul_ps(_mm256_sub_ps(_mm256_cvtepi32_ps(u), set(s.cx)), set(s.per_fx));
    y = _mm256_mul_ps(_mm256_sub_ps(_mm256_cvtepi32_ps(v), set(s.cy)), set(s.per_fy));
  } else {
    const __m256i i =
        _mm256_add_epi32(_mm256_mullo_epi32(v, _mm256_set1_epi32(static_cast<int>(rays.x(1) - rays.x(0)))), u);
    x = _mm256_i32gather_ps(rays.x(0), i, 4);
    y = _mm256_i32gather_ps(rays.y(0), i, 4);
  }
  const auto along = [&](std::size_t i) ORBIS_TARGET("avx2,fma") {
    return _mm256_fmadd_ps(_mm256_set1_ps(s.x_axis[i]), x,
                           _mm256_fmadd_ps(_mm256_set1_ps(s.y_axis[i]), y, _mm256_set1_ps(s.z_axis[i])));
  };
  const __m256 g0 = along(0), g1 = along(1), g2 = along(2);
  const __m256 c0 = _mm256_add_ps(set(world[0]), _mm256_load_ps(o.world_x.data()));
  const __m256 c1 = _mm256_add_ps(set(world[1]), _mm256_load_ps(o.world_y.data()));
  const __m256 c2 = _mm256_add_ps(set(world[2]), _mm256_load_ps(o.world_z.data()));
  const __m256 a0 = abs(g0), a1 = abs(g1), a2 = abs(g2), half = set(o.half);
  const __m256 l1 = _mm256_add_ps(_mm256_add_ps(abs(c0), abs(c1)), abs(c2));
  const __m256 margin = _mm256_fmadd_ps(set(s.margin_1), l1, set(s.margin_0));
  const __m256 inner = _mm256_sub_ps(half, _mm256_add_ps(margin, margin));
  const __m256 slack = _mm256_div_ps(_mm256_mul_ps(_mm256_mul_ps(set(4.0F), half), margin), _mm256_max_ps(l1, half));
  const __m256 w0 = _mm256_add_ps(a1, a2), w1 = _mm256_add_ps(a2, a0), w2 = _mm256_add_ps(a0, a1);
  const __m256 length = _mm256_add_ps(a0, w0), loose = _mm256_mul_ps(slack, length);
  const auto well_under = [&](const __m256 p, const __m256 q, const __m256 r, const __m256 t,
                              const __m256 w) ORBIS_TARGET("avx2,fma") {
    const __m256 off = _mm256_andnot_ps(_mm256_set1_ps(-0.0F), _mm256_fmsub_ps(p, q, _mm256_mul_ps(r, t)));
    return _mm256_cmp_ps(off, _mm256_fmsub_ps(w, inner, loose), _CMP_LT_OQ);
  };
  __m256 sure = _mm256_and_ps(_mm256_and_ps(well_under(c1, g2, c2, g1, w0), well_under(c2, g0, c0, g2, w1)),
                              well_under(c0, g1, c1, g0, w2));
  const __m256 d0 = _mm256_fmsub_ps(z, g0, c0), d1 = _mm256_fmsub_ps(z, g1, c1), d2 = _mm256_fmsub_ps(z, g2, c2);
  const __m256 close = _mm256_fmadd_ps(set(s.margin_1), _mm256_mul_ps(z, length), margin);
  const __m256 room = _mm256_add_ps(half, close), own_slab = _mm256_add_ps(half, _mm256_add_ps(margin, margin));
  const auto reached = [&](const __m256 d, const __m256 centre) ORBIS_TARGET("avx2") {
    const __m256 sign = _mm256_set1_ps(-0.0F);
    const __m256 forward = _mm256_xor_ps(d, _mm256_and_ps(centre, sign));
    return _mm256_or_ps(_mm256_cmp_ps(_mm256_add_ps(forward, room), _mm256_setzero_ps(), _CMP_GE_OQ),
                        _mm256_cmp_ps(_mm256_andnot_ps(sign, centre), own_slab, _CMP_LT_OQ));
  };
  const __m256 beyond = _mm256_max_ps(_mm256_max_ps(abs(d0), abs(d1)), abs(d2));
  sure = _mm256_and_ps(sure, _mm256_and_ps(_mm256_and_ps(reached(d0, c0), reached(d1, c1)), reached(d2, c2)));
  sure = _mm256_and_ps(
      sure, _mm256_and_ps(_mm256_cmp_ps(beyond, room, _CMP_GT_OQ), _mm256_cmp_ps(z, _mm256_setzero_ps(), _CMP_GT_OQ)));
  return static_cast<unsigned>(_mm256_movemask_ps(sure)) & wanted;
}
#endif

}  // namespace orbis::octree::detail
