// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The surface measured by a depth image, as a coarse grid of small planes.
///
/// The inverse depth of a plane is a linear function of the ray `(x, y, 1)` through a pixel, and the noise of a
/// disparity sensor in inverse depth is constant: planes are therefore fitted to inverse depths by least squares.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
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

/// The mean depth of each cell of an image, with a border of empty cells.
struct cell_depths {
  static constexpr int border = 2;  ///< width of the border, cells; on the right, wider: rows are read in blocks of 8
  std::size_t stride = 0;           ///< number of cells in a row, including the border
  std::vector<float> x, y;          ///< ray through the mean pixel, at z = 1
  std::vector<float> inverse;       ///< inverse depth, 1/m; 0 if the cell has no depth

  /// Sets the size of the image, in cells. All cells are empty.
  void resize(int columns, int rows) {
    constexpr std::size_t lanes = 8;
    stride = (static_cast<std::size_t>(columns) + lanes - 1) / lanes * lanes + 2 * border;
    const std::size_t cells = stride * (static_cast<std::size_t>(rows) + 2 * border);
    for (auto* const v : {&x, &y, &inverse}) v->assign(cells, 0.0F);
  }
  [[nodiscard]] std::size_t index(int column, int row) const noexcept {
    return (static_cast<std::size_t>(row) + border) * stride + static_cast<std::size_t>(column) + border;
  }
};

