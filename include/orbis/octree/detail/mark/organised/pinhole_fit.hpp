// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation of the camera with which the points of a cloud were measured.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/detail/mark/rays/scan_sample.hpp>

namespace orbis::octree::detail {

/// Estimates the rotation and the intrinsics of a pinhole camera from a cloud whose points are the camera's pixels, in
/// order along the rows or the columns of the image; pixels may be missing, including whole rows. The camera's centre
/// is known. Points of one row lie in a plane through the centre, so the rows determine the x axis; the constant
/// distance between pixels at z = 1 then determines the z axis and the spacing. The result is refined by least squares
/// (Gauss-Newton). Reads about a thousand points, independent of the cloud's size. Reuses its memory.
template <class = void>
class basic_pinhole_fit {
 public:
  /// Fits the camera. Returns true if nearly all points are consistent with it. `point(i)`: the i-th of `count` points
  /// as float3; `limit`: maximum length of rays, metres.
  template <class Point>
  [[nodiscard]] bool fit(const float3& origin, std::size_t count, Point&& point, double limit) {
    if (count < most_runs * run_length) return false;
    const auto direction = [&](std::size_t i, vec3& d) {
      return length_of_ray(origin, point(i), limit, d).value_or(0.0);
    };
    if (!take_runs(count, direction) || !find_x_axis() || !find_columns() || !find_rows()) return false;
    find_center();
    // Pixel coordinates far from the centre may initially be off by one.
    for (int step = 0; step != 4; ++step)
      if ((step % 2 == 0 && !number_pixels()) || !refine()) return false;
    return set_image(count) && set_error() && verify(count, direction);
  }

  [[nodiscard]] const camera::pinhole& camera() const noexcept { return camera_; }
  /// R_world_camera.
  [[nodiscard]] so3 rotation() const { return so3{mat3(transposed(axes_))}; }
  /// Maximum deviation of the rays of points from the rays of their pixels, at z = 1, along x and along y.
  [[nodiscard]] double error() const noexcept { return error_; }
  /// Approximate share of pixels that have points, in the smallest image that contains the sampled pixels.
  [[nodiscard]] double filled() const noexcept { return filled_; }
  /// Mean depth of the rays' ends, metres.
  [[nodiscard]] double mean_z() const noexcept { return mean_z_; }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return runs_.capacity() * sizeof(run) + gaps_.capacity() * sizeof(double) + pixels_.capacity() * sizeof(pixel);
  }

 private:
  static constexpr std::size_t most_runs = 128, run_length = 8;
  static constexpr double straight = 1e-5;    ///< maximum angle in radians between the points of a row and its plane
  static constexpr double most_error = 1e-5;  ///< maximum error of rays, at z = 1
  static constexpr int widest = 4096;         ///< maximum width and height of the image, pixels
  static constexpr double widest_slope = 4.0;

  /// Consecutive points of the cloud in one row of the image.
  struct run {
    std::array<vec3, run_length> d;  ///< unit vectors
    vec3 normal;
    double length;                    ///< length of the first ray, metres
    double x_gap = 0.0, x_way = 0.0;  ///< at z = 1: smallest distance between neighbours; distance from first to last
    double y = 0.0;
  };
  /// A ray and its pixel.
  struct pixel {
    vec3 d;
    double u, v;
  };

