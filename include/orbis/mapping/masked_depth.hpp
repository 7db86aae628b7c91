// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images with removed pixels, in the pixel format of the original image.
#pragma once

#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>

namespace orbis::mapping {

/// The stored value of a pixel.
template <camera::depth_source Depth>
[[nodiscard]] camera::depth_pixel<Depth> stored_depth(const Depth& depth, int x, int y) {
  if constexpr (camera::is_depth_view<Depth>)
    return depth.pixels()(x, y);
  else
    return depth(x, y);
}

/// A view of `masked`, which contains the stored values of `depth` and 0 in removed pixels; the other values have the
/// same meaning as in `depth`.
template <camera::depth_source Depth>
[[nodiscard]] camera::depth_view<camera::depth_pixel<Depth>> view_like(
    const Depth& depth, image_view<const camera::depth_pixel<Depth>> masked) {
  if constexpr (camera::is_depth_view<Depth>)
    return camera::depth_view<camera::depth_pixel<Depth>>(masked, depth.scale(), depth.min_depth(), depth.max_depth());
  else
    return camera::depth_view<camera::depth_pixel<Depth>>(masked);
}

}  // namespace orbis::mapping
