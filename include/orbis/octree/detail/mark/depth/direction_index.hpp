// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Index from regions of directions to the pixels that see them, for any camera model. It is computed only from the
/// rays of the pixels, without the camera's projection function.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/octree/depth_points.hpp>

namespace orbis::octree::detail {

/// The plane z = 1 divided into cells of about 8x8 pixels. For its rays, a cell stores the range of the differences
/// between their pixels and the affine estimate `focal * (x, y) + center`, and the spacing of the rays. Cells are
/// combined into larger ones: entry (i, j) of level k represents the cells i, i + 1 of the rows j, j + 1 of 2^k x 2^k
/// cells each, so that one entry covers any region that is at most one cell of its level wide.
template <class = void>
class basic_direction_index {
 public:
  static constexpr int max_levels = 16;
  /// Rays further than this from the optical axis, in x or y at z = 1, are excluded.
  static constexpr float widest = 3.0F;

  struct entry {
    float least_u = infinity, most_u = -infinity;  ///< range of pixel u minus its affine estimate
    float least_v = infinity, most_v = -infinity;
    /// Maximum distance (at z = 1) from a point in the cells to the nearest ray; infinite if unknown.
    float spacing = 0.0F;
    std::array<float, 3> unused{};

    void join(const entry& o) noexcept {
      least_u = std::min(least_u, o.least_u);
      most_u = std::max(most_u, o.most_u);
      least_v = std::min(least_v, o.least_v);
      most_v = std::max(most_v, o.most_v);
      spacing = std::max(spacing, o.spacing);
    }
  };
  static_assert(sizeof(entry) == 8 * sizeof(float));

  /// Bounds of the rays of a tile of pixels.
  struct tile {
    float x0 = infinity, x1 = -infinity, y0 = infinity, y1 = -infinity;

    void join(const tile& o) noexcept {
      x0 = std::min(x0, o.x0);
      x1 = std::max(x1, o.x1);
      y0 = std::min(y0, o.y0);
      y1 = std::max(y1, o.y1);
    }
  };

  /// Builds the index; does nothing if it already holds these rays. O(pixels).
  void fit(const pixel_rays& rays) {
    if (version_ == rays.version()) return;
    version_ = rays.version();
    outer_.clear();
    find_affine(rays);
    const auto cells = [](int pixels) { return std::max(1, (pixels + 7) / 8); };
    width_[0] = cells(rays.width());
    height_[0] = cells(rays.height());
    per_x_ = static_cast<float>(width_[0]) / std::max(max_x_ - min_x_, 1e-6F);
    per_y_ = static_cast<float>(height_[0]) / std::max(max_y_ - min_y_, 1e-6F);
    fill_cells(rays);
    join_cells();
    fill_tiles(rays);
  }

  [[nodiscard]] float min_x() const noexcept { return min_x_; }
  [[nodiscard]] float max_x() const noexcept { return max_x_; }
  [[nodiscard]] float min_y() const noexcept { return min_y_; }
  [[nodiscard]] float max_y() const noexcept { return max_y_; }
  [[nodiscard]] const vec2f& focal() const noexcept { return focal_; }
  [[nodiscard]] const vec2f& center() const noexcept { return center_; }
  /// Pixels whose rays are excluded.
  [[nodiscard]] const std::vector<std::array<std::int32_t, 2>>& outer() const noexcept { return outer_; }

  /// Bounds of the rays of the aligned tile of `size` x `size` pixels at (u, v). @pre size is 16, 32, 64 or 128
  [[nodiscard]] const tile& tile_at(std::int32_t u, std::int32_t v, std::int32_t size) const noexcept {
    const auto k = static_cast<std::size_t>(std::countr_zero(static_cast<std::uint32_t>(size)));
    return tiles_[k - 4][static_cast<std::size_t>((v >> k) * tile_columns(k) + (u >> k))];
  }

  /// Number of cells per unit of x and of y.
  [[nodiscard]] float per_x() const noexcept { return per_x_; }
  [[nodiscard]] float per_y() const noexcept { return per_y_; }
  [[nodiscard]] int levels() const noexcept { return levels_; }
  [[nodiscard]] const std::array<std::int32_t, max_levels>& begin() const noexcept { return begin_; }
  [[nodiscard]] const std::array<std::int32_t, max_levels>& width() const noexcept { return width_; }
  [[nodiscard]] const std::array<std::int32_t, max_levels>& height() const noexcept { return height_; }
  [[nodiscard]] const entry* entries() const noexcept { return entries_.data(); }
  /// Cell that contains a coordinate; never decreases as the coordinate increases.
  [[nodiscard]] std::int32_t column(float x) const noexcept { return cell((x - min_x_) * per_x_, width_[0]); }
  [[nodiscard]] std::int32_t row(float y) const noexcept { return cell((y - min_y_) * per_y_, height_[0]); }
  /// Entry for the rays with x in [x0, x1] and y in [y0, y1].
  [[nodiscard]] const entry& at(float x0, float x1, float y0, float y1) const noexcept {
    const std::int32_t i0 = column(x0), i1 = column(x1), j0 = row(y0), j1 = row(y1);
    int level = 0;
    while (level != levels_ && 1 << level < std::max(i1 - i0, j1 - j0)) ++level;
    const auto k = static_cast<std::size_t>(level);
    return entries_[static_cast<std::size_t>(begin_[k] + (j0 >> level) * width_[k] + (i0 >> level))];
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = cells_.capacity() * sizeof(entry);
    for (const auto& level : tiles_) bytes += level.capacity() * sizeof(tile);
    return bytes + entries_.capacity() * sizeof(entry) + outer_.capacity() * sizeof(outer_[0]);
  }