  /// Collects runs within single rows, distributed over the whole cloud.
  template <class Direction>
  bool take_runs(std::size_t count, const Direction& direction) {
    runs_.clear();
    std::size_t tried = 0;
    random_bits random{1};
    for (std::size_t k = 0; k != most_runs; ++k) {
      const std::size_t begin = place_in_stretch(k, most_runs, count - run_length, random);
      run r;
      bool valid = true;
      for (std::size_t i = 0; i != run_length && valid; ++i) {
        const double length = direction(begin + i, r.d[i]);
        valid = length > 0.0;
        if (i == 0) r.length = length;
      }
      if (!valid) continue;
      ++tried;
      if (is_row(r)) runs_.push_back(r);
      if (tried == most_runs / 4 && 2 * runs_.size() < tried) return false;
    }
    return runs_.size() >= most_runs / 4 && 4 * runs_.size() > 3 * tried;
  }
  [[nodiscard]] static bool is_row(run& r) {
    const vec3 way = r.d.back() - r.d.front();
    for (std::size_t i = 1; i != run_length; ++i)
      if (!(dot(r.d[i] - r.d[i - 1], way) > 0.0)) return false;
    r.normal = cross(r.d.front(), r.d.back());
    const double size = norm(r.normal);
    if (!(size > 1e-5)) return false;
    r.normal /= size;
    for (const std::size_t i : {run_length / 3, run_length / 2})
      if (!(std::fabs(dot(r.normal, r.d[i])) < straight)) return false;
    return true;
  }
  /// Finds the x axis, which lies in the planes of all rows.
  bool find_x_axis() {
    mat3 moments = zeros<mat3>();
    vec3 mean = zeros<vec3>();
    for (const run& r : runs_) {
      moments += r.normal * transposed(r.normal);
      mean += r.d.front();
    }
    const symmetric_eigen<3> e = eigen_of_symmetric<3>(moments);
    if (!(e.values[1] > 1e-5 * e.values[2] && e.values[0] < 1e-3 * e.values[1])) return false;
    vec3 x = column_of(e.vectors, 0);
    if (dot(x, runs_.front().d.back() - runs_.front().d.front()) < 0.0) x = -x;
    vec3 z = mean - x * dot(x, mean);
    if (!(norm(z) > 0.1 * static_cast<double>(runs_.size()))) return false;
    z.normalize();
    axes_ = rows(x, cross(z, x), z);
    return project();
  }
  /// Projects the runs to z = 1; removes those that are not in front of the camera.
  bool project() {
    std::erase_if(runs_, [&](run& r) {
      std::array<double, run_length> x;
      r.y = 0.0;
      for (std::size_t i = 0; i != run_length; ++i) {
        const vec3 c = axes_ * r.d[i];
        if (!(c.z() > 0.1)) return true;
        x[i] = c.x() / c.z();
        r.y += c.y() / c.z() / run_length;
      }
      r.x_gap = std::fabs(x[1] - x[0]);
      for (std::size_t i = 2; i != run_length; ++i) r.x_gap = std::min(r.x_gap, std::fabs(x[i] - x[i - 1]));
      r.x_way = std::fabs(x.back() - x.front());
      return false;
    });
    return runs_.size() >= most_runs / 4;
  }
  /// Finds the column spacing and the z axis: if the z axis is rotated by t about x, the points of a row seen at y are
  /// (cos t - y sin t) times as far apart as at z = 1.
  bool find_columns() {
    gaps_.clear();
    for (const run& r : runs_) gaps_.push_back(r.x_gap);
    const auto middle = gaps_.begin() + static_cast<std::ptrdiff_t>(gaps_.size() / 2);
    std::nth_element(gaps_.begin(), middle, gaps_.end());
    double a = *middle, b = 0.0;
    std::size_t used = 0;
    for (const double close : {0.3, 0.05, 0.01}) {
      used = 0;
      double w = 0.0, wy = 0.0, wyy = 0.0, wg = 0.0, wyg = 0.0;
      for (const run& r : runs_) {
        const double want = a + b * r.y, steps = std::round(r.x_way / want);
        if (!(std::fabs(r.x_gap - want) < close * want) || !(steps >= 1.0 && steps < 1e3)) continue;
        // From the second iteration on, the number of steps to the last point is known.
        const double n = close > 0.1 ? 1.0 : steps, gap = close > 0.1 ? r.x_gap : r.x_way / steps;
        if (!(std::fabs(gap - want) < close * want)) continue;
        ++used;
        w += n * n;
        wy += n * n * r.y;
        wyy += n * n * r.y * r.y;
        wg += n * n * gap;
        wyg += n * n * r.y * gap;
      }
      const double det = w * wyy - wy * wy;
      if (2 * used < runs_.size() || !(det > 1e-9 * w * w)) return false;
      b = (w * wyg - wy * wg) / det;
      a = (wg - b * wy) / w;
      if (!(a > 0.0)) return false;
    }
    const double turn = std::atan2(-b, a);
    const vec3 y = row_of(axes_, 1), z = row_of(axes_, 2);
    set_row(axes_, 1, std::cos(turn) * y + std::sin(turn) * z);
    set_row(axes_, 2, std::cos(turn) * z - std::sin(turn) * y);
    fx_ = 1.0 / std::hypot(a, b);
    return project();
  }
  /// Finds the row spacing: the largest length that divides all distances between rows.
  bool find_rows() {
    std::sort(runs_.begin(), runs_.end(), [](const run& a, const run& b) { return a.y < b.y; });
    gaps_.clear();
    for (std::size_t i = 1; i != runs_.size(); ++i)
      if (const double gap = runs_[i].y - runs_[i - 1].y; gap > 0.05 / fx_) gaps_.push_back(gap);
    if (gaps_.size() < most_runs / 16) return false;
    const double least = *std::min_element(gaps_.begin(), gaps_.end());
    for (int part = 1; part != 16; ++part) {
      double step = least / part;
      bool fits = true;
      for (const double close : {0.1, 0.05}) {
        std::size_t tried = 0, good = 0;
        double n = 0.0, sum = 0.0;
        for (const double gap : gaps_) {
          const double steps = std::round(gap / step);
          if (steps > 40.0) continue;  // too many steps to count reliably yet
          ++tried;
          if (std::fabs(gap / step - steps) > close) continue;
          ++good;
          n += steps;
          sum += gap;
        }
        fits = fits && 2 * tried > gaps_.size() && 20 * good > 19 * tried;
        if (!fits) break;
        step = sum / n;
      }
      if (!fits) continue;
      fy_ = 1.0 / step;
      return true;
    }
    return false;
  }
  /// Places the point nearest to the axis at the centre of pixel (0, 0).
  void find_center() {
    double least = 1e30;
    for (const run& r : runs_) {
      const vec3 c = axes_ * r.d.front();
      const double x = c.x() / c.z(), y = c.y() / c.z(), aside = std::max(std::fabs(x), std::fabs(y));
      if (aside >= least) continue;
      least = aside;
      cx_ = -fx_ * x;
      cy_ = -fy_ * y;
    }
  }
  /// Assigns pixels to the first and last points of the runs. Removes points that fit no pixel if there are only a few.
  bool number_pixels() {
    pixels_.clear();
    for (const run& r : runs_)
      for (const vec3& d : {r.d.front(), r.d.back()}) {
        const vec3 c = axes_ * d;
        const double u = fx_ * c.x() / c.z() + cx_, v = fy_ * c.y() / c.z() + cy_;
        const pixel p{d, std::round(u), std::round(v)};
        if (std::fabs(p.u - u) < 0.25 && std::fabs(p.v - v) < 0.25) pixels_.push_back(p);
      }
    return 20 * pixels_.size() > 17 * 2 * runs_.size();
  }
  /// One Gauss-Newton step for the rotation and the intrinsics.
  bool refine() {
    matrix<7, 7> h = zeros<matrix<7, 7>>();
    matrix<7> g = zeros<matrix<7>>();
    square_ = 0.0;
    for (const pixel& p : pixels_) {
      const vec3 c = axes_ * p.d;
      const double x = c.x() / c.z(), y = c.y() / c.z();
      // Rotation about the camera's axes, fx, fy, cx, cy.
      matrix<7> ju, jv;
      ju << fx_ * x * y, -fx_ * (1.0 + x * x), fx_ * y, x, 0.0, 1.0, 0.0;
      jv << fy_ * (1.0 + y * y), -fy_ * x * y, -fy_ * x, 0.0, y, 0.0, 1.0;
      const double ru = fx_ * x + cx_ - p.u, rv = fy_ * y + cy_ - p.v;
      square_ += ru * ru / (fx_ * fx_) + rv * rv / (fy_ * fy_);
      h += outer_product(ju, ju) + outer_product(jv, jv);
      g += ju * ru + jv * rv;
    }
    // In a very narrow view, rotation and shift are indistinguishable, so any solution is acceptable.
    const auto solved = solve_semidefinite(h, matrix<7>(-g));
    if (!solved || !all_finite(*solved)) return false;
    const matrix<7>& step = *solved;
    const vec3 turn = head<3>(step);
    axes_ = so3::exp(-turn).rotation_matrix() * axes_;
    fx_ += step[3];
    fy_ += step[4];
    cx_ += step[5];
    cy_ += step[6];
    return fx_ > 0.0 && fy_ > 0.0;
  }
  /// Sets the image size, with a margin around the pixels of the sample. Fails for very wide views, for which float is
  /// not precise enough.
  bool set_image(std::size_t count) {
    double u0 = pixels_.front().u, u1 = u0, v0 = pixels_.front().v, v1 = v0, z = 0.0;
    for (const pixel& p : pixels_) {
      u0 = std::min(u0, p.u), u1 = std::max(u1, p.u);
      v0 = std::min(v0, p.v), v1 = std::max(v1, p.v);
    }
    for (const run& r : runs_) z += dot(row_of(axes_, 2), r.d.front()) * r.length;
    mean_z_ = z / static_cast<double>(runs_.size());
    const double room_u = std::ceil(0.04 * (u1 - u0)) + 8.0, room_v = std::ceil(0.04 * (v1 - v0)) + 8.0;
    const double width = u1 - u0 + 1.0 + 2.0 * room_u, height = v1 - v0 + 1.0 + 2.0 * room_v;
    size_ = (u1 - u0 + 1.0) * (v1 - v0 + 1.0);
    if (!(width <= widest && height <= widest && size_ <= 16.0 * static_cast<double>(count))) return false;
    cx_ += room_u - u0;
    cy_ += room_v - v0;
    slope_ = std::max(std::max(cx_, width - cx_) / fx_, std::max(cy_, height - cy_) / fy_);
    if (!(slope_ < widest_slope)) return false;
    camera_ = camera::pinhole{static_cast<int>(width), static_cast<int>(height), fx_, fy_, cx_, cy_};
    return true;
  }
  /// Sets the error from the residuals between rays and pixels, which result from the rounding of the points; it is at
  /// least the precision of float.
  bool set_error() {
    const double mean = std::sqrt(square_ / (2.0 * static_cast<double>(pixels_.size())));
    error_ = std::max(5e-7 * std::max(1.0, 0.5 * (1.0 + slope_ * slope_)), 8.0 * mean);
    return error_ < most_error && error_ * std::max(fx_, fy_) < 0.05;
  }
  /// Verifies the camera with other points, and computes the share of the image's pixels that have points.
  template <class Direction>
  [[nodiscard]] bool verify(std::size_t count, const Direction& direction) {
    std::size_t tried = 0, good = 0;
    random_bits random{2};
    for (std::size_t k = 0; k != most_runs; ++k) {
      vec3 d;
      if (direction(place_in_stretch(k, most_runs, count - 1, random), d) == 0.0) continue;
      ++tried;
      const vec3 c = axes_ * d;
      const auto is_pixel = [&](double at, double f, double centre, int size) {
        const double p = f * at / c.z() + centre, whole = std::round(p);
        return std::fabs(p - whole) <= error_ * f && whole >= 0.0 && whole < size;
      };
      if (c.z() > 0.0 && is_pixel(c.x(), fx_, cx_, camera_.width()) && is_pixel(c.y(), fy_, cy_, camera_.height()))
        ++good;
    }
    filled_ = static_cast<double>(count) * static_cast<double>(tried) / most_runs / size_;
    return 50 * good > 49 * tried && filled_ < 1.1;  // otherwise most pixels have several points
  }

  std::vector<run> runs_;
  std::vector<double> gaps_;
  std::vector<pixel> pixels_;
  mat3 axes_ = identity<mat3>();  ///< R_camera_world
  double fx_ = 0.0, fy_ = 0.0, cx_ = 0.0, cy_ = 0.0;
  double square_ = 0.0;  ///< sum of squared residuals, at z = 1
  double size_ = 0.0;    ///< number of pixels of the image, excluding the margin
  double slope_ = 0.0;   ///< largest |x| or |y| of the sides of the image, at z = 1
  double error_ = 0.0, mean_z_ = 0.0, filled_ = 0.0;
  camera::pinhole camera_;
};
using pinhole_fit = basic_pinhole_fit<>;

}  // namespace orbis::octree::detail
