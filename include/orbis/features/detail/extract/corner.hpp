// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Corners of one image, and what finds and chooses them.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::features {

/// A corner of one pyramid level: pixel and strength, and where in the pixel it lies.
struct corner {
  int x = 0;
  int y = 0;
  float response = 0.0F;
  float dx = 0.0F;  ///< from the pixel's centre, at most half a pixel
  float dy = 0.0F;
  friend constexpr bool operator==(const corner&, const corner&) = default;
};

/// The order in which corners are stored: by row, then column.
[[nodiscard]] constexpr bool before_in_image(const corner& a, const corner& b) noexcept {
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}
/// A total order, so that no choice depends on the order of the input: stronger first, then by place.
[[nodiscard]] constexpr bool stronger(const corner& a, const corner& b) noexcept {
  return a.response != b.response ? a.response > b.response : before_in_image(a, b);
}

/// A rectangle of pixels: columns [x, x + width), rows [y, y + height).
struct region {
  int x = 0, y = 0, width = 0, height = 0;
  [[nodiscard]] constexpr bool empty() const noexcept { return width <= 0 || height <= 0; }
  [[nodiscard]] constexpr bool contains(int px, int py) const noexcept {
    return px >= x && py >= y && std::int64_t{px} - x < width && std::int64_t{py} - y < height;
  }
  friend constexpr bool operator==(const region&, const region&) = default;
};

/// Which corners to look for: those of at least `strong`, and those of at least `weak` where there
/// is nothing else.
struct corner_thresholds {
  int strong = 20;
  int weak = 7;
};

/// Replaces the contents of a vector by the corners in an area of an image, by row, then column.
template <class D>
concept corner_detector = std::default_initializable<typename D::workspace> &&
    requires(const D& detect, simd::level level, image_view<const std::uint8_t> image, const region& area,
             const corner_thresholds& thresholds, typename D::workspace& memory, std::vector<corner>& corners) {
  detect(level, image, area, thresholds, memory, corners);
};

/// The corners of one pyramid level.
struct level_corners {
  std::vector<corner> corners;
  region area;         ///< in which they lie
  double scale = 1.0;  ///< pixels of the full image to one of the level
};

/// Leaves at most `wanted` corners on all levels together, on each by row, then column. Level 0 is the finest.
template <class D>
concept corner_distribution = std::default_initializable<typename D::workspace> &&
    requires(const D& choose, std::span<level_corners> levels, int wanted, typename D::workspace& memory) {
  choose(levels, wanted, memory);
};

}  // namespace orbis::features
