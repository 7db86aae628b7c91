// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An image pyramid: copies of an image at several scales.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/features/detail/extract/resize_plan.hpp>

namespace orbis::features {

/// A grey image and downscaled copies of it, each computed from the previous one by bilinear interpolation. Level k is
/// `scale_factor`^k times smaller than the image, with its sides rounded to whole pixels. Reuses its memory between
/// images.
class image_pyramid {
 public:
  image_pyramid() = default;
  image_pyramid(image_pyramid&&) noexcept = default;
  image_pyramid& operator=(image_pyramid&&) noexcept = default;
  image_pyramid(const image_pyramid&) = delete;  // the levels of a copy would refer to the original
  image_pyramid& operator=(const image_pyramid&) = delete;
  ~image_pyramid() = default;

  /// Builds the pyramid. Level 0 is `image` itself, not a copy, so the image must outlive the use of the levels. Levels
  /// with a side of less than `min_side` pixels, and all coarser levels, are omitted. O(pixels). Allocates nothing if
  /// a previous image had the same size.
  /// @pre levels >= 0, scale_factor > 1, min_side >= 1
  ORBIS_LAZY void build(image_view<const std::uint8_t> image, int levels, double scale_factor, int min_side);

  /// The number of levels.
  [[nodiscard]] std::size_t size() const noexcept { return views_.size(); }
  [[nodiscard]] bool empty() const noexcept { return views_.empty(); }
  /// A level; level 0 is the image. @pre level < size()
  [[nodiscard]] image_view<const std::uint8_t> operator[](std::size_t level) const {
    assert(level < views_.size());
    return views_[level];
  }

  /// Converts a coordinate on a level to a coordinate in the full image (pixels), or back if the sizes are swapped.
  /// Pixels are areas whose centres are at integers; plain multiplication would shift coarse keypoints by up to a
  /// pixel.
  [[nodiscard]] static double full_coordinate(double at, int level_size, int full_size) noexcept {
    return (at + 0.5) * full_size / level_size - 0.5;
  }

 private:
  struct shrunk_level {
    std::vector<std::uint8_t> pixels;
    detail::resize_workspace memory;
  };
  std::vector<image_view<const std::uint8_t>> views_;
  std::vector<shrunk_level> shrunk_;
};

}  // namespace orbis::features

#ifndef ORBIS_COMPILED
#include <orbis/features/pyramid-inl.hpp>
#endif
