// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Moves those of eight lanes that are wanted together, for processors that have no instruction for it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>

#if ORBIS_X86
#include <immintrin.h>

namespace orbis::octree::detail {

/// Byte i of entry m: the i-th bit that is set in m.
inline constexpr std::array<std::uint64_t, 256> set_bits = [] {
  std::array<std::uint64_t, 256> all{};
  for (std::size_t mask = 0; mask != all.size(); ++mask)
    for (unsigned bit = 0, n = 0; bit != 8; ++bit)
      if ((mask >> bit & 1U) != 0) all[mask] |= std::uint64_t{bit} << (8 * n++);
  return all;
}();

/// The permutation that brings the lanes of `mask` to the front, in their order. @pre mask < 256
ORBIS_TARGET("avx2") inline __m256i packed_lanes(std::uint32_t mask) noexcept {
  return _mm256_cvtepu8_epi32(_mm_cvtsi64_si128(static_cast<long long>(set_bits[mask])));
}

}  // namespace orbis::octree::detail
#endif
