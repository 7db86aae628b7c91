// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// When the rows of an RGB-D camera's images are taken.
#pragma once

namespace orbis::camera {

/// The times of the rows of a colour image and of its depth image. A rolling shutter reads the rows one after the
/// other, the top row first, evenly over the read-out time; with a read-out of 0 the shutter is global: all rows are of
/// one time. Times are relative to that of the frame, which is the middle of the colour image's read-out.
struct shutter {
  double color_read_out = 0.0;  ///< from the first row to the end of the last one, seconds
  double depth_read_out = 0.0;  ///< the same of the depth image
  double depth_delay = 0.0;     ///< from the middle of the colour image to that of the depth image, seconds

  /// Whether all rows of both images are taken at one time.
  [[nodiscard]] constexpr bool is_global() const noexcept {
    return color_read_out == 0.0 && depth_read_out == 0.0 && depth_delay == 0.0;
  }
  /// When row `v` (the centre of the top row is 0) of a colour image with `height` rows is taken, seconds.
  [[nodiscard]] constexpr double color_time(double v, int height) const noexcept {
    return color_read_out * share(v, height);
  }
  /// The same of the depth image.
  [[nodiscard]] constexpr double depth_time(double v, int height) const noexcept {
    return depth_delay + depth_read_out * share(v, height);
  }

  friend constexpr bool operator==(const shutter&, const shutter&) = default;

 private:
  [[nodiscard]] static constexpr double share(double v, int height) noexcept { return (v + 0.5) / height - 0.5; }
};

}  // namespace orbis::camera
