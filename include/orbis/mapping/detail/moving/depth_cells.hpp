// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A depth image divided into cells of 4x4 pixels, with tests of the points of one image against the rays of another.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/project_lanes.hpp>
#include <orbis/camera/world_point.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/types.hpp>

namespace orbis::mapping::detail {

/// The cells of a camera's images, and the rays through their centres.
struct cell_grid {
  static constexpr int edge = 4;  ///< edge of a cell, pixels

  int across = 0, down = 0;
  std::vector<vec2f> rays;  ///< x and y at z = 1; NaN where the camera has no ray

  template <camera::camera_model Camera>
  explicit cell_grid(const Camera& camera)
      : across{(camera.width() + edge - 1) / edge}, down{(camera.height() + edge - 1) / edge} {
    for (int y = 0; y != down; ++y)
      for (int x = 0; x != across; ++x) {
        const auto ray = camera.unproject(vec2{edge * x + 0.5 * (edge - 1), edge * y + 0.5 * (edge - 1)});
        rays.push_back(ray ? vec2f{ray->template head<2>().template cast<float>()}
                           : filled<vec2f>(std::numeric_limits<float>::quiet_NaN()));
      }
  }
  [[nodiscard]] std::size_t size() const noexcept { return rays.size(); }
};

/// Result of comparing a point with a view: rays of the view pass through it, the view shows it, or neither.
enum class visibility : std::uint8_t { nothing, through, shown };

/// Stores the nearest depth of each cell, which represents the cell, and for each cell corner the range of depths in
/// the four adjacent cells: a window of 8x8 pixels, so that a projection error of a pixel or two does not change the
/// range.
class depth_cells {
 public:
  [[nodiscard]] std::size_t size() const noexcept { return nearest_.size(); }
  /// The depth of a cell's nearest pixel, metres; 0 if it has none.
  [[nodiscard]] float depth(std::size_t cell) const noexcept { return nearest_[cell]; }

  /// Reads an image. O(pixels). @pre the image is from the grid's camera
  template <execution_policy Policy>
  void take(const Policy& policy, const camera::depth_view<std::uint16_t>& depth, const cell_grid& grid) {
    nearest_.resize(grid.size());
    farthest_.resize(grid.size());
    measured_.resize(grid.size());
    // Depth is monotonic in the stored value, so cells are computed from stored values.
    const double scale = depth.scale();
    const auto least =
        static_cast<std::uint16_t>(std::clamp(std::ceil(static_cast<double>(depth.min_depth()) * scale), 1.0, 65535.0));
    const auto most = static_cast<std::uint16_t>(
        std::clamp(std::floor(static_cast<double>(depth.max_depth()) * scale), 0.0, 65534.0));
    for_each_index(policy, static_cast<std::size_t>(grid.down), 8, [&](std::size_t row) {
      const int y0 = static_cast<int>(row) * cell_grid::edge;
      const int y1 = std::min(depth.height(), y0 + cell_grid::edge);
      for (int x = 0; x != grid.across; ++x) {
        std::uint16_t low = 65535, high = 0;
        int measured = 0;
        const int x0 = x * cell_grid::edge, x1 = std::min(depth.width(), x0 + cell_grid::edge);
        for (int v = y0; v < y1; ++v)
          for (int u = x0; u < x1; ++u) {
            const std::uint16_t stored = depth.pixels()(u, v);
            const bool valid = stored >= least && stored <= most;
            low = std::min(low, valid ? stored : std::uint16_t{65535});
            high = std::max(high, valid ? stored : std::uint16_t{0});
            measured += valid ? 1 : 0;
          }
        const std::size_t i = row * static_cast<std::size_t>(grid.across) + static_cast<std::size_t>(x);
        if (std::isnan(grid.rays[i].x())) measured = 0;
        measured_[i] = static_cast<std::uint8_t>(measured);
        nearest_[i] = measured == 0 ? 0.0F : static_cast<float>(static_cast<double>(low) / scale);
        farthest_[i] = measured == 0 ? 0.0F : static_cast<float>(static_cast<double>(high) / scale);
      }
    });
    windows_.resize(static_cast<std::size_t>(grid.across + 1) * static_cast<std::size_t>(grid.down + 1));
    for_each_index(policy, static_cast<std::size_t>(grid.down + 1), 8, [&](std::size_t row) {
      const int y = static_cast<int>(row);
      for (int x = 0; x <= grid.across; ++x) {
        int measured = 0;
        window w;
        for (int v = std::max(0, y - 1); v <= std::min(grid.down - 1, y); ++v)
          for (int u = std::max(0, x - 1); u <= std::min(grid.across - 1, x); ++u) {
            const auto i = static_cast<std::size_t>(v * grid.across + u);
            if (measured_[i] == 0) continue;
            w.nearest = measured == 0 ? nearest_[i] : std::min(w.nearest, nearest_[i]);
            w.farthest = std::max(w.farthest, farthest_[i]);
            measured += measured_[i];
          }
        const int inside =
            (std::min(depth.width(), (x + 1) * cell_grid::edge) - std::max(0, (x - 1) * cell_grid::edge)) *
            (std::min(depth.height(), (y + 1) * cell_grid::edge) - std::max(0, (y - 1) * cell_grid::edge));
        w.covered = 4 * measured >= 3 * inside;
        windows_[row * static_cast<std::size_t>(grid.across + 1) + static_cast<std::size_t>(x)] = w;
      }
    });
  }