 private:
  static constexpr float infinity = std::numeric_limits<float>::infinity();

  [[nodiscard]] static bool is_inner(const std::pair<float, float>& ray) noexcept {
    return std::fabs(ray.first) <= widest && std::fabs(ray.second) <= widest;
  }
  [[nodiscard]] static std::int32_t cell(float at, std::int32_t count) noexcept {
    return static_cast<std::int32_t>(std::clamp(at, 0.0F, static_cast<float>(count - 1)));
  }

  /// Computes the bounds of the rays, and linear fits of pixel coordinates to ray coordinates.
  void find_affine(const pixel_rays& rays) {
    min_x_ = min_y_ = infinity;
    max_x_ = max_y_ = -infinity;
    double n = 0.0;
    std::array<double, 4> sum_u{}, sum_v{};  // sums of ray, pixel, ray^2, ray * pixel
    const auto add = [](std::array<double, 4>& s, double ray, double pixel) {
      s[0] += ray;
      s[1] += pixel;
      s[2] += ray * ray;
      s[3] += ray * pixel;
    };
    for (int v = 0; v != rays.height(); ++v)
      for (int u = 0; u != rays.width(); ++u) {
        const auto ray = rays.at(u, v);
        if (!is_inner(ray)) {
          if (!std::isnan(ray.first)) outer_.push_back({u, v});
          continue;
        }
        min_x_ = std::min(min_x_, ray.first);
        max_x_ = std::max(max_x_, ray.first);
        min_y_ = std::min(min_y_, ray.second);
        max_y_ = std::max(max_y_, ray.second);
        n += 1.0;
        add(sum_u, static_cast<double>(ray.first), u);
        add(sum_v, static_cast<double>(ray.second), v);
      }
    if (!(min_x_ <= max_x_)) min_x_ = max_x_ = min_y_ = max_y_ = 0.0F;
    const auto line = [&](const std::array<double, 4>& s, int axis) {
      const double spread = n * s[2] - s[0] * s[0];
      const double slope = spread > 1e-9 * n * n ? (n * s[3] - s[0] * s[1]) / spread : 1.0;
      focal_[axis] = static_cast<float>(slope > 1e-3 ? slope : 1.0);
      center_[axis] = n > 0.0 ? static_cast<float>((s[1] - static_cast<double>(focal_[axis]) * s[0]) / n) : 0.0F;
    };
    line(sum_u, 0);
    line(sum_v, 1);
  }

