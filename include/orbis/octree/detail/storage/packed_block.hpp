// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// 64 voxels as an index into the few values they have. Log-odds come from a handful of additions
/// and two bounds, so that neighbours mostly share their values: an octant of a map takes a quarter
/// of the room that its floats would, and loses nothing.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

namespace orbis::octree::detail {

/// An octant of 4x4x4 voxels in the open, in Morton order. Unknown voxels hold 0.
template <class T>
struct alignas(64) block {
  std::array<T, 64> value{};
  std::uint64_t known = 0;

  /// Whether all voxels are known and have the same value, bit by bit.
  [[nodiscard]] bool is_uniform() const noexcept {
    if (known != ~std::uint64_t{0}) return false;
    bool same = true;
    for (const T v : value) same &= v == value[0];
    return same;
  }
};

/// The most values an octant can have and still be stored as indices.
inline constexpr unsigned max_palette_bits = 5;
inline constexpr unsigned max_palette = 1U << max_palette_bits;

/// The distinct values of a block: `plane[j]` holds bit j of every voxel's index into `value`.
template <class T>
struct palette {
  unsigned count = 0;  ///< more than max_palette: too many
  std::array<std::uint64_t, max_palette_bits> plane{};
  std::array<T, max_palette> value{};

  void add(T v, std::uint64_t where) noexcept {
    value[count] = v;
    for (unsigned j = 0; j != max_palette_bits; ++j)
      if ((count >> j & 1U) != 0) plane[j] |= where;
    ++count;
  }
};

/// The voxels whose index is `i`, among those whose index has `bits` planes.
template <unsigned Bits>
[[nodiscard]] constexpr std::uint64_t voxels_of_index(const std::uint64_t* plane, unsigned i) noexcept {
  std::uint64_t where = ~std::uint64_t{0};
  for (unsigned j = 0; j != Bits; ++j) where &= (i >> j & 1U) != 0 ? plane[j] : ~plane[j];
  return where;
}

template <class T>
using bits_of =
    std::conditional_t<sizeof(T) == 1, std::uint8_t,
                       std::conditional_t<sizeof(T) == 2, std::uint16_t,
                                          std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>>>;

/// Finds the distinct values of the known voxels of `b`, in the order of their first voxels.
template <class T>
void find_palette_portable(const block<T>& b, palette<T>& p) noexcept {
  p.count = 0;
  p.plane.fill(0);
  for (std::uint64_t rest = b.known; rest != 0;) {
    const T v = b.value[static_cast<std::size_t>(std::countr_zero(rest))];
    std::uint64_t same = 0;
    for (std::size_t i = 0; i != 64; ++i)
      same |= std::uint64_t{std::bit_cast<bits_of<T>>(b.value[i]) == std::bit_cast<bits_of<T>>(v)} << i;
    if (p.count == max_palette) {
      ++p.count;
      return;
    }
    p.add(v, same & rest);
    rest &= ~same;
  }
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void find_palette_avx2(const block<float>& b, palette<float>& p) noexcept {
  p.count = 0;
  p.plane.fill(0);
  const auto* const in = reinterpret_cast<const __m256i*>(b.value.data());
  for (std::uint64_t rest = b.known; rest != 0;) {
    const float v = b.value[static_cast<std::size_t>(std::countr_zero(rest))];
    const __m256i wanted = _mm256_set1_epi32(std::bit_cast<std::int32_t>(v));
    std::uint64_t same = 0;
    for (unsigned i = 0; i != 8; ++i) {
      const __m256 equal = _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_load_si256(in + i), wanted));
      same |= std::uint64_t{static_cast<unsigned>(_mm256_movemask_ps(equal))} << (8 * i);
    }
    if (p.count == max_palette) {
      ++p.count;
      return;
    }
    p.add(v, same & rest);
    rest &= ~same;
  }
}

ORBIS_TARGET("avx512f,avx512dq,avx512bw,avx512vl")
inline void find_palette_avx512(const block<float>& b, palette<float>& p) noexcept {
  p.count = 0;
  p.plane.fill(0);
  const float* const v0 = b.value.data();
  const __m512i in0 = _mm512_load_si512(v0), in1 = _mm512_load_si512(v0 + 16);
  const __m512i in2 = _mm512_load_si512(v0 + 32), in3 = _mm512_load_si512(v0 + 48);
  for (std::uint64_t rest = b.known; rest != 0;) {
    const float v = b.value[static_cast<std::size_t>(std::countr_zero(rest))];
    const __m512i wanted = _mm512_set1_epi32(std::bit_cast<std::int32_t>(v));
    const std::uint64_t same = std::uint64_t{_mm512_cmpeq_epi32_mask(in0, wanted)} |
                               std::uint64_t{_mm512_cmpeq_epi32_mask(in1, wanted)} << 16U |
                               std::uint64_t{_mm512_cmpeq_epi32_mask(in2, wanted)} << 32U |
                               std::uint64_t{_mm512_cmpeq_epi32_mask(in3, wanted)} << 48U;
    if (p.count == max_palette) {
      ++p.count;
      return;
    }
    p.add(v, same & rest);
    rest &= ~same;
  }
}
#endif

