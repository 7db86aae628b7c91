// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Exact colour and depth of a scene from a pose.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/intrinsics.hpp>
#include <orbis/core/image.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>
#include <orbis/io/detail/synthetic/sensor.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>
#include <orbis/io/detail/synthetic/texture.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// Renders one image of solids from a camera pose. Rows of tiles are rendered independently.
class renderer {
 public:
  static constexpr int tile = 16;  ///< edge, pixels

  /// `solids` must be the solids from which `textures` was made, in the same order; the first is the room.
  renderer(const std::vector<solid>& solids, const texture_set& textures, const camera_pose& pose,
           const camera::intrinsics& k)
      : textures_{&textures}, pose_{pose}, k_{k}, inverse_fx_{1.0 / k.fx}, inverse_fy_{1.0 / k.fy} {
    for (std::size_t i = 0; i != solids.size(); ++i) {
      const solid& s = solids[i];
      const triple b = s.bounds();
      const triple f = pose.forward;
      const double reach = std::abs(f.x) * b.x + std::abs(f.y) * b.y + std::abs(f.z) * b.z;
      const double middle = dot(f, s.centre - pose.position);
      if (i != 0 && middle + reach <= 0.0) continue;  // behind the camera
      seen_.push_back({s, i, s.to_local(pose.position), s.to_local_direction(pose.right),
                       s.to_local_direction(pose.down), s.to_local_direction(pose.forward), s.centre - pose.position, b,
                       i == 0 ? 0.0 : middle - reach});
    }
    std::sort(seen_.begin() + 1, seen_.end(), [](const candidate& a, const candidate& b) {
      return a.nearest != b.nearest ? a.nearest < b.nearest : a.index < b.index;
    });
  }

  [[nodiscard]] int tile_rows() const noexcept { return (k_.height + tile - 1) / tile; }

  /// Renders the pixels of one row of tiles into `out`, whose images have the camera's size. If its colour image is
  /// empty, skips the colours, which take a third of the time.
  void render_tile_row(int row, exact_view& out) const {
    render_rows(row * tile, std::min(row * tile + tile, k_.height), out);
  }

  /// Renders the rows [y0, y1) in the same way as `render_tile_row`.
  void render_rows(int y0, int y1, exact_view& out) const {
    std::vector<const candidate*> band, near;
    const double top = (y0 - 0.5 - k_.cy) / k_.fy, bottom = (y1 - 0.5 - k_.cy) / k_.fy;
    // The planes through the camera's centre that bound the band, pointing inward.
    const triple below_top = pose_.down - top * pose_.forward;
    const triple above_bottom = bottom * pose_.forward - pose_.down;
    for (std::size_t i = 1; i < seen_.size(); ++i)
      if (reaches(seen_[i], below_top) && reaches(seen_[i], above_bottom)) band.push_back(&seen_[i]);

    for (int x0 = 0; x0 < k_.width; x0 += tile) {
      const int x1 = std::min(x0 + tile, k_.width);
      const double left = (x0 - 0.5 - k_.cx) / k_.fx, right = (x1 - 0.5 - k_.cx) / k_.fx;
      const triple right_of_left = pose_.right - left * pose_.forward;
      const triple left_of_right = right * pose_.forward - pose_.right;
      near.clear();
      for (const candidate* c : band)
        if (reaches(*c, right_of_left) && reaches(*c, left_of_right)) near.push_back(c);
      for (int y = y0; y != y1; ++y)
        for (int x = x0; x != x1; ++x) render_pixel(x, y, near, out);
    }
  }

 private:
  struct candidate {
    solid body;
    std::size_t index;
    triple origin, right, down, forward;  // position and axes of the camera, in the solid's frame
    triple offset, bounds;                // the solid's bounding box, relative to the camera, along the world axes
    double nearest;                       // lower bound of the solid's depth
  };

  [[nodiscard]] static bool reaches(const candidate& c, triple inward) noexcept {
    const double reach =
        std::abs(inward.x) * c.bounds.x + std::abs(inward.y) * c.bounds.y + std::abs(inward.z) * c.bounds.z;
    return dot(inward, c.offset) + reach >= 0.0;
  }

  void render_pixel(int x, int y, const std::vector<const candidate*>& near, exact_view& out) const {
    const double a = (x - k_.cx) * inverse_fx_, b = (y - k_.cy) * inverse_fy_;
    const candidate* best = &seen_.front();
    triple direction = a * best->right + (b * best->down + best->forward);
    hit h = intersect(best->body, best->origin, direction);
    for (const candidate* c : near) {
      if (c->nearest >= h.t) break;
      const triple d = a * c->right + (b * c->down + c->forward);
      const hit other = intersect(c->body, c->origin, d);
      if (other.t < h.t) h = other, best = c, direction = d;
    }
    shade(x, y, *best, h, direction, length({a, b, 1.0}), out);
  }

  void shade(int x, int y, const candidate& c, hit h, triple direction, double range_per_depth, exact_view& out) const {
    const triple p = c.origin + h.t * direction;
    const triple half = c.body.half;
    double u = 0.0, v = 0.0, cosine = 0.0;
    int face = 0;
    if (c.body.kind == shape::sphere || c.body.kind == shape::capsule ||
        (c.body.kind == shape::cylinder && h.axis != 2)) {
      // Projects the point from the centre onto the surrounding cube.
      const double ax = std::abs(p.x), ay = std::abs(p.y);
      const double az = c.body.kind == shape::sphere ? std::abs(p.z) : 0.0;
      const int axis = az > ax && az > ay ? 2 : (ay > ax ? 1 : 0);
      const double scale = half.x / std::max(axis == 0 ? ax : (axis == 1 ? ay : az), 1e-12);
      u = (axis == 0 ? p.y : p.x) * scale + half.x;
      v = c.body.kind != shape::sphere ? p.z + half.z : (axis == 2 ? p.y : p.z) * scale + half.x;
      face = 2 * axis + ((axis == 0 ? p.x : (axis == 1 ? p.y : p.z)) > 0.0 ? 1 : 0);
      const triple normal = c.body.kind == shape::capsule ? c.body.from_axis(p)
                                                          : triple{p.x, p.y, c.body.kind == shape::sphere ? p.z : 0.0};
      cosine = std::abs(dot(normal, direction)) / (half.x * range_per_depth);
    } else {
      const double along = h.axis == 0 ? direction.x : (h.axis == 1 ? direction.y : direction.z);
      const bool positive = (along < 0.0) != (c.body.kind == shape::room);
      face = 2 * h.axis + (positive ? 1 : 0);
      u = h.axis == 0 ? p.y + half.y : p.x + half.x;
      v = h.axis == 2 ? p.y + half.y : p.z + half.z;
      cosine = std::abs(along) / range_per_depth;
    }
    out.depth(x, y) = static_cast<float>(h.t);
    out.cosine(x, y) = static_cast<float>(cosine);
    if (out.color.empty()) return;
    const double footprint = h.t * inverse_fx_ / std::max(cosine, 0.25);
    const std::uint32_t colour = textures_->sample(c.index, face, u, v, footprint);
    out.color(x, y) = {static_cast<std::uint8_t>(colour), static_cast<std::uint8_t>(colour >> 8U),
                       static_cast<std::uint8_t>(colour >> 16U)};
  }

  const texture_set* textures_;
  camera_pose pose_;
  camera::intrinsics k_;
  double inverse_fx_, inverse_fy_;
  std::vector<candidate> seen_;  // the room first, then the other solids by depth
};

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
