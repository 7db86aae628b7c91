// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A ray as a straight line through planes of voxel faces, eight rays at a time.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/octree/ray_walk.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// What all rays of a scan have in common.
struct ray_source {
  float3 origin{};
  double per_metre = 0.0;
  std::array<double, 3> up{};    ///< from the origin to the first face in the positive direction, in voxels
  std::array<double, 3> down{};  ///< and in the negative one

  ray_source() = default;
  ray_source(const voxel_grid& grid, const float3& from, const voxel_key& key) noexcept
      : origin{from}, per_metre{1.0 / grid.resolution()} {
    const std::array<std::uint32_t, 3> k{key.x, key.y, key.z};
    const auto half = static_cast<double>(static_cast<float>(0.5 * grid.resolution()));
    for (std::size_t i = 0; i != 3; ++i) {
      const double off = static_cast<double>(origin[i]) - grid.center(k[i]);
      up[i] = (half - off) * per_metre;
      down[i] = (half + off) * per_metre;
    }
  }
};

/// Rays to be prepared: their ends, and the way there in voxels.
struct ray_batch {
  static constexpr std::size_t lanes = 8;
  alignas(64) std::array<std::array<float, lanes>, 3> end{};
  alignas(64) std::array<std::array<std::int32_t, lanes>, 3> way{};
};

/// Rays prepared, see swept_rays. `face`: twice the main axis, plus one if the ray goes down it.
struct prepared_rays {
  alignas(64) std::array<double, ray_batch::lanes> u, du, v, dv;
  alignas(64) std::array<std::int32_t, ray_batch::lanes> planes, face;
};

