// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth images from which pixels were removed: in the form of the image that they come from.
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

/// What a copy of the depth image consists of: the stored values of a `camera::depth_view`, otherwise metres.
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

/// `masked` holds the stored values of `depth`, and 0 where they were removed: a view of it in which the others mean
/// what they mean in `depth`.
template <camera::depth_source Depth>
[[nodiscard]] camera::depth_view<depth_pixel<Depth>> view_like(const Depth& depth,
                                                               image_view<const depth_pixel<Depth>> masked) {
  if constexpr (requires { depth.scale(); })
    return camera::depth_view<depth_pixel<Depth>>(masked, depth.scale(), depth.min_depth(), depth.max_depth());
  else
    return camera::depth_view<depth_pixel<Depth>>(masked);
}

}  // namespace orbis::mapping
