// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A ray as a straight line through planes of voxel faces, eight rays at a time.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/limit_rays.hpp>
#include <orbis/octree/detail/points/scan_origin.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// Rays prepared, see queued_rays. A ray's kind: eight times the main axis, plus four if it goes down
/// it, one if it goes down the axis u, two if it goes down v. What follows is counted in steps.
struct ray_setup {
  static constexpr std::size_t lanes = ray_batch::lanes;
  static constexpr std::int32_t kinds = 24;

  alignas(64) std::array<double, lanes> u, du, v, dv;
  alignas(64) std::array<std::int32_t, lanes> kind;
  alignas(64) std::array<std::int32_t, lanes> planes;          ///< that the ray crosses
  alignas(64) std::array<std::int32_t, lanes> cell_u, cell_v;  ///< behind the last of them
  // Bit i is of ray i.
  std::uint32_t done = 0;    ///< of the others nothing is known: they must be walked
  std::uint32_t step_u = 0;  ///< crosses a face between the last two planes
  std::uint32_t step_v = 0;
  std::uint32_t step_u_first = 0;  ///< the one across u comes first
  std::uint32_t end_u = 0;         ///< the same between the last plane and the end
  std::uint32_t end_v = 0;
  std::uint32_t end_u_first = 0;

  [[nodiscard]] static constexpr std::size_t axis(std::int32_t kind) noexcept {
    return static_cast<std::size_t>(kind >> 3);
  }
  [[nodiscard]] static constexpr std::size_t axis_u(std::size_t axis) noexcept { return axis == 0 ? 1 : 0; }
  [[nodiscard]] static constexpr std::size_t axis_v(std::size_t axis) noexcept { return axis == 2 ? 1 : 2; }
  /// Whether the rays go down each axis.
  [[nodiscard]] static constexpr std::array<std::size_t, 3> down(std::int32_t kind) noexcept {
    std::array<std::size_t, 3> is{};
    const auto bit = [&](int i) { return static_cast<std::size_t>(kind >> i & 1); };
    is[axis(kind)] = bit(2);
    is[axis_u(axis(kind))] = bit(0);
    is[axis_v(axis(kind))] = bit(1);
    return is;
  }
};

/// In voxels: more than what a walk's arithmetic and this one's can differ.
inline constexpr double ray_doubt = 1e-8;
/// Rays that cross more planes are walked.
inline constexpr std::int32_t max_ray_planes = 4096;

