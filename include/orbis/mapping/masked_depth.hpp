// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images with removed pixels, in the pixel format of the original image.
#pragma once

#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>

namespace orbis::mapping {

namespace detail {

template <class Depth>
struct depth_pixel {
  using type = float;
};
template <class T>
struct depth_pixel<camera::depth_view<T>> {
  using type = T;
};

}  // namespace detail

/// Pixel type of a copy of a depth image: for a `camera::depth_view` the type of its stored values, otherwise a type
/// for metres.
template <camera::depth_source Depth>
using depth_pixel = typename detail::depth_pixel<Depth>::type;

/// The stored value of a pixel.
template <camera::depth_source Depth>
[[nodiscard]] depth_pixel<Depth> stored_depth(const Depth& depth, int x, int y) {
  if constexpr (requires { depth.pixels(); })
    return depth.pixels()(x, y);
  else
    return depth(x, y);
}

/// A view of `masked`, which contains the stored values of `depth` and 0 in removed pixels; the other values have the
/// same meaning as in `depth`.
template <camera::depth_source Depth>
[[nodiscard]] camera::depth_view<depth_pixel<Depth>> view_like(const Depth& depth,
                                                               image_view<const depth_pixel<Depth>> masked) {
  if constexpr (requires { depth.scale(); })
    return camera::depth_view<depth_pixel<Depth>>(masked, depth.scale(), depth.min_depth(), depth.max_depth());
  else
    return camera::depth_view<depth_pixel<Depth>>(masked);
}

}  // namespace orbis::mapping
