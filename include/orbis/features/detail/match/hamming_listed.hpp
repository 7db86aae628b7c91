// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Hamming distances between one descriptor and a list of others.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

#include <orbis/core/bits.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/mask.hpp>
#include <orbis/features/detail/match/hamming_search.hpp>

namespace orbis::features::detail {

/// Hamming distance of two strings.
template <class Target, bit_string D>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::uint32_t count_differing_bits(const D& a, const D& b) noexcept {
  std::uint32_t sum = 0;
#pragma GCC unroll 8
  for (std::size_t at = 0; at != sizeof(D); at += 8) {
    std::uint64_t x, y;  // copy word by word: a copy of the whole string would go through memory
    std::memcpy(&x, reinterpret_cast<const char*>(&a) + at, 8);
    std::memcpy(&y, reinterpret_cast<const char*>(&b) + at, 8);
    sum += simd::ones<Target>(x ^ y);
  }
  return sum;
}

struct hamming_listed_kernel {
  template <class Target, class D>
  static ORBIS_ALWAYS_INLINE void run(const D& query, std::span<const D> trains, std::span<const std::uint32_t> indices,
                                      std::span<std::uint32_t> distances) {
    for (std::size_t i = 0; i != indices.size(); ++i)
      distances[i] = count_differing_bits<Target>(query, trains[indices[i]]);
  }
};

template <bit_string D>
void hamming_listed(const D& query, std::span<const D> trains, std::span<const std::uint32_t> indices,
                    std::span<std::uint32_t> distances) {
  assert(distances.size() == indices.size());
  using signature = void(const D&, std::span<const D>, std::span<const std::uint32_t>, std::span<std::uint32_t>);
  simd::kernel<hamming_listed_kernel, signature, simd::popcnt>()(query, trains, indices, distances);
}

}  // namespace orbis::features::detail
