// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Nearest-neighbour search among a few contiguous descriptors.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include <orbis/core/bits.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/mask.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::places::detail {

/// The Hamming distance, computed word by word, or in one register that holds a whole descriptor.
template <class Target, std::size_t Bits>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::uint32_t count_differing_bits(const bit_words<Bits>& a,
                                                                     const bit_words<Bits>& b) noexcept {
  if constexpr (Bits == 256 && Target::bytes == 32) {
    using lanes = simd::vec<std::uint64_t, Bits / 64, Target>;
    return static_cast<std::uint32_t>(simd::sum(count_bits(lanes::load(a.data()) ^ lanes::load(b.data()))));
  } else {
    std::uint32_t sum = 0;
    for (std::size_t w = 0; w != Bits / 64; ++w) sum += simd::ones<Target>(a[w] ^ b[w]);
    return sum;
  }
}

/// The nearest of `count` children, the first on ties. @pre 0 < count < 65536
template <class Target, std::size_t Bits>
[[nodiscard]] ORBIS_ALWAYS_INLINE std::uint32_t nearest_child(const bit_words<Bits>& query,
                                                              const bit_words<Bits>* children,
                                                              std::uint32_t count) noexcept {
  // Distance and index are combined into one number, so the minimum needs no unpredictable branch.
  std::uint32_t best = ~std::uint32_t{0};
  for (std::uint32_t c = 0; c != count; ++c)
    best = std::min(best, count_differing_bits<Target, Bits>(query, children[c]) << 16U | c);
  return best & 0xffffU;
}

/// The arguments of `assign_nearest`, which sets `nearest[i]` to the index of the nearest centre of descriptor `i`.
template <std::size_t Bits>
struct assignment {
  const bit_words<Bits>* centres;
  std::uint32_t centre_count;
  const bit_words<Bits>* descriptors;
  std::size_t count;
  std::uint16_t* nearest;
};

struct assignment_kernel {
  template <class Target, std::size_t Bits>
  static ORBIS_ALWAYS_INLINE void run(const assignment<Bits>& a) {
    for (std::size_t i = 0; i != a.count; ++i)
      a.nearest[i] =
          static_cast<std::uint16_t>(nearest_child<Target, Bits>(a.descriptors[i], a.centres, a.centre_count));
  }
};

/// Assigns each descriptor to its nearest centre. @pre 0 < centre_count < 65536
template <std::size_t Bits>
void assign_nearest(const assignment<Bits>& a) {
  simd::kernel<assignment_kernel, void(const assignment<Bits>&), simd::popcnt, simd::avx2>()(a);
}

/// Prefetches the cache line at `p`.
[[gnu::always_inline]] inline void prefetch(const void* p) noexcept {
#if defined(__GNUC__)
  __builtin_prefetch(p);
#else
  static_cast<void>(p);
#endif
}

}  // namespace orbis::places::detail
