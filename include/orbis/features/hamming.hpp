// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Descriptor distances, and the Hamming distance between binary descriptors.
#pragma once

#include <concepts>
#include <cstdint>
#include <type_traits>

#include <orbis/core/bits.hpp>
#include <orbis/features/descriptor.hpp>

namespace orbis::features {

/// A distance between two descriptors: an integer, smaller for more similar descriptors.
template <class F, class Descriptor>
concept descriptor_distance = std::regular_invocable<const F&, const Descriptor&, const Descriptor&> &&
    std::convertible_to<std::invoke_result_t<const F&, const Descriptor&, const Descriptor&>, std::uint32_t>;

/// Hamming distance: the number of bits in which two descriptors differ, for any `bit_string`. Matchers with this
/// distance type compare many pairs at once with vector instructions. The library orbis::compiled contains the code for
/// strings of 256 bits; for other lengths, include brute_force-inl.hpp, windowed-inl.hpp, epipolar-inl.hpp or
/// stereo-inl.hpp.
struct hamming {
  template <bit_string Descriptor>
  [[nodiscard]] constexpr std::uint32_t operator()(const Descriptor& a, const Descriptor& b) const noexcept {
    return hamming_distance(as_words(a), as_words(b));
  }
};
static_assert(descriptor_distance<hamming, binary_descriptor<256>>);

}  // namespace orbis::features
