// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Image size and camera matrix, common to all camera models.
#pragma once

#include <cmath>

namespace orbis::camera {

/// Image size and camera matrix, in pixels; pixel centres at integers. The default is the normalised image plane.
struct intrinsics {
  int width = 0;
  int height = 0;
  double fx = 1.0;
  double fy = 1.0;
  double cx = 0.0;
  double cy = 0.0;

  friend bool operator==(const intrinsics&, const intrinsics&) = default;
};

/// Returns true if `k` is valid for a camera model: a non-negative size, positive focal lengths, no NaN or infinite
/// values.
[[nodiscard]] inline bool is_valid(const intrinsics& k) noexcept {
  return k.width >= 0 && k.height >= 0 && k.fx > 0.0 && k.fy > 0.0 && std::isfinite(k.fx) && std::isfinite(k.fy) &&
         std::isfinite(k.cx) && std::isfinite(k.cy);
}

}  // namespace orbis::camera
