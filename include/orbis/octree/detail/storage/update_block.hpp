// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a scan does to 64 voxels at once.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>
#include <orbis/octree/sensor_model.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

template <sensor_model M>
std::uint64_t update_block_portable(block<typename M::value_type>& b, std::uint64_t free,
                                    std::uint64_t occupied) noexcept {
  std::uint64_t changed = (free | occupied) & ~b.known;
  b.known |= free | occupied;
  for (std::uint64_t bits = free | occupied; bits != 0; bits &= bits - 1) {
    const auto i = static_cast<unsigned>(std::countr_zero(bits));
    auto& v = b.value[i];
    const auto before = v;
    v = (free >> i & 1U) != 0 ? after_miss<M>(v) : after_hit<M>(v);
    changed |= std::uint64_t{v != before} << i;
  }
  return changed;
}

#if ORBIS_X86
template <sensor_model M>
ORBIS_TARGET("avx2")
std::uint64_t update_block_avx2(block<float>& b, std::uint64_t free, std::uint64_t occupied) noexcept {
  const __m256 low = _mm256_set1_ps(M::clamp_min), high = _mm256_set1_ps(M::clamp_max);
  const __m256 hit = _mm256_set1_ps(M::hit), miss = _mm256_set1_ps(M::miss);
  const __m256i lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  std::uint64_t changed = (free | occupied) & ~b.known;
  b.known |= free | occupied;
  for (unsigned i = 0; i != 64; i += 8) {
    if (((free | occupied) >> i & 0xffU) == 0) continue;
    const auto spread = [&](std::uint64_t mask) ORBIS_TARGET("avx2") {
      const __m256i byte = _mm256_set1_epi32(static_cast<int>(mask >> i & 0xffU));
      return _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_and_si256(byte, lane), lane));
    };
    const __m256 is_hit = spread(occupied), is_miss = spread(free);
    const __m256 v = _mm256_load_ps(b.value.data() + i);
    const __m256 sum = _mm256_add_ps(v, _mm256_blendv_ps(miss, hit, is_hit));
    const __m256 clamped = _mm256_min_ps(_mm256_max_ps(sum, low), high);
    const __m256 moves = _mm256_or_ps(_mm256_and_ps(is_hit, _mm256_cmp_ps(v, high, _CMP_LT_OQ)),
                                      _mm256_and_ps(is_miss, _mm256_cmp_ps(v, low, _CMP_GT_OQ)));
    const __m256 after = _mm256_blendv_ps(v, clamped, moves);
    _mm256_store_ps(b.value.data() + i, after);
    changed |= std::uint64_t{static_cast<unsigned>(_mm256_movemask_ps(_mm256_cmp_ps(v, after, _CMP_NEQ_UQ)))} << i;
  }
  return changed;
}

template <sensor_model M>
ORBIS_TARGET("avx512f,avx512dq,avx512bw,avx512vl")
std::uint64_t update_block_avx512(block<float>& b, std::uint64_t free, std::uint64_t occupied) noexcept {
  const __m512 low = _mm512_set1_ps(M::clamp_min), high = _mm512_set1_ps(M::clamp_max);
  const __m512 hit = _mm512_set1_ps(M::hit), miss = _mm512_set1_ps(M::miss);
  std::uint64_t changed = (free | occupied) & ~b.known;
  b.known |= free | occupied;
  for (unsigned i = 0; i != 64; i += 16) {
    const auto is_hit = static_cast<__mmask16>(occupied >> i), is_miss = static_cast<__mmask16>(free >> i);
    const __m512 v = _mm512_load_ps(b.value.data() + i);
    const __m512 sum = _mm512_add_ps(v, _mm512_mask_blend_ps(is_hit, miss, hit));
    const __m512 clamped = _mm512_maskz_min_ps(0xffff, _mm512_maskz_max_ps(0xffff, sum, low), high);
    const auto moves = static_cast<__mmask16>((is_hit & _mm512_cmp_ps_mask(v, high, _CMP_LT_OQ)) |
                                              (is_miss & _mm512_cmp_ps_mask(v, low, _CMP_GT_OQ)));
    const __m512 after = _mm512_mask_blend_ps(moves, v, clamped);
    _mm512_store_ps(b.value.data() + i, after);
    changed |= std::uint64_t{_mm512_cmp_ps_mask(v, after, _CMP_NEQ_UQ)} << i;
  }
  return changed;
}
#endif

/// Gives the voxels `free` of `b` a miss and the voxels `occupied` a hit, see after_miss and
/// after_hit. Returns those whose value changed or became known. Every level does the same.
/// @pre free and occupied are disjoint
template <sensor_model M>
std::uint64_t update_block(block<typename M::value_type>& b, std::uint64_t free, std::uint64_t occupied,
                           simd::level level = simd::detected()) noexcept {
  if constexpr (std::is_same_v<typename M::value_type, float>) {
    return simd::select<std::uint64_t(block<float>&, std::uint64_t, std::uint64_t)>(level, {
      .portable = update_block_portable<M>,
#if ORBIS_X86
      .popcnt = nullptr, .avx2 = update_block_avx2<M>, .avx512 = update_block_avx512<M>
#endif
    })(b, free, occupied);
  } else {
    return update_block_portable<M>(b, free, occupied);
  }
}

}  // namespace orbis::octree::detail