  void fill_cells(const pixel_rays& rays) {
    cells_.assign(static_cast<std::size_t>(width_[0]) * static_cast<std::size_t>(height_[0]), entry{});
    struct box {
      int u0 = std::numeric_limits<int>::max(), u1 = -1, v0 = std::numeric_limits<int>::max(), v1 = -1;
    };
    std::vector<box> boxes(cells_.size());
    for (int v = 0; v != rays.height(); ++v)
      for (int u = 0; u != rays.width(); ++u) {
        const auto ray = rays.at(u, v);
        if (!is_inner(ray)) continue;
        const auto i = static_cast<std::size_t>(row(ray.second) * width_[0] + column(ray.first));
        const float du = static_cast<float>(u) - (focal_.x() * ray.first + center_.x());
        const float dv = static_cast<float>(v) - (focal_.y() * ray.second + center_.y());
        cells_[i].join({du, du, dv, dv, 0.0F, {}});
        box& b = boxes[i];
        b = {std::min(b.u0, u), std::max(b.u1, u), std::min(b.v0, v), std::max(b.v1, v)};
      }
    for (int j = 0; j != height_[0]; ++j)
      for (int i = 0; i != width_[0]; ++i) {
        const auto k = static_cast<std::size_t>(j * width_[0] + i);
        const box& b = boxes[k];
        cells_[k].spacing = b.u1 < 0 ? infinity : max_spacing(rays, i, j, b.u0, b.u1, b.v0, b.v1);
      }
  }
  /// Maximum distance from a point in cell (i, j) to the nearest ray. All rays of the cell are in the given box of
  /// pixels.
  ///
  /// If the rays of the left column of a rectangle of pixels are to the left of the cell, those of the right column to
  /// the right, and likewise above and below, the border of the rectangle encloses every point of the cell. Each point
  /// is therefore in one of the triangles between neighbouring rays, and no point of a triangle is farther from its
  /// nearest corner than the longest edge divided by the square root of three.
  [[nodiscard]] float max_spacing(const pixel_rays& rays, int i, int j, int u0, int u1, int v0, int v1) const {
    const float x0 = min_x_ + static_cast<float>(i) / per_x_, x1 = min_x_ + static_cast<float>(i + 1) / per_x_;
    const float y0 = min_y_ + static_cast<float>(j) / per_y_, y1 = min_y_ + static_cast<float>(j + 1) / per_y_;
    const float room_x = 0.001F / per_x_, room_y = 0.001F / per_y_;
    for (const int grow : {1, 2, 4, 8}) {
      const int a = u0 - grow, b = u1 + grow, c = v0 - grow, d = v1 + grow;
      if (a < 0 || c < 0 || b >= rays.width() || d >= rays.height()) return infinity;
      bool around = true;
      for (int v = c; v <= d && around; ++v)
        around = rays.at(a, v).first < x0 - room_x && rays.at(b, v).first > x1 + room_x;
      for (int u = a; u <= b && around; ++u)
        around = rays.at(u, c).second < y0 - room_y && rays.at(u, d).second > y1 + room_y;
      if (!around) continue;
      // Tiles of 4x4 that begin here may extend 4 pixels further.
      const auto inside = [](int p, int size) { return std::clamp(p, 0, size - 2); };
      float longest = 0.0F;
      for (int v = inside(c - 4, rays.height()); v <= inside(d + 3, rays.height()); ++v)
        for (int u = inside(a - 4, rays.width()); u <= inside(b + 3, rays.width()); ++u) {
          const auto p = rays.at(u, v), q = rays.at(u + 1, v), r = rays.at(u, v + 1), s = rays.at(u + 1, v + 1);
          const auto square = [](const auto& m, const auto& n) {
            const float x = m.first - n.first, y = m.second - n.second;
            return x * x + y * y;
          };
          for (const float edge :
               {square(p, q), square(p, r), square(p, s), square(q, r), square(q, s), square(r, s)}) {
            if (!(edge < 1.0F)) return infinity;  // NaN: a pixel without a ray
            longest = std::max(longest, edge);
          }
        }
      return 0.58F * std::sqrt(longest);
    }
    return infinity;
  }

  [[nodiscard]] std::int32_t tile_columns(std::size_t k) const noexcept { return (pixels_[0] + (1 << k) - 1) >> k; }
  void fill_tiles(const pixel_rays& rays) {
    pixels_ = {rays.width(), rays.height()};
    for (std::size_t k = 4; k != 8; ++k) {
      const std::int32_t columns = tile_columns(k), rows = (pixels_[1] + (1 << k) - 1) >> k;
      auto& level = tiles_[k - 4];
      level.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), tile{});
      for (std::int32_t v = 0; v != pixels_[1]; ++v)
        for (std::int32_t u = 0; u != pixels_[0]; ++u) {
          const auto ray = rays.at(u, v);
          if (is_inner(ray))
            level[static_cast<std::size_t>((v >> k) * columns + (u >> k))].join(
                {ray.first, ray.first, ray.second, ray.second});
        }
    }
  }
  void join_cells() {
    entries_.clear();
    for (levels_ = 0;; ++levels_) {
      const auto k = static_cast<std::size_t>(levels_);
      const int w = width_[k], h = height_[k];
      begin_[k] = static_cast<std::int32_t>(entries_.size());
      const auto at = [&](int i, int j) {
        return cells_[static_cast<std::size_t>(std::min(j, h - 1) * w + std::min(i, w - 1))];
      };
      for (int j = 0; j != h; ++j)
        for (int i = 0; i != w; ++i) {
          entry e = at(i, j);
          e.join(at(i + 1, j));
          e.join(at(i, j + 1));
          e.join(at(i + 1, j + 1));
          entries_.push_back(e);
        }
      if (std::max(w, h) <= 2 || levels_ + 2 >= max_levels) break;
      width_[k + 1] = (w + 1) / 2;
      height_[k + 1] = (h + 1) / 2;
      std::vector<entry> above;
      for (int j = 0; j < h; j += 2)
        for (int i = 0; i < w; i += 2) above.push_back(entries_[static_cast<std::size_t>(begin_[k] + j * w + i)]);
      cells_.swap(above);
    }
  }

  unsigned version_ = 0;
  float min_x_ = 0, max_x_ = 0, min_y_ = 0, max_y_ = 0, per_x_ = 1, per_y_ = 1;
  vec2f focal_ = filled<vec2f>(1), center_ = zeros<vec2f>();
  std::vector<std::array<std::int32_t, 2>> outer_;
  std::vector<entry> cells_, entries_;
  std::array<std::vector<tile>, 4> tiles_;
  std::array<std::int32_t, 2> pixels_{};
  std::array<std::int32_t, max_levels> begin_{}, width_{}, height_{};
  int levels_ = 0;
};
using direction_index = basic_direction_index<>;

}  // namespace orbis::octree::detail
