// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Shutter timing of an RGB-D camera.
#pragma once

#include <Eigen/Geometry>

#include <orbis/core/types.hpp>

namespace orbis::camera {

/// The read-out times of a colour image and of its depth image. A rolling shutter reads the rows sequentially from the
/// top, evenly over the read-out time; a read-out time of 0 means a global shutter: all rows are read at the same time.
/// Times are relative to the frame's time, which is the middle of the colour image's read-out.
struct shutter {
  double color_read_out = 0.0;  ///< time from the start of the first row to the end of the last, seconds
  double depth_read_out = 0.0;  ///< read-out time of the depth image, measured in the same way, seconds
  double depth_delay = 0.0;  ///< time from the colour read-out's middle to the depth read-out's middle, seconds; added
                             ///< to the difference between their time stamps, if both have one

  /// Returns true if all rows of both images are read at the same time.
  [[nodiscard]] constexpr bool is_global() const noexcept {
    return color_read_out == 0.0 && depth_read_out == 0.0 && depth_delay == 0.0;
  }
  /// Returns true if each row of the depth image is read at the same time as the same row of the colour image.
  [[nodiscard]] constexpr bool is_depth_simultaneous() const noexcept {
    return depth_delay == 0.0 && depth_read_out == color_read_out;
  }
  /// Returns true if the depth image is taken before the frame's time.
  [[nodiscard]] constexpr bool is_depth_early() const noexcept { return depth_delay < 0.0; }
  /// The time of row `v` (the centre of the top row is 0) of a colour image with `height` rows, seconds.
  [[nodiscard]] constexpr double color_time(double v, int height) const noexcept {
    return color_read_out * share(v, height);
  }
  /// The time of row `v` of a depth image with `height` rows, seconds.
  [[nodiscard]] constexpr double depth_time(double v, int height) const noexcept {
    return depth_delay + depth_read_out * share(v, height);
  }

  friend constexpr bool operator==(const shutter&, const shutter&) = default;

 private:
  [[nodiscard]] static constexpr double share(double v, int height) noexcept { return (v + 0.5) / height - 0.5; }
};

/// Maps a point from the camera frame at time `t` to the camera frame at time 0, if the camera moves with a constant
/// twist: `exp(t * twist) p` to second order; the remainder is below a thousandth of a pixel for the rotation during
/// one read-out (a few hundredths of a radian). `twist`: twist of the camera in its own frame, per second, translation
/// first. `p` represents the point `p / inverse_scale`, and the result has the same scale: to handle points at any
/// distance, pass a ray as `p` and the inverse depth as `inverse_scale`.
[[nodiscard]] inline vec3 moved_by(const vec6& twist, double t, const vec3& p, double inverse_scale = 1.0) {
  const vec3 w(t * twist[3], t * twist[4], t * twist[5]);
  const vec3 v(inverse_scale * (t * twist[0]), inverse_scale * (t * twist[1]), inverse_scale * (t * twist[2]));
  const vec3 a = cross(w, p) + v;
  return p + a + 0.5 * cross(w, a);
}

}  // namespace orbis::camera
