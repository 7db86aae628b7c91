// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A copy of a depth image.
#pragma once

#include <cstdint>
#include <utility>

#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>

namespace orbis::slam::detail {

/// Copies depth images, reusing its memory. 16-bit pixels are not converted to metres, because few of them are read.
class depth_copy {
 public:
  /// Copies an image. The returned view of the copy is valid until the next call. O(pixels).
  [[nodiscard]] camera::depth_view<std::uint16_t> keep(const camera::depth_view<std::uint16_t>& depth) {
    copy_pixels(depth.pixels(), stored_);
    return camera::depth_view<std::uint16_t>{std::as_const(stored_).view(), depth.scale(), depth.min_depth(),
                                             depth.max_depth()};
  }
  template <camera::depth_source Depth>
  [[nodiscard]] camera::depth_view<float> keep(const Depth& depth) {
    if (metres_.width() != depth.width() || metres_.height() != depth.height())
      metres_ = image<float>(depth.width(), depth.height());
    for (int y = 0; y != depth.height(); ++y)
      for (int x = 0; x != depth.width(); ++x) metres_(x, y) = depth(x, y);
    return camera::depth_view<float>{std::as_const(metres_).view()};
  }

 private:
  image<std::uint16_t> stored_;
  image<float> metres_;
};

}  // namespace orbis::slam::detail
