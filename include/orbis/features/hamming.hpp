// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The Hamming distance of binary descriptors, one pair at a time.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>

#include <orbis/core/bits.hpp>
#include <orbis/features/descriptor.hpp>

namespace orbis::features {

/// A distance between two descriptors: a whole number, smaller means more alike.
template <class F, class Descriptor>
concept descriptor_distance = std::regular_invocable<const F&, const Descriptor&, const Descriptor&> &&
    std::convertible_to<std::invoke_result_t<const F&, const Descriptor&, const Descriptor&>, std::uint32_t>;

/// The number of bits in which two descriptors differ.
///
/// For many pairs the matchers recognise this type and use the kernels of `hamming_nearest.hpp`.
struct hamming {
  template <std::size_t Bits>
  [[nodiscard]] constexpr std::uint32_t operator()(const binary_descriptor<Bits>& a,
                                                   const binary_descriptor<Bits>& b) const noexcept {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i != a.words.size(); ++i) sum += count_ones(a.words[i] ^ b.words[i]);
    return sum;
  }
};
static_assert(descriptor_distance<hamming, binary_descriptor<256>>);

}  // namespace orbis::features
