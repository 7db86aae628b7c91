// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The keyframe type that mapping uses.
#pragma once

#include <cstdint>
#include <ranges>

#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>

namespace orbis::mapping {

/// A depth image, the colour image registered to it, and the camera pose. The caller owns the images.
template <camera::depth_source Depth = camera::depth_view<std::uint16_t>>
struct keyframe {
  Depth depth;
  image_view<const rgb8> color;  ///< empty, or as large as `depth`
  se3 T_world_camera;
};

/// Any type with the members of a keyframe.
template <class K>
concept keyframe_like = requires(const K& k) {
  requires camera::depth_source<std::remove_cvref_t<decltype(k.depth)>>;
  { k.color } -> std::convertible_to<image_view<const rgb8>>;
  { k.T_world_camera } -> std::convertible_to<se3>;
};

/// A range of keyframes that can be traversed more than once.
template <class R>
concept keyframe_range =
    std::ranges::forward_range<R> && std::ranges::sized_range<R> && keyframe_like<std::ranges::range_value_t<R>>;

}  // namespace orbis::mapping
