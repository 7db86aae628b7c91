// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Correspondence between the pixels of a rolling-shutter image and a global-shutter image.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera::detail {

/// The time at which a row is read, relative to the frame's time, seconds; a linear function of the row's index.
struct row_time {
  double first = 0.0, per_row = 0.0;

  [[nodiscard]] static row_time of_depth(const shutter& s, int height) {
    return between(s.depth_time(0.0, height), s.depth_time(1.0, height));
  }
  [[nodiscard]] static row_time of_color(const shutter& s, int height) {
    return between(s.color_time(0.0, height), s.color_time(1.0, height));
  }
  [[nodiscard]] double operator()(double v) const noexcept { return first + per_row * v; }
  /// The largest absolute time of any row.
  [[nodiscard]] double largest(int height) const noexcept {
    return std::max(std::abs((*this)(-0.5)), std::abs((*this)(height - 0.5)));
  }
  /// True if all rows are read at the frame's time.
  [[nodiscard]] bool is_zero() const noexcept { return first == 0.0 && per_row == 0.0; }

 private:
  [[nodiscard]] static row_time between(double first, double second) noexcept { return {first, second - first}; }
};

/// The pixel that observes a point at another time, and the ratio of the point's depth at that pixel to its depth at
/// the original pixel.
struct warped_pixel {
  double x = 0.0, y = 0.0, ratio = 0.0;
};

/// Computes the pixel that observes, at the frame's time, the point that a pixel in row `y` observes at the given
/// inverse depth. `ray`: the ray through the original pixel, at z = 1.
template <camera_model Camera>
[[nodiscard]] std::optional<warped_pixel> warp_to_frame(const Camera& camera, const row_time& time, const vec6& twist,
                                                        const vec3& ray, double y, double inverse_depth) {
  const vec3 p = moved_by(twist, time(y), ray, inverse_depth);
  const auto pixel = p.z() > 0.0 ? camera.project(p) : std::nullopt;
  if (!pixel) return std::nullopt;
  return warped_pixel{pixel->x(), pixel->y(), p.z()};
}

/// Computes the rolling-shutter pixel that observes the point that a pixel in row `y` observes at the frame's time. Its
/// row, and hence its time, is found by iteration; empty if the motion is too fast for convergence. `ray`: the ray
/// through the pixel in row `y`.
template <camera_model Camera>
[[nodiscard]] std::optional<warped_pixel> warp_to_row(const Camera& camera, const row_time& time, const vec6& twist,
                                                      const vec3& ray, double y, double inverse_depth) {
  constexpr int rounds = 12;
  constexpr double settled = 1e-3;  // pixels
  double row = y;
  for (int round = 0; round != rounds; ++round) {
    const vec3 p = moved_by(twist, -time(row), ray, inverse_depth);
    const auto pixel = p.z() > 0.0 ? camera.project(p) : std::nullopt;
    if (!pixel) return std::nullopt;
    const double change = pixel->y() - row;
    row = pixel->y();
    if (std::abs(change) < settled) return warped_pixel{pixel->x(), row, p.z()};
  }
  return std::nullopt;
}

enum class warp_direction { to_frame, to_row };

/// Spacing of the nodes of a `row_warp` in pixels; also the number of pixels that are evaluated together.
inline constexpr int warp_cell = 16;
/// Coefficients of three parabolas in inverse depth: the displacement in x, the displacement in y, the depth ratio.
using warp_parabolas = std::array<float, 9>;

/// Warped positions of a row of pixels; NaN where undefined. All lengths are multiples of `warp_cell`.
struct warped_row {
  std::vector<float> x, y, ratio;
  explicit warped_row(std::size_t size) : x(size), y(size), ratio(size) {}
};

