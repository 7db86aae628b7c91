// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A store of the keyframes' depth images for the live map.
#pragma once

#include <concepts>
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>

namespace orbis::mapping {

/// Stores depth images, indexed by frame, and returns them without loss.
///
/// `put(frame, pixels)` stores a copy, and replaces an existing image of the same frame. After an error, either the
/// image is nevertheless stored, or `get` fails for this frame.
///
/// `get(frame, out)` copies the image to `out`, which is resized to the size of the image. If `get` is const, several
/// threads may call it concurrently.
///
/// `erase(frame)` removes the image, if it exists.
///
/// A store may also have `mask(frame, pixels)`, see `masks_depth`. `pixels` are those of the last `put` of this frame,
/// with 0 in pixels that a filter removed; `get` then returns `pixels`. Without `mask`, `put` replaces the image.
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
