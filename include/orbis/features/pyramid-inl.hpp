// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of pyramid.hpp.
#pragma once

#include <cmath>

#include <orbis/features/detail/extract/resize.hpp>
#include <orbis/features/pyramid.hpp>

namespace orbis::features {

ORBIS_LAZY_INLINE void image_pyramid::build(image_view<const std::uint8_t> image, int levels, double scale_factor,
                                            int min_side) {
  assert(levels >= 0 && scale_factor > 1.0 && min_side >= 1);
  views_.clear();
  double scale = 1.0;
  for (int level = 0; level < levels; ++level, scale *= scale_factor) {
    const int width = static_cast<int>(std::lround(image.width() / scale));
    const int height = static_cast<int>(std::lround(image.height() / scale));
    if (width < min_side || height < min_side) break;
    if (level == 0) {
      views_.push_back(image);
      continue;
    }
    if (shrunk_.size() < views_.size()) shrunk_.resize(views_.size());
    shrunk_level& to = shrunk_[views_.size() - 1];
    const std::ptrdiff_t stride = (static_cast<std::ptrdiff_t>(width) + 63) / 64 * 64;
    const std::size_t needed = static_cast<std::size_t>(stride) * static_cast<std::size_t>(height);
    if (to.pixels.size() < needed) to.pixels.resize(needed);
    const image_view<std::uint8_t> view{to.pixels.data(), width, height, stride};
    detail::resize(views_.back(), view, to.memory);
    views_.push_back(view);
  }
}

}  // namespace orbis::features
