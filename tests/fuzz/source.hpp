// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bytes as choices, for targets that make something of them other than a file.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/core/types.hpp>

namespace orbis::fuzz {

/// The bytes from first to last; zeros when they are used up.
class source {
 public:
  explicit source(std::span<const std::uint8_t> bytes) : bytes_{bytes} {}
  [[nodiscard]] bool empty() const { return bytes_.empty(); }
  [[nodiscard]] unsigned byte() {
    if (bytes_.empty()) return 0;
    const unsigned b = bytes_.front();
    bytes_ = bytes_.subspan(1);
    return b;
  }
  /// From -128 to 127.
  [[nodiscard]] int signed_byte() { return static_cast<std::int8_t>(byte()); }
  /// Any float: NaN, infinities and denormals too.
  [[nodiscard]] float any() {
    const unsigned b = byte() | byte() << 8U;
    return std::bit_cast<float>(b << 16U | byte() << 8U | byte());
  }
  /// Eighths of voxels, so that faces, edges and corners are hit.
  [[nodiscard]] float near(double resolution) { return static_cast<float>(signed_byte() * 0.125 * resolution); }
  [[nodiscard]] vec3f point(double resolution, bool wild) {
    const auto one = [&] { return wild ? any() : near(resolution); };
    const float x = one(), y = one();
    return {x, y, one()};
  }
  template <class T, std::size_t N>
  [[nodiscard]] const T& one_of(const T (&choices)[N]) {
    return choices[byte() % N];
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace orbis::fuzz
