// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What keeps the depth images of keyframes for the live map.
#pragma once

#include <concepts>
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::mapping {

/// Keeps depth images by the index of their frame, and gives them back pixel by pixel.
///
/// `put(frame, pixels)` keeps a copy, in place of the image that was there. On an error the image is kept even so, or
/// `get` fails for it from then on.
///
/// `get(frame, out)` copies it to `out`, whose size changes to the image's. If it is const, several threads may call it
/// at once.
///
/// `erase(frame)` forgets it, if it is there.
template <class S>
concept depth_history = std::movable<S> &&
    requires(S& store, std::uint64_t frame, image_view<const std::uint16_t> pixels, image<std::uint16_t>& out) {
  { store.put(frame, pixels) } -> std::same_as<result<void>>;
  { store.get(frame, out) } -> std::same_as<result<void>>;
  store.erase(frame);
};

}  // namespace orbis::mapping
