// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A store of the keyframes' depth images for the live map.
#pragma once

#include <concepts>
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::mapping {

/// Stores depth images by the index of their frame, and returns them exactly.
///
/// `put(frame, pixels)` stores a copy, and replaces an image of the same frame. After an error, either the image is
/// nevertheless stored, or `get` fails for it afterwards.
///
/// `get(frame, out)` copies the image to `out`, whose size changes to the image's. If it is const, several threads may
/// call it concurrently.
///
/// `erase(frame)` removes the image, if it exists.
///
/// It may have a `mask(frame, pixels)` (`masks_depth`): `get` then returns `pixels`, which are those of the last `put`
/// of this frame with 0 in pixels that a filter removed. Without it, `put` replaces the image.
template <class S>
concept depth_history = std::movable<S> &&
    requires(S& store, std::uint64_t frame, image_view<const std::uint16_t> pixels, image<std::uint16_t>& out) {
  { store.put(frame, pixels) } -> std::same_as<result<void>>;
  { store.get(frame, out) } -> std::same_as<result<void>>;
  store.erase(frame);
};
/// A `depth_history` with a `mask`, which removes pixels of a stored image, and restores them, without another `put`.
template <class S>
concept masks_depth = depth_history<S> &&
    requires(S& store, std::uint64_t frame, image_view<const std::uint16_t> pixels) {
  { store.mask(frame, pixels) } -> std::same_as<result<void>>;
};

}  // namespace orbis::mapping
