// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A copy of a depth image.
#pragma once

#include <concepts>
#include <cstdint>
#include <utility>

#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>

namespace orbis::slam::detail {

/// Copies depth images, reusing its memory. 16-bit pixels are not converted to metres, because few of them are read.
class depth_copy {
 public:
  /// Copies an image. O(pixels).
  template <camera::depth_source Depth>
  void assign(const Depth& depth) {
    if constexpr (std::same_as<Depth, camera::depth_view<std::uint16_t>>) {
      copy_pixels(depth.pixels(), stored_);
      view_ = camera::depth_view<std::uint16_t>{std::as_const(stored_).view(), depth.scale(), depth.min_depth(),
                                                depth.max_depth()};
    } else {
      view_ = {};
      if (metres_.width() != depth.width() || metres_.height() != depth.height())
        metres_ = image<float>(depth.width(), depth.height());
      for (int y = 0; y != depth.height(); ++y)
        for (int x = 0; x != depth.width(); ++x) metres_(x, y) = depth(x, y);
    }
  }
  /// Calls `f(view)` with a view of the last image.
  template <class F>
  void visit(const F& f) const {
    if (view_.width() != 0)
      f(view_);
    else
      f(camera::depth_view<float>{metres_.view()});
  }

 private:
  image<std::uint16_t> stored_;
  camera::depth_view<std::uint16_t> view_;  // of `stored_`; without pixels if the image is in `metres_`
  image<float> metres_;
};

}  // namespace orbis::slam::detail
