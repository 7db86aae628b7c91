// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversion of colour and 16-bit images to 8-bit grey images, the input of extractors.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>

namespace orbis::features {

/// Converts a colour image to luma (Rec. 601, rounded to nearest); bit-identical to OpenCV's COLOR_RGB2GRAY. O(pixels).
/// @pre both images have the same size
ORBIS_LAZY void luma(image_view<const rgb8> from, image_view<std::uint8_t> to);

/// Converts a 16-bit image (infrared, thermal, raw) to 8 bits: values up to `low` become 0, values of at least `high`
/// become 255, and those in between are scaled linearly and rounded. Use the same `low` and `high` for a whole
/// recording; otherwise the brightness flickers. O(pixels).
/// @pre low < high; both images have the same size
inline void narrow(image_view<const std::uint16_t> from, image_view<std::uint8_t> to, std::uint16_t low,
                   std::uint16_t high) {
  assert(low < high && from.width() == to.width() && from.height() == to.height());
  const std::uint32_t range = std::uint32_t{high} - low;
  for (int y = 0; y < from.height(); ++y)
    for (int x = 0; x < from.width(); ++x) {
      const std::uint32_t above = std::uint32_t{std::clamp(from(x, y), low, high)} - low;
      to(x, y) = static_cast<std::uint8_t>((above * 255 + range / 2) / range);
    }
}

}  // namespace orbis::features

#ifndef ORBIS_COMPILED
#include <orbis/features/grey-inl.hpp>
#endif