template <class T>
void expand_palette_portable(const T* values, const std::uint64_t* plane, unsigned bits, block<T>& out) noexcept {
  for (unsigned i = 0; i != 64; ++i) {
    unsigned index = 0;
    for (unsigned j = 0; j != bits; ++j) index |= static_cast<unsigned>(plane[j] >> i & 1U) << j;
    out.value[i] = (out.known >> i & 1U) != 0 ? values[index] : T{};
  }
}

#if ORBIS_X86
ORBIS_TARGET("avx2")
inline void expand_palette_avx2(const float* values, const std::uint64_t* plane, unsigned bits,
                                block<float>& out) noexcept {
  const __m256i lane = _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128);
  for (unsigned i = 0; i != 64; i += 8) {
    const auto spread = [&](std::uint64_t mask) ORBIS_TARGET("avx2") {
      const __m256i byte = _mm256_set1_epi32(static_cast<int>(mask >> i & 0xffU));
      return _mm256_cmpeq_epi32(_mm256_and_si256(byte, lane), lane);
    };
    __m256i index = _mm256_setzero_si256();
    for (unsigned j = 0; j != bits; ++j)
      index = _mm256_or_si256(index, _mm256_and_si256(spread(plane[j]), _mm256_set1_epi32(1 << j)));
    const __m256 v = _mm256_i32gather_ps(values, index, 4);
    _mm256_store_ps(out.value.data() + i, _mm256_and_ps(v, _mm256_castsi256_ps(spread(out.known))));
  }
}

ORBIS_TARGET("avx512f,avx512dq,avx512bw,avx512vl")
inline void expand_palette_avx512(const float* values, const std::uint64_t* plane, unsigned bits,
                                  block<float>& out) noexcept {
  const unsigned count = 1U << bits;
  const __m512 low = _mm512_maskz_loadu_ps(static_cast<__mmask16>(count >= 16 ? 0xffffU : (1U << count) - 1), values);
  const __m512 high = count > 16 ? _mm512_loadu_ps(values + 16) : low;
  for (unsigned i = 0; i != 64; i += 16) {
    __m512i index = _mm512_setzero_si512();
    for (unsigned j = 0; j != bits; ++j)
      index = _mm512_mask_add_epi32(index, static_cast<__mmask16>(plane[j] >> i), index, _mm512_set1_epi32(1 << j));
    const auto known = static_cast<__mmask16>(out.known >> i);
    _mm512_store_ps(out.value.data() + i, _mm512_maskz_permutex2var_ps(known, low, index, high));
  }
}
#endif

/// Finds the distinct values of the known voxels of `b`. Every level gives the same.
template <class T>
void find_palette(const block<T>& b, palette<T>& p, simd::level level = simd::detected()) noexcept {
  if constexpr (std::is_same_v<T, float>) {
    simd::select<void(const block<float>&, palette<float>&)>(level, {
      .portable = find_palette_portable<float>,
#if ORBIS_X86
      .popcnt = nullptr, .avx2 = find_palette_avx2, .avx512 = find_palette_avx512
#endif
    })(b, p);
  } else {
    find_palette_portable(b, p);
  }
}

/// Gives the voxels that `out` knows the values that `plane[0 ... bits)` choose among the 2^bits
/// `values`, and the others 0. Every level gives the same.
template <class T>
void expand_palette(const T* values, const std::uint64_t* plane, unsigned bits, block<T>& out,
                    simd::level level = simd::detected()) noexcept {
  if constexpr (std::is_same_v<T, float>) {
    simd::select<void(const float*, const std::uint64_t*, unsigned, block<float>&)>(level, {
      .portable = expand_palette_portable<float>,
#if ORBIS_X86
      .popcnt = nullptr, .avx2 = expand_palette_avx2, .avx512 = expand_palette_avx512
#endif
    })(values, plane, bits, out);
  } else {
    expand_palette_portable(values, plane, bits, out);
  }
}

}  // namespace orbis::octree::detail
