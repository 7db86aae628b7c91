// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keypoints, descriptors, and features, which combine both.
#pragma once

#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <vector>

namespace orbis::features {

/// A keypoint descriptor: any copyable value. A `descriptor_distance` compares two descriptors. Place recognition
/// requires a `bit_string`, for which `hamming` is fast.
template <class D>
concept feature_descriptor = std::semiregular<D>;

/// A bit string that describes the neighbourhood of a keypoint. Bit `i` is bit `i % 64` of word `i / 64`; on a
/// little-endian machine, the bytes are those of a row of an OpenCV descriptor matrix.
template <std::size_t Bits>
requires(Bits > 0 && Bits % 64 == 0) struct binary_descriptor {
  static constexpr std::size_t bits = Bits;
  std::array<std::uint64_t, Bits / 64> words{};

  /// @pre i < Bits
  [[nodiscard]] constexpr bool bit(std::size_t i) const noexcept { return ((words[i / 64] >> (i % 64)) & 1U) != 0; }
  friend constexpr bool operator==(const binary_descriptor&, const binary_descriptor&) = default;
};
static_assert(sizeof(binary_descriptor<256>) == 32 && std::is_trivially_copyable_v<binary_descriptor<256>>);

/// An image point that can be detected again in other images.
struct keypoint {
  float x = 0.0F, y = 0.0F;  ///< position in the full image, pixels; pixel centres are at integers
  float size = 0.0F;         ///< diameter of the described neighbourhood, pixels of the full image
  float angle = 0.0F;        ///< orientation in radians, [0, 2 pi), from x (right) towards y (down)
  float response = 0.0F;     ///< strength of the corner; comparable within one extractor
  int octave = 0;            ///< pyramid level, 0 the finest
  friend constexpr bool operator==(const keypoint&, const keypoint&) = default;
};

/// The output of an extractor: `descriptors[i]` describes `keypoints[i]`.
template <feature_descriptor Descriptor>
struct basic_features {
  std::vector<keypoint> keypoints;
  std::vector<Descriptor> descriptors;

  [[nodiscard]] std::size_t size() const noexcept { return keypoints.size(); }
  [[nodiscard]] bool empty() const noexcept { return keypoints.empty(); }
  friend bool operator==(const basic_features&, const basic_features&) = default;
};

/// ORB features.
using features = basic_features<binary_descriptor<256>>;

}  // namespace orbis::features
