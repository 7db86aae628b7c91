// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Registration of colour images to the depth camera, if colour and depth are from different cameras.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/io/detail/recordings/recording_index.hpp>

namespace orbis::io::detail {

/// Averages blocks of n x n pixels; drops leftover columns at the right and rows at the bottom. @pre n >= 1
template <class = void>
[[nodiscard]] image<rgb8> reduced(image_view<const rgb8> in, int n) {
  image<rgb8> out{in.width() / n, in.height() / n};
  const auto count = static_cast<unsigned>(n * n);
  for (int y = 0; y != out.height(); ++y)
    for (int x = 0; x != out.width(); ++x) {
      unsigned r = count / 2, g = count / 2, b = count / 2;
      for (int v = 0; v != n; ++v)
        for (int u = 0; u != n; ++u) {
          const rgb8& p = in(x * n + u, y * n + v);
          r += p.r, g += p.g, b += p.b;
        }
      out(x, y) = {static_cast<std::uint8_t>(r / count), static_cast<std::uint8_t>(g / count),
                   static_cast<std::uint8_t>(b / count)};
    }
  return out;
}

/// Assigns a colour to each pixel of a depth image. Colour is resampled to depth, not the reverse, so that the measured
/// depth remains unchanged: a depth image with more pixels would need interpolation and would have holes at the edges
/// of surfaces. If the positions of the two cameras differ, a pixel's depth determines its position in the colour
/// image; a pixel without depth is treated as far away. A colour image of higher resolution is first downsampled by
/// averaging.
class color_registration {
 public:
  color_registration(const color_camera& color, const camera::pinhole& depth)
      : color_{color},
        depth_{depth},
        shrink_{static_cast<int>(
            std::lround(std::clamp(color.model.k().fx / depth.k().fx, 1.0, max_reduction(color.model))))} {}

  /// Returns true if `register_color` needs the depth image: the two cameras are more than a tenth of a millimetre
  /// apart.
  [[nodiscard]] bool needs_depth() const noexcept { return norm(color_.T_color_depth.translation()) > 1e-4; }
  [[nodiscard]] const camera::pinhole& color() const noexcept { return color_.model; }

  /// The colour image as seen from the depth camera; black where there is no colour. `depth_scale`: stored depth per
  /// metre. `depth` may be empty unless `needs_depth`. O(pixels of both). @pre `color` has the size of the colour
  /// camera, and `depth` the size of the depth camera
  [[nodiscard]] image<rgb8> register_color(image_view<const rgb8> color, image_view<const std::uint16_t> depth,
                                           double depth_scale) const {
    assert(color.width() == color_.model.width() && color.height() == color_.model.height());
    assert(!needs_depth() || (depth.width() == depth_.width() && depth.height() == depth_.height()));
    const image<rgb8> small = shrink_ == 1 ? image<rgb8>{} : reduced(color, shrink_);
    const image_view<const rgb8> from = shrink_ == 1 ? color : small.view();
    image<rgb8> out{depth_.width(), depth_.height()};
    const mat3 R = color_.T_color_depth.rotation_matrix();
    for (int y = 0; y != out.height(); ++y)
      for (int x = 0; x != out.width(); ++x) {
        vec3 p = R * *depth_.unproject(vec2(x, y));
        if (needs_depth())
          if (const std::uint16_t d = depth(x, y); d != 0 && d != 65535)
            p = p * (d / depth_scale) + color_.T_color_depth.translation();
        if (const auto pixel = color_.model.project(p)) sample(from, *pixel, out(x, y));
      }
    return out;
  }

 private:
  /// Maximum reduction factor: at least one pixel must remain.
  [[nodiscard]] static double max_reduction(const camera::pinhole& color) {
    return std::max(1, std::min(color.width(), color.height()));
  }
  /// Samples bilinearly at `pixel`, which is given in the unreduced image.
  void sample(image_view<const rgb8> from, const vec2& pixel, rgb8& to) const {
    const vec2 at((pixel.x() + 0.5) / shrink_ - 0.5, (pixel.y() + 0.5) / shrink_ - 0.5);
    const double right = from.width() - 1, bottom = from.height() - 1;
    if (!(at.x() >= -0.5 && at.y() >= -0.5 && at.x() <= right + 0.5 && at.y() <= bottom + 0.5)) return;
    const double u = std::clamp(at.x(), 0.0, right), v = std::clamp(at.y(), 0.0, bottom);
    const int x0 = static_cast<int>(u), y0 = static_cast<int>(v);
    const int x1 = std::min(x0 + 1, from.width() - 1), y1 = std::min(y0 + 1, from.height() - 1);
    const double a = u - x0, b = v - y0;
    const auto mix = [&](std::uint8_t rgb8::*c) {
      const double top = from(x0, y0).*c * (1.0 - a) + from(x1, y0).*c * a;
      const double low = from(x0, y1).*c * (1.0 - a) + from(x1, y1).*c * a;
      return static_cast<std::uint8_t>(top * (1.0 - b) + low * b + 0.5);
    };
    to = {mix(&rgb8::r), mix(&rgb8::g), mix(&rgb8::b)};
  }

  color_camera color_;
  camera::pinhole depth_;
  int shrink_;
};

}  // namespace orbis::io::detail
