// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The surface measured by a depth image, as a coarse grid of small planes.
///
/// The inverse depth of a plane is a linear function of the ray `(x, y, 1)` through a pixel, and the noise of a
/// disparity sensor in inverse depth is constant: planes are therefore fitted to inverse depths by least squares.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/types.hpp>

namespace orbis::slam::detail {

/// A small plane in the camera frame.
struct surface_cell {
  float x = 0.0F, y = 0.0F, z = 0.0F;     ///< a point on it, metres; `z` is 0 if there is no plane
  float nx = 0.0F, ny = 0.0F, nz = 0.0F;  ///< unit normal, towards the camera
  float measured = 0.0F;                  ///< depth measured in this cell alone, without its neighbours, metres
  [[nodiscard]] bool is_there() const noexcept { return z > 0.0F; }
  [[nodiscard]] vec3 point() const { return {static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)}; }
  [[nodiscard]] vec3 normal() const {
    return {static_cast<double>(nx), static_cast<double>(ny), static_cast<double>(nz)};
  }
  /// Returns the point at the measured depth on the ray through `point()`.
  [[nodiscard]] vec3 measured_point() const { return static_cast<double>(measured / z) * point(); }
};

/// The cells of an image, row by row.
struct surface {
  int step = 8;  ///< side of a cell, pixels
  int columns = 0, rows = 0;
  std::vector<surface_cell> cells;

  [[nodiscard]] bool empty() const noexcept { return cells.empty(); }
  /// Returns the cell that contains a pixel; null outside the grid.
  [[nodiscard]] const surface_cell* at(const vec2& pixel) const noexcept {
    const double u = (pixel.x() + 0.5) / step, v = (pixel.y() + 0.5) / step;
    if (!(u >= 0.0 && v >= 0.0 && u < columns && v < rows)) return nullptr;
    return &cells[static_cast<std::size_t>(v) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(u)];
  }
  /// Returns the pixel row of the centre of a cell.
  [[nodiscard]] double pixel_row(std::size_t cell) const noexcept {
    return (static_cast<double>(cell / static_cast<std::size_t>(columns)) + 0.5) * step - 0.5;
  }
};

/// Builds surfaces from the depth images of one camera. Reuses its own memory and that of the surface.
template <camera::camera_model Camera>
class surface_builder {
 public:
  /// Builds the surface of a depth image. `noise`: the standard deviation of an inverse depth, 1/m. Depths outside
  /// [`min_depth`, `max_depth`] (metres) are not used. O(pixels). @pre the image has the size of the camera, and the
  /// camera is the same in all calls
  template <camera::depth_source Depth>
  void build(const Camera& camera, const Depth& depth, double noise, double min_depth, double max_depth, surface& to) {
    to.step = std::max(4, (depth.width() + 40) / 80);
    to.columns = depth.width() / to.step;
    to.rows = depth.height() / to.step;
    const auto cells = static_cast<std::size_t>(to.columns) * static_cast<std::size_t>(to.rows);
    if (rays_.size() != cells) find_rays(camera, to);
    samples_.resize(cells);
    to.cells.resize(cells);
    const sampling how{to.step, static_cast<float>(min_depth), static_cast<float>(max_depth),
                       static_cast<float>(4.0 * noise)};
    for (int row = 0; row != to.rows; ++row)
      for (int column = 0; column != to.columns; ++column) sample(depth, how, column, row, to.columns);
    for (int row = 0; row != to.rows; ++row)
      for (int column = 0; column != to.columns; ++column) fit(column, row, static_cast<float>(noise), to);
  }

 private:
  /// The mean of the depths in a cell.
  struct sampled {
    float x, y;     ///< ray through the mean pixel, at z = 1
    float inverse;  ///< inverse depth, 1/m; 0 if the cell has no depth
  };
  struct ray {
    float x, y;        ///< ray through the centre of the cell; NaN if there is none
    float by_u, by_v;  ///< change per pixel
  };
  struct sampling {
    int step;
    float min_depth, max_depth;
    float jump;  ///< maximum range of inverse depths in a cell due to noise alone, 1/m
  };

  void find_rays(const Camera& camera, const surface& to) {
    rays_.clear();
    constexpr float none = std::numeric_limits<float>::quiet_NaN();
    for (int row = 0; row != to.rows; ++row)
      for (int column = 0; column != to.columns; ++column) {
        const vec2 middle((column + 0.5) * to.step - 0.5, (row + 0.5) * to.step - 0.5);
        const auto r = camera.unproject(middle);
        rays_.push_back({r ? static_cast<float>(r->x()) : none, r ? static_cast<float>(r->y()) : none,
                         static_cast<float>(1.0 / camera.k().fx), static_cast<float>(1.0 / camera.k().fy)});
      }
  }

