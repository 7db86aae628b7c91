// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Matches between the pixels of two images, converted for two-view geometry: at z = 1 and in random order.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>

namespace orbis::optimize::detail {

/// The point (x, y) of a pixel at z = 1, and the derivative of the pixel with respect to that point. The derivative
/// converts distances at z = 1 to pixels; a rotation in the image plane has made it upper triangular.
struct metric_ray {
  double x = 0.0, y = 0.0;
  double xx = 1.0, xy = 0.0, yy = 1.0;
  [[nodiscard]] vec3 direction() const { return {x, y, 1.0}; }
  /// Multiplies all distances by `factor`, which changes their unit.
  void scale_metric(double factor) {
    xx *= factor;
    xy *= factor;
    yy *= factor;
  }
};

/// Computes the ray of a pixel; returns false if the camera cannot unproject it.
template <camera::camera_model Camera>
[[nodiscard]] bool read_ray(const Camera& camera, const vec2& pixel, metric_ray& out) {
  if (!all_finite(pixel)) return false;
  matrix<2, 3> j;
  const auto ray = camera.unproject(pixel);
  if (!ray || !camera.project(*ray, j)) return false;
  out.x = ray->x();
  out.y = ray->y();
  out.xx = std::hypot(j(0, 0), j(1, 0));
  out.xy = (j(0, 0) * j(0, 1) + j(1, 0) * j(1, 1)) / out.xx;
  out.yy = (j(0, 0) * j(1, 1) - j(1, 0) * j(0, 1)) / out.xx;
  return out.xx > 0.0 && std::isfinite(out.xy + out.yy) && out.yy != 0.0;
}

struct image_match {
  metric_ray first, second;
  std::uint32_t original = 0;
};

/// Returns the usable matches, in an order that depends only on the seed.
template <camera::camera_model Camera>
[[nodiscard]] std::vector<image_match> read_matches(std::span<const vec2> first, std::span<const vec2> second,
                                                    const Camera& camera, std::uint64_t seed) {
  std::vector<image_match> matches;
  matches.reserve(first.size());
  for (std::size_t i = 0; i != first.size(); ++i) {
    image_match m;
    m.original = static_cast<std::uint32_t>(i);
    if (read_ray(camera, first[i], m.first) && read_ray(camera, second[i], m.second)) matches.push_back(m);
  }
  random_bits random(mix64(seed));
  shuffle(matches, random);
  return matches;
}

}  // namespace orbis::optimize::detail