#if ORBIS_X86
/// Prepares the rays of a batch. Bit i of what is returned: ray i is done, and between its last plane
/// and its end there are no voxels. Of the others nothing is known. `doubt`, in voxels: more than what a
/// walk's arithmetic and this one's can differ.
ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline std::uint32_t prepare_avx512(const ray_source& source, const ray_batch& rays, double doubt,
                                    prepared_rays& out) noexcept {
  constexpr __mmask8 all = 0xff;
  __m256 ray[3], square[3];
  for (std::size_t i = 0; i != 3; ++i) {
    ray[i] = _mm256_sub_ps(_mm256_load_ps(rays.end[i].data()), _mm256_set1_ps(source.origin[i]));
    square[i] = _mm256_mul_ps(ray[i], ray[i]);
#if !defined(__clang__)
    asm("" : "+v"(square[i]));  // rounded: see rounded_product
#endif
  }
  const __m256 squares = _mm256_add_ps(_mm256_add_ps(square[0], square[1]), square[2]);
  const __m256 reach = _mm512_maskz_cvtpd_ps(all, _mm512_maskz_sqrt_pd(all, _mm512_maskz_cvtps_pd(all, squares)));
  const __m512d length = _mm512_maskz_cvtps_pd(all, reach);
  const __m512d zero = _mm512_setzero_pd(), one = _mm512_set1_pd(1.0), vdoubt = _mm512_set1_pd(doubt);
  std::uint32_t good = _mm512_cmp_pd_mask(length, zero, _CMP_GT_OQ);
  good &= _mm512_cmp_pd_mask(length, _mm512_set1_pd(1e30), _CMP_LT_OQ);

  __m512d speed[3], first[3], expected[3];  // along each axis: of the ray; to the first face; crossings
  __mmask8 negative[3];
  for (std::size_t i = 0; i != 3; ++i) {
    const __m512d d = _mm512_maskz_cvtps_pd(all, _mm256_div_ps(ray[i], reach));
    negative[i] = _mm512_cmp_pd_mask(d, zero, _CMP_LT_OQ);
    speed[i] = _mm512_abs_pd(d);
    const __mmask8 still = _mm512_cmp_pd_mask(d, zero, _CMP_EQ_OQ);
    first[i] = _mm512_mask_mov_pd(
        _mm512_mask_mov_pd(_mm512_set1_pd(source.up[i]), negative[i], _mm512_set1_pd(source.down[i])), still,
        _mm512_set1_pd(0.5));
    const __m512d way =
        _mm512_maskz_cvtepi32_pd(all, _mm256_load_si256(reinterpret_cast<const __m256i*>(rays.way[i].data())));
    expected[i] = _mm512_mask_sub_pd(way, negative[i], zero, way);
    // Whether the walk reaches the end's voxel before the ray's length stops it.
    const __m512d metres = _mm512_mul_pd(length, _mm512_set1_pd(source.per_metre));
    const __m512d crossed = _mm512_add_pd(_mm512_sub_pd(_mm512_mul_pd(metres, speed[i]), first[i]), one);
    const __m512d over = _mm512_sub_pd(crossed, expected[i]);
    good &= _mm512_cmp_pd_mask(over, vdoubt, _CMP_GT_OQ);
    good &= _mm512_cmp_pd_mask(over, _mm512_sub_pd(one, vdoubt), _CMP_LT_OQ);
  }
  const __mmask8 y_main = _mm512_cmp_pd_mask(speed[1], speed[0], _CMP_GT_OQ);
  const __m512d most = _mm512_mask_mov_pd(speed[0], y_main, speed[1]);
  const __mmask8 z_main = _mm512_cmp_pd_mask(speed[2], most, _CMP_GT_OQ);
  const auto x_main = static_cast<__mmask8>(~(y_main | z_main));
  const auto main_of = [&](const __m512d(&a)[3]) ORBIS_TARGET("avx512f") {
    return _mm512_mask_mov_pd(_mm512_mask_mov_pd(a[0], y_main, a[1]), z_main, a[2]);
  };
  const __m512d per_plane = _mm512_div_pd(one, main_of(speed));
  const __m512d planes = main_of(expected), first_plane = _mm512_sub_pd(main_of(first), one);
  good &= _mm512_cmp_pd_mask(planes, _mm512_set1_pd(4096.0), _CMP_LE_OQ);
  __m512d left = zero;
  const auto line = [&](__m512d v_speed, __m512d v_first, __m512d v_expected, __mmask8 down, double* at,
                        double* slope) ORBIS_TARGET("avx512f,avx512dq") {
    const __m512d b = _mm512_mul_pd(v_speed, per_plane);
    const __m512d a = _mm512_add_pd(_mm512_sub_pd(_mm512_mul_pd(first_plane, b), v_first), one);
    const __m512d last = _mm512_add_pd(a, _mm512_mul_pd(planes, b));
    const __m512d whole = _mm512_maskz_roundscale_pd(0xff, last, _MM_FROUND_TO_NEG_INF | _MM_FROUND_NO_EXC);
    const __m512d part = _mm512_sub_pd(last, whole);
    good &= _mm512_cmp_pd_mask(part, vdoubt, _CMP_GT_OQ);
    good &= _mm512_cmp_pd_mask(part, _mm512_sub_pd(one, vdoubt), _CMP_LT_OQ);
    left = _mm512_add_pd(left, _mm512_abs_pd(_mm512_sub_pd(v_expected, whole)));
    _mm512_store_pd(at, _mm512_mask_sub_pd(a, down, one, a));
    _mm512_store_pd(slope, _mm512_mask_sub_pd(b, down, zero, b));
  };
  const auto across_u = [&](const __m512d(&a)[3])
                            ORBIS_TARGET("avx512f") { return _mm512_mask_mov_pd(a[0], x_main, a[1]); };
  const auto across_v = [&](const __m512d(&a)[3])
                            ORBIS_TARGET("avx512f") { return _mm512_mask_mov_pd(a[2], z_main, a[1]); };
  const auto chosen = [](__mmask8 from, __mmask8 mask, __mmask8 other) {
    return static_cast<__mmask8>((from & ~mask) | (other & mask));
  };
  line(across_u(speed), across_u(first), across_u(expected), chosen(negative[0], x_main, negative[1]), out.u.data(),
       out.du.data());
  line(across_v(speed), across_v(first), across_v(expected), chosen(negative[2], z_main, negative[1]), out.v.data(),
       out.dv.data());
  good &= _mm512_cmp_pd_mask(left, one, _CMP_LE_OQ);
  good &= _mm512_cmp_pd_mask(planes, one, _CMP_GE_OQ);

  const __mmask8 down = chosen(chosen(negative[0], y_main, negative[1]), z_main, negative[2]);
  __m256i face = _mm256_maskz_set1_epi32(y_main, 2);
  face = _mm256_mask_mov_epi32(face, z_main, _mm256_set1_epi32(4));
  face = _mm256_mask_add_epi32(face, down, face, _mm256_set1_epi32(1));
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.face.data()), face);
  _mm256_store_si256(reinterpret_cast<__m256i*>(out.planes.data()), _mm512_maskz_cvtpd_epi32(all, planes));
  return good;
}
#endif

}  // namespace orbis::octree::detail
