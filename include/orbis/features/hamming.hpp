// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The Hamming distance of binary descriptors, one pair at a time.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

#include <orbis/features/descriptor.hpp>

namespace orbis::features {

/// A distance between two descriptors: a whole number, smaller means more alike.
template <class F, class Descriptor>
concept descriptor_distance = std::regular_invocable<const F&, const Descriptor&, const Descriptor&> &&
    std::convertible_to<std::invoke_result_t<const F&, const Descriptor&, const Descriptor&>, std::uint32_t>;

namespace detail {

/// The number of ones in `x`, by adding neighbouring fields in parallel: without the POPCNT
/// instruction `std::popcount` is a call into the compiler's library.
[[nodiscard]] constexpr std::uint32_t count_ones(std::uint64_t x) noexcept {
  x -= (x >> 1U) & 0x5555555555555555ULL;
  x = (x & 0x3333333333333333ULL) + ((x >> 2U) & 0x3333333333333333ULL);
  x = (x + (x >> 4U)) & 0x0f0f0f0f0f0f0f0fULL;
  return static_cast<std::uint32_t>((x * 0x0101010101010101ULL) >> 56U);
}

}  // namespace detail

/// The number of bits in which two descriptors differ.
///
/// For many pairs the matchers recognise this type and use the kernels of `hamming_nearest.hpp`.
struct hamming {
  template <std::size_t Bits>
  [[nodiscard]] constexpr std::uint32_t operator()(const binary_descriptor<Bits>& a,
                                                   const binary_descriptor<Bits>& b) const noexcept {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i != a.words.size(); ++i) sum += detail::count_ones(a.words[i] ^ b.words[i]);
    return sum;
  }
};
static_assert(descriptor_distance<hamming, binary_descriptor<256>>);

}  // namespace orbis::features
