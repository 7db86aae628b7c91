// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Concepts for feature extractors and for the parts of `basic_orb_extractor`.
///
/// | concept | purpose | implementation |
/// | --- | --- | --- |
/// | `feature_extractor` | finds and describes the keypoints in an image | `orb_extractor` |
/// | `pyramid_extractor` | also returns the image pyramid | `orb_extractor` |
/// | `corner_detector` | finds the corners of a pyramid level | `fast9` |
/// | `corner_selection` | selects among the corners of all levels | `cover_first` |
/// | `orientation_estimator` | estimates the direction of a keypoint | `intensity_centroid` |
/// | `patch_descriptor` | describes the pixels around a keypoint | `steered_brief` |
#pragma once

#include <concepts>
#include <cstdint>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/features/descriptor.hpp>

namespace orbis::features {

class image_pyramid;

namespace detail {
template <class T>
inline constexpr bool is_features = false;
template <class D>
inline constexpr bool is_features<basic_features<D>> = true;
}  // namespace detail

/// Finds features in a colour image: a callable that returns `basic_features<D>` for any `feature_descriptor` D.
/// Concurrent calls on a const object are allowed.
template <class E>
concept feature_extractor = requires(const E& extract, image_view<const rgb8> image) {
  requires detail::is_features<decltype(extract(image))>;
};

/// An extractor for grey images that also returns the pyramid of the image, so that callers need not rebuild it:
/// `extract.into(found, pyramid, image)`. The octave of a keypoint is its level in the pyramid.
template <class E>
concept pyramid_extractor = feature_extractor<E> &&
    requires(const E& extract, std::remove_cvref_t<decltype(extract(std::declval<image_view<const rgb8>>()))>& found,
             image_pyramid& pyramid, image_view<const std::uint8_t> image) {
  extract.into(found, pyramid, image);
};

/// The type of an extractor's descriptors.
template <feature_extractor E>
using extracted_descriptor =
    typename decltype(std::declval<const E&>()(std::declval<image_view<const rgb8>>()).descriptors)::value_type;

/// A corner of one pyramid level: a pixel, its response, and the subpixel offset.
struct corner {
  int x = 0;              ///< column, pixels of the level
  int y = 0;              ///< row
  float response = 0.0F;  ///< strength, >= 0
  float dx = 0.0F;        ///< subpixel offset from the pixel's centre, in [-0.5, 0.5]
  float dy = 0.0F;
  friend constexpr bool operator==(const corner&, const corner&) = default;
};

/// Order of stored corners: by row, then by column.
[[nodiscard]] constexpr bool before_in_image(const corner& a, const corner& b) noexcept {
  return a.y != b.y ? a.y < b.y : a.x < b.x;
}
/// Orders corners by strength, strongest first, then by position: a total order, so that selections do not depend on
/// the input order.
[[nodiscard]] constexpr bool stronger(const corner& a, const corner& b) noexcept {
  return a.response != b.response ? a.response > b.response : before_in_image(a, b);
}

/// A rectangle of pixels: columns [x, x + width), rows [y, y + height).
struct region {
  int x = 0, y = 0, width = 0, height = 0;
  [[nodiscard]] constexpr bool empty() const noexcept { return width <= 0 || height <= 0; }
  friend constexpr bool operator==(const region&, const region&) = default;
};

/// Brightness thresholds: a detector returns corners with a difference of at least `strong` and, in neighbourhoods
/// without such corners, corners with at least `weak`. 0 <= weak <= strong <= 254.
struct corner_thresholds {
  int strong = 20;
  int weak = 7;
};

/// `detect(image, area, thresholds, memory, corners)` replaces `corners` with the corners of `image` in `area`, ordered
/// by `before_in_image`. `memory` is a reusable `D::workspace`.
template <class D>
concept corner_detector = std::default_initializable<typename D::workspace> &&
    requires(const D& detect, image_view<const std::uint8_t> image, const region& area,
             const corner_thresholds& thresholds, typename D::workspace& memory, std::vector<corner>& corners) {
  detect(image, area, thresholds, memory, corners);
};

/// The corners of one pyramid level.
struct level_corners {
  std::vector<corner> corners;
  region area;         ///< the area that contains the corners, pixels of the level
  double scale = 1.0;  ///< pixels of the full image per pixel of the level
};

/// `choose(levels, wanted, memory)` erases corners until at most `wanted` remain in total; each level is ordered by
/// `before_in_image`. Level 0 is the finest.
template <class D>
concept corner_selection = std::default_initializable<typename D::workspace> &&
    requires(const D& choose, std::span<level_corners> levels, int wanted, typename D::workspace& memory) {
  choose(levels, wanted, memory);
};

/// A direction in the image: angle in radians, [0, 2 pi), from x (right) towards y (down).
struct orientation {
  float angle = 0.0F;
  float cosine = 1.0F;
  float sine = 0.0F;
};

/// `orient(image, x, y)` returns the direction at a pixel of a pyramid level that is at least `O::radius` pixels from
/// the left, upper and lower edges and `O::radius` + 1 pixels from the right edge.
template <class O>
concept orientation_estimator = requires(const O& orient, image_view<const std::uint8_t> image, int at) {
  { O::radius } -> std::convertible_to<int>;
  { orient(image, at, at) } -> std::same_as<orientation>;
};

/// Describes the pixels around a keypoint. Call `describe.prepare(image, first, last, memory)` once per pyramid level
/// with the rows [first, last) of its keypoints; then `describe(memory, x, y, orientation)` returns the `D::descriptor`
/// of a pixel that is at least `D::reach` pixels from the edge. `D::diameter` (pixels) becomes `keypoint::size`.
template <class D>
concept patch_descriptor = std::default_initializable<typename D::workspace> &&
    requires(const D& describe, image_view<const std::uint8_t> image, typename D::workspace& memory,
             const typename D::workspace& prepared, int at, const orientation& o) {
  requires feature_descriptor<typename D::descriptor>;
  { D::reach } -> std::convertible_to<int>;
  { D::diameter } -> std::convertible_to<int>;
  describe.prepare(image, at, at, memory);
  { describe(prepared, at, at, o) } -> std::same_as<typename D::descriptor>;
};

}  // namespace orbis::features