  template <class Depth>
  void sample(const Depth& depth, const sampling& how, int column, int row, int columns) {
    constexpr int across = 4, enough = 9;
    constexpr float steepest = 0.08F;  // relative change of depth within a cell
    const auto index =
        static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
    float sum = 0.0F, least = std::numeric_limits<float>::max(), most = 0.0F;
    int count = 0, sum_u = 0, sum_v = 0;
    for (int j = 0; j != across; ++j)
      for (int i = 0; i != across; ++i) {
        const int u = column * how.step + (2 * i + 1) * how.step / (2 * across);
        const int v = row * how.step + (2 * j + 1) * how.step / (2 * across);
        const float z = depth(u, v);
        if (!(z >= how.min_depth && z <= how.max_depth)) continue;
        const float inverse = 1.0F / z;
        sum += inverse;
        least = std::min(least, inverse);
        most = std::max(most, inverse);
        ++count;
        sum_u += u;
        sum_v += v;
      }
    sampled& s = samples_[index];
    s.inverse = 0.0F;
    if (count < enough || most - least > steepest * least + how.jump) return;
    const ray& r = rays_[index];
    const float n = static_cast<float>(count), step = static_cast<float>(how.step);
    const float du = static_cast<float>(sum_u) / n - (static_cast<float>(column) + 0.5F) * step + 0.5F;
    const float dv = static_cast<float>(sum_v) / n - (static_cast<float>(row) + 0.5F) * step + 0.5F;
    s = {r.x + du * r.by_u, r.y + dv * r.by_v, std::isnan(r.x) ? 0.0F : sum / n};
  }

  /// Fits a plane to a cell and the surrounding cells on the same surface.
  void fit(int column, int row, float noise, surface& to) const {
    constexpr int radius = 2, enough = 12;
    constexpr float steepest = 0.05F;  // relative change of depth from cell to cell
    const auto at = [&](int c, int r) -> const sampled& {
      return samples_[static_cast<std::size_t>(r) * static_cast<std::size_t>(to.columns) + static_cast<std::size_t>(c)];
    };
    surface_cell& cell = to.cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(to.columns) +
                                  static_cast<std::size_t>(column)];
    cell = {};
    const sampled& middle = at(column, row);
    if (!(middle.inverse > 0.0F)) return;
    float n = 0.0F, sx = 0.0F, sy = 0.0F, sw = 0.0F, sxx = 0.0F, sxy = 0.0F, syy = 0.0F, sxw = 0.0F, syw = 0.0F,
          sww = 0.0F;
    for (int r = std::max(0, row - radius); r <= std::min(to.rows - 1, row + radius); ++r)
      for (int c = std::max(0, column - radius); c <= std::min(to.columns - 1, column + radius); ++c) {
        const sampled& s = at(c, r);
        const float away = static_cast<float>(std::max(std::abs(r - row), std::abs(c - column)));
        const float w = s.inverse - middle.inverse;
        if (!(s.inverse > 0.0F) || std::abs(w) > away * steepest * middle.inverse + 2.0F * noise) continue;
        const float x = s.x - middle.x, y = s.y - middle.y;
        n += 1.0F;
        sx += x, sy += y, sw += w;
        sxx += x * x, sxy += x * y, syy += y * y;
        sxw += x * w, syw += y * w, sww += w * w;
      }
    if (n < static_cast<float>(enough)) return;
    sxx -= sx * sx / n, sxy -= sx * sy / n, syy -= sy * sy / n;
    sxw -= sx * sw / n, syw -= sy * sw / n, sww -= sw * sw / n;
    const float det = sxx * syy - sxy * sxy;
    if (!(det > 0.05F * sxx * syy)) return;
    const float a = (syy * sxw - sxy * syw) / det, b = (sxx * syw - sxy * sxw) / det;
    const float rest = std::max(0.0F, sww - a * sxw - b * syw) / n;
    const float most = 0.5F * noise + 0.006F * middle.inverse;
    const float inverse = middle.inverse + (sw - a * sx - b * sy) / n;
    if (rest > most * most || !(inverse > 0.0F)) return;
    // The plane consists of all points p with (a, b, c) . p = 1.
    const float c = inverse - a * middle.x - b * middle.y;
    const float length = std::sqrt(a * a + b * b + c * c);
    const float slant = inverse / (length * std::sqrt(middle.x * middle.x + middle.y * middle.y + 1.0F));
    constexpr float grazing = 0.17F;  // cosine of the angle between ray and normal
    if (slant < grazing) return;
    const float z = 1.0F / inverse;
    cell = {middle.x * z, middle.y * z, z, -a / length, -b / length, -c / length, 1.0F / middle.inverse};
  }

  std::vector<ray> rays_;
  std::vector<sampled> samples_;
};

}  // namespace orbis::slam::detail
