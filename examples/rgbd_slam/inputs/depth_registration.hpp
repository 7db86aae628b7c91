// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Registration of depth images to the colour camera, if depth and colour are from different cameras.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstdint>
#include <limits>

#include <orbis/camera/any.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace app {

/// Computes depth images as seen from the colour camera; colour images remain unchanged. Each depth pixel is treated as
/// a square that faces the depth camera and covers the colour pixels between the projections of its corners; the
/// nearest square occludes others. Squares are enlarged by a quarter of a colour pixel on each side, so that slanted
/// surfaces have no gaps.
class depth_registration {
 public:
  depth_registration(const orbis::camera::any_camera& depth, const orbis::camera::any_camera& color,
                     const orbis::se3& T_color_depth)
      : color_{color},
        t_color_depth_{T_color_depth.translation()},
        corners_{depth.width() + 1, depth.height() + 1, orbis::vec3::Zero()} {
    const orbis::mat3 R = T_color_depth.rotation_matrix();
    for (int y = 0; y != corners_.height(); ++y)
      for (int x = 0; x != corners_.width(); ++x) {
        const auto ray = depth.unproject(orbis::vec2{x - 0.5, y - 0.5});
        corners_(x, y) = ray ? orbis::vec3{R * *ray} : orbis::vec3::Constant(std::numeric_limits<double>::quiet_NaN());
      }
  }

  [[nodiscard]] int width() const noexcept { return corners_.width() - 1; }
  [[nodiscard]] int height() const noexcept { return corners_.height() - 1; }

  /// `scale`: stored depth per metre. O(pixels of both images). @pre `depth` has the size of the depth camera
  [[nodiscard]] orbis::image<std::uint16_t> operator()(orbis::image_view<const std::uint16_t> depth,
                                                       double scale) const {
    assert(depth.width() == width() && depth.height() == height());
    orbis::image<std::uint16_t> out(color_.width(), color_.height());
    color_.visit([&](const auto& color) {
      for (int y = 0; y != depth.height(); ++y)
        for (int x = 0; x != depth.width(); ++x)
          if (const std::uint16_t d = depth(x, y); d != 0 && d != 65535) cover(color, x, y, d / scale, scale, out);
    });
    return out;
  }

 private:
  template <class Camera>
  void cover(const Camera& color, int x, int y, double z, double scale, orbis::image<std::uint16_t>& out) const {
    const orbis::vec3 a = corners_(x, y) * z + t_color_depth_, b = corners_(x + 1, y + 1) * z + t_color_depth_;
    const auto p = color.project(a), q = color.project(b);
    if (!p || !q) return;
    constexpr double more = 0.25, most = 64.0;  // pixels; larger squares would be too near for depth cameras
    const double left = std::min(p->x(), q->x()) - more, right = std::max(p->x(), q->x()) + more;
    const double top = std::min(p->y(), q->y()) - more, bottom = std::max(p->y(), q->y()) + more;
    if (!(right - left < most && bottom - top < most && right >= 0.0 && bottom >= 0.0 && left < out.width() &&
          top < out.height()))
      return;
    const double stored = std::round(0.5 * (a.z() + b.z()) * scale);
    if (!(stored >= 1.0 && stored < 65535.0)) return;
    const auto value = static_cast<std::uint16_t>(stored);
    const int x1 = std::min(static_cast<int>(right), out.width() - 1);
    const int y1 = std::min(static_cast<int>(bottom), out.height() - 1);
    for (int v = std::max(static_cast<int>(std::ceil(top)), 0); v <= y1; ++v)
      for (int u = std::max(static_cast<int>(std::ceil(left)), 0); u <= x1; ++u)
        if (std::uint16_t& nearest = out(u, v); nearest == 0 || value < nearest) nearest = value;
  }

  orbis::camera::any_camera color_;
  orbis::vec3 t_color_depth_;
  orbis::image<orbis::vec3> corners_;  // rays through the corners of the depth pixels, in the axes of the colour camera
};

}  // namespace app
