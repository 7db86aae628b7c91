// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Nearest and farthest depth around every pixel of a depth image. `take` is defined in take_depth_windows.hpp.
#pragma once

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/core/execution.hpp>

namespace orbis::cloud::detail {

/// Extremes of the measured depths in the square window around every pixel, and the depth at its centre, metres along
/// the optical axis; for every tile of `tile` x `tile` pixels, the maximum of the farthest depths. Memory is reused
/// between images.
class depth_windows {
 public:
  static constexpr int tile = 16;
  /// Marks a missing depth; less than any depth.
  static constexpr float none = -std::numeric_limits<float>::infinity();

  /// Reads an image. `radius`: the window has 2 radius + 1 pixels per side. `nearest` is `none` if any pixel of the
  /// window is outside the image or has no depth, because an unmeasured surface may be nearer. O(width * height *
  /// radius). @pre radius >= 0
  template <execution_policy Policy, camera::depth_source Depth>
  void take(const Policy& policy, const Depth& depth, int radius);

  [[nodiscard]] int width() const noexcept { return width_; }
  [[nodiscard]] int height() const noexcept { return height_; }
  [[nodiscard]] int tiles_across() const noexcept { return tiles_across_; }
  [[nodiscard]] int tiles_down() const noexcept { return (height_ + tile - 1) / tile; }
  /// Nearest depth in the window of each pixel, row-major; `none` if a pixel of the window has no depth.
  [[nodiscard]] const float* nearest() const noexcept { return nearest_.data(); }
  /// Greatest depth in the window of each pixel, row-major; `none` if no pixel of the window has a depth.
  [[nodiscard]] const float* farthest() const noexcept { return farthest_.data(); }
  /// Depth of each pixel, row-major; `none` if the pixel has no depth.
  [[nodiscard]] const float* middle() const noexcept { return middle_.data(); }
  /// Greatest depth in the windows of the tiles `[x0, x1] x [y0, y1]`. @pre the tiles exist
  [[nodiscard]] float farthest_of_tiles(int x0, int y0, int x1, int y1) const noexcept {
    float out = none;
    for (int y = y0; y <= y1; ++y) {
      for (int x = x0; x <= x1; ++x)
        out = std::max(out, tile_farthest_[static_cast<std::size_t>(y * tiles_across_ + x)]);
    }
    return out;
  }

 private:
  int width_ = 0;
  int height_ = 0;
  int tiles_across_ = 0;
  std::vector<float> nearest_;
  std::vector<float> farthest_;
  std::vector<float> middle_;
  std::vector<float> row_nearest_;  ///< nearest depth in the middle row of each pixel's window
  std::vector<float> row_farthest_;
  std::vector<float> tile_farthest_;
};

}  // namespace orbis::cloud::detail