/// Fits a plane to each cell of a row and the surrounding cells on the same surface.
/// @pre the row is inside the size of `of`, which has `columns` columns, as many as `to` has cells
struct fit_row_kernel {
  using signature = void(const cell_depths&, int row, int columns, float noise, surface_cell* to);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const cell_depths& of, int row, int columns, float noise, surface_cell* to) {
    using lanes = simd::vec<float, 8, Target>;
    constexpr int radius = cell_depths::border;
    constexpr float enough = 12.0F;    // cells
    constexpr float steepest = 0.05F;  // relative change of depth from cell to cell
    constexpr float grazing = 0.17F;   // cosine of the angle between ray and normal
    const lanes none(0.0F), one(1.0F);
    for (int column = 0; column < columns; column += 8) {
      const std::size_t middle = of.index(column, row);
      const lanes mx = lanes::load(&of.x[middle]), my = lanes::load(&of.y[middle]);
      const lanes mw = lanes::load(&of.inverse[middle]);
      lanes n = none, sx = none, sy = none, sw = none;
      lanes sxx = none, sxy = none, syy = none, sxw = none, syw = none, sww = none;
      for (int r = -radius; r <= radius; ++r)
        for (int c = -radius; c <= radius; ++c) {
          const std::size_t at = of.index(column + c, row + r);
          const lanes inverse = lanes::load(&of.inverse[at]);
          const lanes away(static_cast<float>(std::max(std::abs(r), std::abs(c))) * steepest);
          const lanes apart = inverse - mw;
          const auto used = (none < inverse) & (abs(apart) <= away * mw + lanes(2.0F * noise));
          const auto kept = [&](const lanes& v) ORBIS_INLINE_LAMBDA { return select(used, v, none); };
          const lanes x = kept(lanes::load(&of.x[at]) - mx), y = kept(lanes::load(&of.y[at]) - my), w = kept(apart);
          n += kept(one);
          sx += x, sy += y, sw += w;
          sxx += x * x, sxy += x * y, syy += y * y;
          sxw += x * w, syw += y * w, sww += w * w;
        }
      const lanes count = max(n, one);
      sxx -= sx * sx / count, sxy -= sx * sy / count, syy -= sy * sy / count;
      sxw -= sx * sw / count, syw -= sy * sw / count, sww -= sw * sw / count;
      const lanes det = sxx * syy - sxy * sxy;
      const lanes a = (syy * sxw - sxy * syw) / det, b = (sxx * syw - sxy * sxw) / det;
      const lanes rest = max(none, sww - a * sxw - b * syw) / count;
      const lanes most = lanes(0.5F * noise) + lanes(0.006F) * mw;
      const lanes inverse = mw + (sw - a * sx - b * sy) / count;
      // The plane consists of all points p with (a, b, c) . p = 1.
      const lanes c = inverse - a * mx - b * my;
      const lanes length = sqrt(a * a + b * b + c * c);
      const lanes slant = inverse / (length * sqrt(mx * mx + my * my + one));
      const auto fits = (none < mw) & (lanes(enough) <= n) & (lanes(0.05F) * sxx * syy < det) & (rest <= most * most) &
                        (none < inverse) & (lanes(grazing) <= slant);
      const lanes z = select(fits, one / inverse, none);
      std::array<std::array<float, 8>, 7> out;
      std::size_t next = 0;
      for (const lanes& v : {mx * z, my * z, z, -(a / length), -(b / length), -(c / length), one / mw})
        v.store(out[next++].data());
      const auto last = static_cast<std::size_t>(std::min(8, columns - column));
      for (std::size_t i = 0; i != last; ++i)
        to[static_cast<std::size_t>(column) + i] =
            out[2][i] > 0.0F ? surface_cell{out[0][i], out[1][i], out[2][i], out[3][i], out[4][i], out[5][i], out[6][i]}
                             : surface_cell{};
    }
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
    if (rays_.size() != cells) {
      find_rays(camera, to);
      depths_.resize(to.columns, to.rows);
    }
    to.cells.resize(cells);
    const sampling how{to.step, static_cast<float>(min_depth), static_cast<float>(max_depth),
                       static_cast<float>(4.0 * noise)};
    for (int row = 0; row != to.rows; ++row)
      for (int column = 0; column != to.columns; ++column) sample(depth, how, column, row, to.columns);
    const auto fit_row = simd::kernel<fit_row_kernel, fit_row_kernel::signature>();
    for (int row = 0; row != to.rows; ++row)
      fit_row(depths_, row, to.columns, static_cast<float>(noise),
              to.cells.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(to.columns));
  }

 private:
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
        if (!r) {
          rays_.push_back({none, none, none, none});
          continue;
        }
        // The change per pixel along one axis; at the edge of a lens, one of the neighbours has no ray.
        const auto change = [&](int axis, const vec2& half) {
          const auto before = camera.unproject(middle - half), after = camera.unproject(middle + half);
          const double pixels = 0.5 * (before.has_value() + after.has_value());
          if (pixels == 0.0) return 0.0F;
          return static_cast<float>((after.value_or(*r)[axis] - before.value_or(*r)[axis]) / pixels);
        };
        rays_.push_back({static_cast<float>(r->x()), static_cast<float>(r->y()), change(0, vec2(0.5, 0.0)),
                         change(1, vec2(0.0, 0.5))});
      }
  }

  template <class Depth>
  void sample(const Depth& depth, const sampling& how, int column, int row, int columns) {
    constexpr int across = 4, enough = 9;
    constexpr float steepest = 0.08F;  // relative change of depth within a cell
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
    const std::size_t cell = depths_.index(column, row);
    depths_.inverse[cell] = 0.0F;
    if (count < enough || most - least > steepest * least + how.jump) return;
    const ray& r =
        rays_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column)];
    if (std::isnan(r.x)) return;
    const float n = static_cast<float>(count), step = static_cast<float>(how.step);
    const float du = static_cast<float>(sum_u) / n - (static_cast<float>(column) + 0.5F) * step + 0.5F;
    const float dv = static_cast<float>(sum_v) / n - (static_cast<float>(row) + 0.5F) * step + 0.5F;
    depths_.x[cell] = r.x + du * r.by_u;
    depths_.y[cell] = r.y + dv * r.by_v;
    depths_.inverse[cell] = sum / n;
  }

  std::vector<ray> rays_;
  cell_depths depths_;
};

}  // namespace orbis::slam::detail