/// Prepares eight rays of a batch, from the i-th on.
inline void set_up_portable(const scan_origin& source, const ray_batch& rays, std::size_t i, ray_setup& out) noexcept {
  out.done = out.step_u = out.step_v = out.step_u_first = out.end_u = out.end_v = out.end_u_first = 0;
  const std::uint32_t wanted = ray_batch::eight(rays.hit, i) | ray_batch::eight(rays.cut, i);
  for (std::size_t lane = 0; lane != ray_batch::lanes; ++lane, ++i) {
    if ((wanted >> lane & 1U) == 0) continue;
    const float3 ray = difference({rays.end[0][i], rays.end[1][i], rays.end[2][i]}, source.origin);
    const auto reach = static_cast<float>(length(ray));
    if (!(reach > 0.0F && reach < 1e30F)) continue;
    std::array<double, 3> speed, first, expected;
    std::array<std::uint32_t, 3> down;
    const double metres = static_cast<double>(reach) * source.per_metre;
    bool good = true;
    for (std::size_t axis = 0; axis != 3; ++axis) {
      const auto d = static_cast<double>(ray[axis] / reach);
      down[axis] = d < 0.0 ? 1 : 0;
      speed[axis] = std::fabs(d);
      first[axis] = d == 0.0 ? 0.5 : source.first[down[axis]][axis];
      const std::int32_t way = down[axis] != 0 ? -rays.way[axis][i] : rays.way[axis][i];
      expected[axis] = way - source.skipped[down[axis]][axis];
      // Whether the walk reaches the end's voxel before the ray's length stops it.
      const double over = metres * speed[axis] - first[axis] + 1.0 - expected[axis];
      good = good && over > ray_doubt && over < 1.0 - ray_doubt;
    }
    std::size_t axis = speed[1] > speed[0] ? 1 : 0;
    axis = speed[2] > speed[axis] ? 2 : axis;
    const std::size_t iu = ray_setup::axis_u(axis), iv = ray_setup::axis_v(axis);
    const double per_plane = 1.0 / speed[axis], planes = expected[axis];
    if (!good || !(planes >= 0.0 && planes <= max_ray_planes)) continue;

    struct line {
      double at, slope, cell, part, cell_before;
    };
    const auto along = [&](std::size_t across) {
      line l;
      l.slope = speed[across] * per_plane;
      l.at = (first[axis] - 1.0) * l.slope - first[across] + 1.0;
      const auto cell = [&](double n, double& part) {
        const double last = l.at + n * l.slope, whole = n < 0.5 ? 0.0 : std::floor(last);
        part = last - whole;
        good = good && (n < 0.5 || (part > ray_doubt && part < 1.0 - ray_doubt));
        return whole;
      };
      double part;
      l.cell_before = cell(std::max(planes - 1.0, 0.0), part);
      l.cell = cell(planes, l.part);
      return l;
    };
    const line u = along(iu), v = along(iv);
    const double end_u = expected[iu] - u.cell, end_v = expected[iv] - v.cell;
    const double step_u = u.cell - u.cell_before, step_v = v.cell - v.cell_before;
    good = good && end_u >= 0.0 && end_u <= 1.0 && end_v >= 0.0 && end_v <= 1.0;
    const double sure = ray_doubt * (u.slope + v.slope);
    const double end_order = (1.0 - v.part) * u.slope - (1.0 - u.part) * v.slope;
    const double step_order = u.part * v.slope - v.part * u.slope;
    if (end_u + end_v > 1.5) good = good && std::fabs(end_order) > sure;
    if (step_u + step_v > 1.5) good = good && std::fabs(step_order) > sure;
    if (!good) continue;

    out.u[lane] = down[iu] != 0 ? 1.0 - u.at : u.at;
    out.du[lane] = down[iu] != 0 ? -u.slope : u.slope;
    out.v[lane] = down[iv] != 0 ? 1.0 - v.at : v.at;
    out.dv[lane] = down[iv] != 0 ? -v.slope : v.slope;
    out.kind[lane] = static_cast<std::int32_t>(8 * axis + 4 * down[axis] + 2 * down[iv] + down[iu]);
    out.planes[lane] = static_cast<std::int32_t>(planes);
    out.cell_u[lane] = static_cast<std::int32_t>(u.cell);
    out.cell_v[lane] = static_cast<std::int32_t>(v.cell);
    const auto set = [&](std::uint32_t& bits, bool bit) { bits |= (bit ? 1U : 0U) << lane; };
    set(out.done, true);
    set(out.step_u, step_u > 0.5);
    set(out.step_v, step_v > 0.5);
    set(out.step_u_first, step_order > 0.0);
    set(out.end_u, end_u > 0.5);
    set(out.end_v, end_v > 0.5);
    set(out.end_u_first, end_order > 0.0);
  }
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void set_up_avx2(const scan_origin& source, const ray_batch& rays, std::size_t i, ray_setup& out) noexcept {
  out.done = out.step_u = out.step_v = out.step_u_first = out.end_u = out.end_v = out.end_u_first = 0;
  const std::uint32_t wanted = ray_batch::eight(rays.hit, i) | ray_batch::eight(rays.cut, i);
  const __m256d zero = _mm256_setzero_pd(), one = _mm256_set1_pd(1.0), half = _mm256_set1_pd(0.5);
  const __m256d doubt = _mm256_set1_pd(ray_doubt), rest = _mm256_set1_pd(1.0 - ray_doubt);
  const __m256d sign = _mm256_set1_pd(-0.0);
  const auto less = [&](__m256d a, __m256d b) ORBIS_TARGET("avx2") { return _mm256_cmp_pd(a, b, _CMP_LT_OQ); };
  const auto select = [&](__m256d a, __m256d b, __m256d mask)
                          ORBIS_TARGET("avx2") { return _mm256_blendv_pd(a, b, mask); };
  const auto bits = [&](__m256d mask)
                        ORBIS_TARGET("avx2") { return static_cast<std::uint32_t>(_mm256_movemask_pd(mask)); };
  const auto within = [&](__m256d x) ORBIS_TARGET("avx2") { return _mm256_and_pd(less(doubt, x), less(x, rest)); };
  for (std::size_t lane = 0; lane != 8; lane += 4, i += 4) {
    __m128 ray[3], square[3];
    for (std::size_t axis = 0; axis != 3; ++axis) {
      ray[axis] = _mm_sub_ps(_mm_load_ps(rays.end[axis].data() + i), _mm_set1_ps(source.origin[axis]));
      square[axis] = _mm_mul_ps(ray[axis], ray[axis]);
#if !defined(__clang__)
      asm("" : "+x"(square[axis]));  // rounded: see rounded_product
#endif
    }
    const __m128 squares = _mm_add_ps(_mm_add_ps(square[0], square[1]), square[2]);
    const __m128 reach = _mm256_cvtpd_ps(_mm256_sqrt_pd(_mm256_cvtps_pd(squares)));
    const __m256d length = _mm256_cvtps_pd(reach);
    const __m256d metres = _mm256_mul_pd(length, _mm256_set1_pd(source.per_metre));
    __m256d good = _mm256_and_pd(less(zero, length), less(length, _mm256_set1_pd(1e30)));
    __m256d speed[3], first[3], expected[3], down[3];
    for (std::size_t axis = 0; axis != 3; ++axis) {
      const __m256d d = _mm256_cvtps_pd(_mm_div_ps(ray[axis], reach));
      down[axis] = less(d, zero);
      speed[axis] = _mm256_andnot_pd(sign, d);
      const auto either = [&](double up_value, double down_value) ORBIS_TARGET("avx2") {
        return select(_mm256_set1_pd(up_value), _mm256_set1_pd(down_value), down[axis]);
      };
      first[axis] =
          select(either(source.first[0][axis], source.first[1][axis]), half, _mm256_cmp_pd(d, zero, _CMP_EQ_OQ));
      const __m256d way =
          _mm256_cvtepi32_pd(_mm_load_si128(reinterpret_cast<const __m128i*>(rays.way[axis].data() + i)));
      expected[axis] = _mm256_sub_pd(_mm256_xor_pd(way, _mm256_and_pd(down[axis], sign)),
                                     either(source.skipped[0][axis], source.skipped[1][axis]));
      // Whether the walk reaches the end's voxel before the ray's length stops it.
      const __m256d crossed = _mm256_add_pd(_mm256_sub_pd(_mm256_mul_pd(metres, speed[axis]), first[axis]), one);
      good = _mm256_and_pd(good, within(_mm256_sub_pd(crossed, expected[axis])));
    }
    const __m256d y_main = less(speed[0], speed[1]);
    const __m256d z_main = less(select(speed[0], speed[1], y_main), speed[2]);
    const __m256d x_main = _mm256_andnot_pd(_mm256_or_pd(y_main, z_main), _mm256_cmp_pd(zero, zero, _CMP_EQ_OQ));
    const auto main_of = [&](const __m256d(&a)[3])
                             ORBIS_TARGET("avx2") { return select(select(a[0], a[1], y_main), a[2], z_main); };
    const auto across_u = [&](const __m256d(&a)[3]) ORBIS_TARGET("avx2") { return select(a[0], a[1], x_main); };
    const auto across_v = [&](const __m256d(&a)[3]) ORBIS_TARGET("avx2") { return select(a[2], a[1], z_main); };
    const __m256d per_plane = _mm256_div_pd(one, main_of(speed)), planes = main_of(expected);
    const __m256d first_plane = _mm256_sub_pd(main_of(first), one), before = _mm256_sub_pd(planes, one);
    const __m256d none = less(planes, half), none_before = less(before, half);
    good = _mm256_and_pd(good, _mm256_cmp_pd(planes, zero, _CMP_GE_OQ));
    good = _mm256_and_pd(good, _mm256_cmp_pd(planes, _mm256_set1_pd(max_ray_planes), _CMP_LE_OQ));

    struct line {
      __m256d slope, cell, part, end, step;
    };
    const auto along = [&](__m256d l_speed, __m256d l_first, __m256d l_expected, __m256d l_down, double* at,
                           double* slope, std::int32_t* cells) ORBIS_TARGET("avx2") {
      line l;
      l.slope = _mm256_mul_pd(l_speed, per_plane);
      const __m256d a = _mm256_add_pd(_mm256_sub_pd(_mm256_mul_pd(first_plane, l.slope), l_first), one);
      const auto cell = [&](__m256d n, __m256d no_planes, __m256d& part) ORBIS_TARGET("avx2") {
        const __m256d last = _mm256_add_pd(a, _mm256_mul_pd(n, l.slope));
        const __m256d whole = _mm256_andnot_pd(no_planes, _mm256_floor_pd(last));
        part = _mm256_sub_pd(last, whole);
        good = _mm256_and_pd(good, _mm256_or_pd(no_planes, within(part)));
        return whole;
      };
      __m256d part;
      l.step = cell(before, none_before, part);
      l.cell = cell(planes, none, l.part);
      l.step = _mm256_sub_pd(l.cell, l.step);
      l.end = _mm256_sub_pd(l_expected, l.cell);
      good = _mm256_and_pd(
          good, _mm256_and_pd(_mm256_cmp_pd(l.end, zero, _CMP_GE_OQ), _mm256_cmp_pd(l.end, one, _CMP_LE_OQ)));
      _mm256_store_pd(at + lane, select(a, _mm256_sub_pd(one, a), l_down));
      _mm256_store_pd(slope + lane, _mm256_xor_pd(l.slope, _mm256_and_pd(l_down, sign)));
      _mm_store_si128(reinterpret_cast<__m128i*>(cells + lane), _mm256_cvtpd_epi32(l.cell));
      return l;
    };
    const __m256d down_u = across_u(down), down_v = across_v(down);
    const line u = along(across_u(speed), across_u(first), across_u(expected), down_u, out.u.data(), out.du.data(),
                         out.cell_u.data());
    const line v = along(across_v(speed), across_v(first), across_v(expected), down_v, out.v.data(), out.dv.data(),
                         out.cell_v.data());
    const __m256d sure = _mm256_mul_pd(doubt, _mm256_add_pd(u.slope, v.slope));
    const __m256d end_order = _mm256_sub_pd(_mm256_mul_pd(_mm256_sub_pd(one, v.part), u.slope),
                                            _mm256_mul_pd(_mm256_sub_pd(one, u.part), v.slope));
    const __m256d step_order = _mm256_sub_pd(_mm256_mul_pd(u.part, v.slope), _mm256_mul_pd(v.part, u.slope));
    const auto unsure = [&](__m256d a, __m256d b, __m256d order) ORBIS_TARGET("avx2") {
      return _mm256_andnot_pd(less(sure, _mm256_andnot_pd(sign, order)), _mm256_and_pd(less(half, a), less(half, b)));
    };
    good = _mm256_andnot_pd(unsure(u.end, v.end, end_order), good);
    good = _mm256_andnot_pd(unsure(u.step, v.step, step_order), good);

    const __m256d kind = _mm256_add_pd(
        _mm256_add_pd(_mm256_and_pd(y_main, _mm256_set1_pd(8.0)), _mm256_and_pd(down_u, one)),
        _mm256_add_pd(_mm256_and_pd(main_of(down), _mm256_set1_pd(4.0)), _mm256_and_pd(down_v, _mm256_set1_pd(2.0))));
    const __m256d of_z = _mm256_add_pd(_mm256_and_pd(_mm256_andnot_pd(y_main, z_main), _mm256_set1_pd(16.0)),
                                       _mm256_and_pd(_mm256_and_pd(y_main, z_main), _mm256_set1_pd(8.0)));
    _mm_store_si128(reinterpret_cast<__m128i*>(out.kind.data() + lane), _mm256_cvtpd_epi32(_mm256_add_pd(kind, of_z)));
    _mm_store_si128(reinterpret_cast<__m128i*>(out.planes.data() + lane), _mm256_cvtpd_epi32(planes));
    out.done |= bits(good) << lane;
    out.step_u |= bits(less(half, u.step)) << lane;
    out.step_v |= bits(less(half, v.step)) << lane;
    out.step_u_first |= bits(less(zero, step_order)) << lane;
    out.end_u |= bits(less(half, u.end)) << lane;
    out.end_v |= bits(less(half, v.end)) << lane;
    out.end_u_first |= bits(less(zero, end_order)) << lane;
  }
  out.done &= wanted;
}

ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline void set_up_avx512(const scan_origin& source, const ray_batch& rays, std::size_t i, ray_setup& out) noexcept {
  constexpr __mmask8 all = 0xff;
  const __m512d zero = _mm512_setzero_pd(), one = _mm512_set1_pd(1.0), half = _mm512_set1_pd(0.5);
  const __m512d doubt = _mm512_set1_pd(ray_doubt), rest = _mm512_set1_pd(1.0 - ray_doubt);
  const auto less = [&](__m512d a, __m512d b) ORBIS_TARGET("avx512f") { return _mm512_cmp_pd_mask(a, b, _CMP_LT_OQ); };
  const auto select = [&](__m512d a, __m512d b, __mmask8 mask)
                          ORBIS_TARGET("avx512f") { return _mm512_mask_mov_pd(a, mask, b); };
  const auto within = [&](__m512d x)
                          ORBIS_TARGET("avx512f") { return static_cast<__mmask8>(less(doubt, x) & less(x, rest)); };
  __m256 ray[3], square[3];
  for (std::size_t axis = 0; axis != 3; ++axis) {
    ray[axis] = _mm256_sub_ps(_mm256_load_ps(rays.end[axis].data() + i), _mm256_set1_ps(source.origin[axis]));
    square[axis] = _mm256_mul_ps(ray[axis], ray[axis]);
#if !defined(__clang__)
    asm("" : "+v"(square[axis]));  // rounded: see rounded_product
#endif
  }
  const __m256 squares = _mm256_add_ps(_mm256_add_ps(square[0], square[1]), square[2]);
  const __m256 reach = _mm512_maskz_cvtpd_ps(all, _mm512_maskz_sqrt_pd(all, _mm512_maskz_cvtps_pd(all, squares)));
  const __m512d length = _mm512_maskz_cvtps_pd(all, reach);
  const __m512d metres = _mm512_mul_pd(length, _mm512_set1_pd(source.per_metre));
  auto good = static_cast<__mmask8>(less(zero, length) & less(length, _mm512_set1_pd(1e30)));
  __m512d speed[3], first[3], expected[3];
  __mmask8 down[3];
  for (std::size_t axis = 0; axis != 3; ++axis) {
    const __m512d d = _mm512_maskz_cvtps_pd(all, _mm256_div_ps(ray[axis], reach));
    down[axis] = less(d, zero);
    speed[axis] = _mm512_abs_pd(d);
    const auto either = [&](double up_value, double down_value) ORBIS_TARGET("avx512f") {
      return select(_mm512_set1_pd(up_value), _mm512_set1_pd(down_value), down[axis]);
    };
    first[axis] =
        select(either(source.first[0][axis], source.first[1][axis]), half, _mm512_cmp_pd_mask(d, zero, _CMP_EQ_OQ));
    const __m512d way =
        _mm512_maskz_cvtepi32_pd(all, _mm256_load_si256(reinterpret_cast<const __m256i*>(rays.way[axis].data() + i)));
    expected[axis] = _mm512_sub_pd(_mm512_mask_sub_pd(way, down[axis], zero, way),
                                   either(source.skipped[0][axis], source.skipped[1][axis]));
    // Whether the walk reaches the end's voxel before the ray's length stops it.
    const __m512d crossed = _mm512_add_pd(_mm512_sub_pd(_mm512_mul_pd(metres, speed[axis]), first[axis]), one);
    good &= within(_mm512_sub_pd(crossed, expected[axis]));
  }
  const __mmask8 y_main = less(speed[0], speed[1]);
  const __mmask8 z_main = less(select(speed[0], speed[1], y_main), speed[2]);
  const auto x_main = static_cast<__mmask8>(~(y_main | z_main));
  const auto main_of = [&](const __m512d(&a)[3])
                           ORBIS_TARGET("avx512f") { return select(select(a[0], a[1], y_main), a[2], z_main); };
  const auto across_u = [&](const __m512d(&a)[3]) ORBIS_TARGET("avx512f") { return select(a[0], a[1], x_main); };
  const auto across_v = [&](const __m512d(&a)[3]) ORBIS_TARGET("avx512f") { return select(a[2], a[1], z_main); };
  const auto chosen = [&](__mmask8 from, __mmask8 mask, __mmask8 other) {
    return static_cast<__mmask8>((from & ~mask) | (other & mask));
  };
  const __m512d per_plane = _mm512_div_pd(one, main_of(speed)), planes = main_of(expected);
  const __m512d first_plane = _mm512_sub_pd(main_of(first), one), before = _mm512_sub_pd(planes, one);
  const __mmask8 none = less(planes, half), none_before = less(before, half);
  good &= _mm512_cmp_pd_mask(planes, zero, _CMP_GE_OQ);
  good &= _mm512_cmp_pd_mask(planes, _mm512_set1_pd(max_ray_planes), _CMP_LE_OQ);

  struct line {
    __m512d slope, cell, part, end, step;
  };
  const auto along = [&](__m512d l_speed, __m512d l_first, __m512d l_expected, __mmask8 l_down, double* at,
                         double* slope, std::int32_t* cells) ORBIS_TARGET("avx512f,avx512dq,avx512vl")
      __attribute__((always_inline)) {
    line l;
    l.slope = _mm512_mul_pd(l_speed, per_plane);
    const __m512d a = _mm512_add_pd(_mm512_sub_pd(_mm512_mul_pd(first_plane, l.slope), l_first), one);
    const auto cell = [&](__m512d n, __mmask8 no_planes, __m512d& part) ORBIS_TARGET("avx512f,avx512dq") {
      const __m512d last = _mm512_add_pd(a, _mm512_mul_pd(n, l.slope));
      const __m512d whole = _mm512_maskz_roundscale_pd(static_cast<__mmask8>(~no_planes), last,
                                                       _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
      part = _mm512_sub_pd(last, whole);
      good &= static_cast<__mmask8>(no_planes | within(part));
      return whole;
    };
    __m512d part;
    l.step = cell(before, none_before, part);
    l.cell = cell(planes, none, l.part);
    l.step = _mm512_sub_pd(l.cell, l.step);
    l.end = _mm512_sub_pd(l_expected, l.cell);
    good &= _mm512_cmp_pd_mask(l.end, zero, _CMP_GE_OQ);
    good &= _mm512_cmp_pd_mask(l.end, one, _CMP_LE_OQ);
    _mm512_store_pd(at, _mm512_mask_sub_pd(a, l_down, one, a));
    _mm512_store_pd(slope, _mm512_mask_sub_pd(l.slope, l_down, zero, l.slope));
    _mm256_store_si256(reinterpret_cast<__m256i*>(cells), _mm512_maskz_cvtpd_epi32(all, l.cell));
    return l;
  };
  const __mmask8 down_u = chosen(down[0], x_main, down[1]), down_v = chosen(down[2], z_main, down[1]);
  const line u = along(across_u(speed), across_u(first), across_u(expected), down_u, out.u.data(), out.du.data(),
                       out.cell_u.data());
  const line v = along(across_v(speed), across_v(first), across_v(expected), down_v, out.v.data(), out.dv.data(),
                       out.cell_v.data());
  const __m512d sure = _mm512_mul_pd(doubt, _mm512_add_pd(u.slope, v.slope));
  const __m512d end_order = _mm512_sub_pd(_mm512_mul_pd(_mm512_sub_pd(one, v.part), u.slope),
                                          _mm512_mul_pd(_mm512_sub_pd(one, u.part), v.slope));
  const __m512d step_order = _mm512_sub_pd(_mm512_mul_pd(u.part, v.slope), _mm512_mul_pd(v.part, u.slope));
  out.step_u = less(half, u.step);
  out.step_v = less(half, v.step);
  out.step_u_first = less(zero, step_order);
  out.end_u = less(half, u.end);
  out.end_v = less(half, v.end);
  out.end_u_first = less(zero, end_order);
  out.done = good & ~(out.end_u & out.end_v & ~static_cast<std::uint32_t>(less(sure, _mm512_abs_pd(end_order)))) &
             ~(out.step_u & out.step_v & ~static_cast<std::uint32_t>(less(sure, _mm512_abs_pd(step_order)))) &
             (ray_batch::eight(rays.hit, i) | ray_batch::eight(rays.cut, i));

  __m256i kind = _mm256_maskz_set1_epi32(y_main, 8);
  kind = _mm256_mask_mov_epi32(kind, z_main, _mm256_set1_epi32(16));
  const auto add = [&](__mmask8 mask, int bit) ORBIS_TARGET("avx512f,avx512vl") {
    kind = _mm256_mask_add_epi32(kind, mask, kind, _mm256_set1_epi32(bit));
  };
  add(chosen(chosen(down[0], y_main, down[1]), z_main, down[2]), 4);
  add(down_v, 2);
  add(down_u, 1);
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.kind.data()), kind);
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.planes.data()), _mm512_maskz_cvtpd_epi32(all, planes));
}
#endif

using setup_kernel = void(const scan_origin&, const ray_batch&, std::size_t, ray_setup&);

[[nodiscard]] inline setup_kernel* set_up_rays(simd::level level) noexcept {
  return simd::select<setup_kernel>(level, {
    .portable = set_up_portable,
#if ORBIS_X86
    .popcnt = nullptr, .avx2 = set_up_avx2, .avx512 = set_up_avx512
#endif
  });
}

}  // namespace orbis::octree::detail