/// Evaluates the parabolas of a row, interpolated between its nodes. Returns true if any inverse depth is larger than
/// `most`.
struct warp_row_kernel {
  struct arguments {
    const warp_parabolas* nodes;
    std::size_t cells;
    float row, most;
    const float* inverse_depth;
    float *x, *y, *ratio;
  };
  using signature = bool(const arguments&);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE bool run(const arguments& a) {
    using lanes = simd::vec<float, warp_cell, Target>;
    const lanes u = lanes::iota();
    lanes largest = 0.0F;
    for (std::size_t i = 0; i != a.cells; ++i) {
      const std::size_t at = i * warp_cell;
      const warp_parabolas &left = a.nodes[i], &right = a.nodes[i + 1];
      const lanes r = lanes::load(a.inverse_depth + at);
      largest = max(largest, r);
      const auto term = [&](std::size_t k) ORBIS_INLINE_LAMBDA {
        return lanes(left[k]) + u * lanes((right[k] - left[k]) * (1.0F / warp_cell));
      };
      const auto value = [&](std::size_t k)
                             ORBIS_INLINE_LAMBDA { return term(k) + r * (term(k + 1) + r * term(k + 2)); };
      ((lanes(static_cast<float>(at)) + u) + value(0)).store(a.x + at);
      (lanes(a.row) + value(3)).store(a.y + at);
      value(6).store(a.ratio + at);
    }
    return any(largest > lanes(a.most));
  }
};

/// Evaluates `warp_to_frame` or `warp_to_row` for all pixels of an image. Both functions are smooth over a few pixels
/// and over inverse depth: they are computed at nodes for three inverse depths, and interpolated linearly between nodes
/// and by a parabola in inverse depth. The error is a few thousandths of a pixel for the motion during a read-out. Only
/// very near points, and points next to a node that does not project to a pixel, are projected individually.
template <camera_model Camera>
class row_warp {
 public:
  /// Allocates memory for the image size of the camera. O(nodes)
  row_warp(const Camera& camera, warp_direction direction)
      : direction_{direction}, across_{nodes(camera.width())}, down_{nodes(camera.height())} {
    rays_.reserve(across_ * down_);
    for (std::size_t j = 0; j != down_; ++j)
      for (std::size_t i = 0; i != across_; ++i)
        rays_.push_back(camera.unproject({place(i), place(j)}).value_or(filled<vec3>(unknown)));
    nodes_.resize(across_ * down_);
    row_.resize(across_);
  }

  /// Sets the motion. O(nodes) projections.
  void assign(const Camera& camera, const row_time& time, const vec6& twist) {
    time_ = time;
    twist_ = twist;
    const double shift = time.largest(camera.height()) * norm(head<3>(twist));
    constexpr double nearest = 0.25, largest_angle = 0.1;  // metres; angle that the shift subtends at the point
    most_inverse_ = shift > largest_angle * nearest ? largest_angle / shift : 1.0 / nearest;
    with_model(camera, [&](const auto& model) {
      for (std::size_t j = 0; j != down_; ++j)
        for (std::size_t i = 0; i != across_; ++i) nodes_[j * across_ + i] = fit(model, i, j);
    });
  }

  /// Computes the warped positions of the pixels of row `y` at their inverse depths. Entries of pixels without depth
  /// may have any finite non-negative value. O(pixels). @pre the lengths of `inverse_depth` and `out` are multiples of
  /// `warp_cell`
  void evaluate(const Camera& camera, int y, std::span<const float> inverse_depth, warped_row& out) {
    const auto* const above = nodes_.data() + static_cast<std::size_t>(y / warp_cell) * across_;
    const auto* const below = above + across_;
    const float part = static_cast<float>(y % warp_cell) / warp_cell;
    for (std::size_t i = 0; i != across_; ++i)
      for (std::size_t k = 0; k != row_[i].size(); ++k) row_[i][k] = above[i][k] + part * (below[i][k] - above[i][k]);
    const auto most = static_cast<float>(most_inverse_);
    const bool has_near = simd::kernel<warp_row_kernel, warp_row_kernel::signature>()(
        {row_.data(), across_ - 1, static_cast<float>(y), most, inverse_depth.data(), out.x.data(), out.y.data(),
         out.ratio.data()});
    for (std::size_t i = 0; i + 1 != across_; ++i) {
      const bool is_known = is_finite(row_[i]) && is_finite(row_[i + 1]);
      if (!is_known || has_near) evaluate_each(camera, i, y, inverse_depth, is_known ? most : -1.0F, out);
    }
  }