  /// Calls `visit(cell, visibility)` for each cell that `view` shows or through which its rays pass. `margin(z)`:
  /// tolerance for noise at depth `z`, metres; `slant`: rays pass through a cell only if they end beyond it by more
  /// than the margin plus this factor times the range of depths in the window. O(cells).
  template <execution_policy Policy, camera::camera_model Camera, class Margin, class Visit>
  void ask(const Policy& policy, const depth_cells& view, const cell_grid& grid, const Camera& camera,
           const se3& T_view_this, float slant, const Margin& margin, const Visit& visit) const {
    const camera::float_pose pose{T_view_this};
    using projection = camera::projection_kernel<Camera>;
    const auto project = simd::kernel<projection, typename projection::signature>();
    for_each_index(policy, static_cast<std::size_t>(grid.down), 8, [&](std::size_t row) {
      constexpr std::size_t most = 64;
      std::array<float, most> x{}, y{}, z{};
      std::array<double, most> u{}, v{};
      const std::size_t end = (row + 1) * static_cast<std::size_t>(grid.across);
      for (std::size_t begin = row * static_cast<std::size_t>(grid.across), count = 0; begin != end; begin += count) {
        count = std::min(most, end - begin);
        for (std::size_t k = 0; k != count; ++k) {
          const vec2f& ray = grid.rays[begin + k];
          const auto p = camera::world_point(pose, ray.x(), ray.y(), nearest_[begin + k]);
          x[k] = p[0], y[k] = p[1], z[k] = p[2];
        }
        project(camera, {x.data(), y.data(), z.data()}, (count + 7) / 8 * 8, u.data(), v.data());
        for (std::size_t k = 0; k != count; ++k) {
          if (nearest_[begin + k] == 0.0F) continue;
          const window* const w = view.window_at(grid, static_cast<float>(u[k]), static_cast<float>(v[k]));
          if (w == nullptr) continue;
          const float m = margin(z[k]), before = w->nearest - m - z[k];
          if (before > 0.0F) {
            if (w->covered && before > rounded_product(slant, w->farthest - w->nearest))
              visit(begin + k, visibility::through);
          } else if (z[k] <= w->nearest + m || std::abs(z[k] - w->farthest) <= m ||
                     (z[k] < w->farthest && w->farthest - w->nearest <= 4.0F * m)) {
            visit(begin + k, visibility::shown);
          }
        }
      }
    });
  }

 private:
  struct window {
    float nearest = 0.0F, farthest = -1e9F;  // metres; the range is empty if there is no depth
    bool covered = false;                    // true if most of its pixels have a depth
  };

  /// Returns the window around a pixel; null if the pixel is outside the image or NaN.
  [[nodiscard]] const window* window_at(const cell_grid& grid, float u, float v) const {
    // Corner i is half a pixel before the centre of pixel i * edge.
    constexpr float per_pixel = 1.0F / cell_grid::edge, first = 0.5F + 0.5F / cell_grid::edge;
    const float x = rounded_product(u, per_pixel) + first, y = rounded_product(v, per_pixel) + first;
    if (!(x >= 0.0F && y >= 0.0F && x < static_cast<float>(grid.across + 1) && y < static_cast<float>(grid.down + 1)))
      return nullptr;
    return &windows_[static_cast<std::size_t>(static_cast<int>(y) * (grid.across + 1) + static_cast<int>(x))];
  }

  std::vector<float> nearest_, farthest_;
  std::vector<std::uint8_t> measured_;  ///< number of pixels with depth per cell
  std::vector<window> windows_;
};

}  // namespace orbis::mapping::detail
