// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Plausibility bounds of camera parameters from files and messages.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/result.hpp>

namespace orbis::camera {

/// Returns `k` if its values are plausible for a camera. All functions that read cameras call it to bound the work per
/// image: with a focal length near zero, each pixel would cover a whole room. If the image size is known, every pixel
/// must be at most 10 focal lengths from the principal point along each image axis (for a pinhole camera, up to 84
/// degrees from the optical axis; other models map this distance to other angles), and the focal lengths must be at
/// most 1000 times the larger side of the image. If the size is unknown (0), only the values are checked: both focal
/// lengths must be positive, below 1e9 and differ by at most a factor of 5; the coordinates of the principal point must
/// be below 1e9. Errors: malformed at `where`, naming the parameter and the reason.
[[nodiscard]] inline result<intrinsics> plausible(const intrinsics& k, std::string where) {
  constexpr double largest = 1e9, most_slope = 10.0, most_focal = 1000.0, most_ratio = 5.0;
  const auto reject = [&](const char* name, double value, const std::string& why) {
    char text[64];
    std::snprintf(text, sizeof text, "%s = %.6g ", name, value);
    return fail(errc::malformed, std::move(where), text + why);
  };
  if (k.width < 0 || k.height < 0) return reject("size", std::min(k.width, k.height), "is negative");
  for (const auto& [name, f] : {std::pair{"fx", k.fx}, std::pair{"fy", k.fy}})
    if (!(f > 0.0 && f < largest))
      return reject(name, f, "is not a focal length: focal lengths must be positive, in pixels");
  for (const auto& [name, c] : {std::pair{"cx", k.cx}, std::pair{"cy", k.cy}})
    if (!(std::abs(c) < largest)) return reject(name, c, "is not a coordinate of the principal point in pixels");
  if (k.fx > most_ratio * k.fy || k.fy > most_ratio * k.fx)
    return reject("fy", k.fy, "differs from fx by more than a factor of 5: are the focal lengths in pixels?");
  if (k.width == 0 || k.height == 0) return k;

  const std::string images = "images of " + std::to_string(k.width) + " x " + std::to_string(k.height) + " pixels";
  struct axis {
    const char *f_name, *c_name;
    double f, c, size;
  };
  for (const axis& a : {axis{"fx", "cx", k.fx, k.cx, static_cast<double>(k.width)},
                        axis{"fy", "cy", k.fy, k.cy, static_cast<double>(k.height)}}) {
    if (a.f > most_focal * std::max(k.width, k.height))
      return reject(a.f_name, a.f, "is too long a focal length for " + images + ": is it in pixels?");
    if (0.5 * a.size > most_slope * a.f)
      return reject(a.f_name, a.f, "is too short a focal length for " + images + ": is it in pixels?");
    if (std::max(a.c, a.size - a.c) > most_slope * a.f)
      return reject(a.c_name, a.c,
                    "is too far from the centre of " + images + " with " + a.f_name + " = " + std::to_string(a.f));
  }
  return k;
}

}  // namespace orbis::camera