  /// Length of a row rounded up to whole cells, in pixels.
  [[nodiscard]] std::size_t padded_width() const noexcept { return (across_ - 1) * warp_cell; }

 private:
  static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

  [[nodiscard]] static std::size_t nodes(int size) noexcept {  // the last node is past the last pixel
    return static_cast<std::size_t>((size + warp_cell - 1) / warp_cell) + 1;
  }
  [[nodiscard]] static double place(std::size_t node) noexcept { return static_cast<double>(node) * warp_cell; }
  [[nodiscard]] static bool is_finite(const warp_parabolas& p) noexcept {
    float sum = 0.0F;
    for (const float term : p) sum += term;
    return std::isfinite(sum);
  }

  template <camera_model Model>
  [[nodiscard]] std::optional<warped_pixel> exactly(const Model& camera, const vec3& ray, double y,
                                                    double inverse_depth) const {
    if (!std::isfinite(ray.x())) return std::nullopt;
    return direction_ == warp_direction::to_frame ? warp_to_frame(camera, time_, twist_, ray, y, inverse_depth)
                                                  : warp_to_row(camera, time_, twist_, ray, y, inverse_depth);
  }

  template <camera_model Model>
  [[nodiscard]] warp_parabolas fit(const Model& camera, std::size_t i, std::size_t j) const {
    const double h = 0.5 * most_inverse_;
    std::array<vec3, 3> f;
    for (std::size_t k = 0; k != 3; ++k) {
      const auto p = exactly(camera, rays_[j * across_ + i], place(j), static_cast<double>(k) * h);
      f[k] = p ? vec3(p->x - place(i), p->y - place(j), p->ratio) : filled<vec3>(unknown);
    }
    const vec3 second = (f[0] - 2.0 * f[1] + f[2]) / (2.0 * h * h), first = (f[1] - f[0]) / h - h * second;
    warp_parabolas p;
    for (std::size_t k = 0; k != 3; ++k) {
      const auto axis = static_cast<Eigen::Index>(k);
      p[3 * k] = static_cast<float>(f[0][axis]);
      p[3 * k + 1] = static_cast<float>(first[axis]);
      p[3 * k + 2] = static_cast<float>(second[axis]);
    }
    return p;
  }

  /// Computes individually, without parabolas, the pixels of a cell whose inverse depth is larger than `above`.
  void evaluate_each(const Camera& camera, std::size_t of, int y, std::span<const float> inverse_depth, float above,
                     warped_row& out) const {
    constexpr float none = std::numeric_limits<float>::quiet_NaN();
    for (std::size_t x = of * warp_cell; x != (of + 1) * warp_cell; ++x) {
      if (!(inverse_depth[x] > above)) continue;
      const auto ray = camera.unproject({static_cast<double>(x), static_cast<double>(y)});
      const auto p = ray ? exactly(camera, *ray, y, static_cast<double>(inverse_depth[x])) : std::nullopt;
      out.x[x] = p ? static_cast<float>(p->x) : none;
      out.y[x] = p ? static_cast<float>(p->y) : none;
      out.ratio[x] = p ? static_cast<float>(p->ratio) : none;
    }
  }

  warp_direction direction_;
  std::size_t across_, down_;
  std::vector<vec3> rays_;             // rays of the nodes; NaN where undefined
  std::vector<warp_parabolas> nodes_;  // NaN where there is no pixel
  std::vector<warp_parabolas> row_;    // of the current row
  row_time time_;
  vec6 twist_ = zeros<vec6>();
  double most_inverse_ = 0.0;  // upper limit of the parabolas' validity, 1 / metre
};

}  // namespace orbis::camera::detail
