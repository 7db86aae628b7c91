// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Depth at a keypoint, with its standard deviation.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include <orbis/camera/depth.hpp>

namespace orbis::features {

/// Standard deviation of a measured depth: `constant + quadratic * z^2`, metres. The defaults suit a Kinect and are
/// close to those of Nguyen, Izadi, Lovell, "Modeling Kinect sensor noise for improved 3D reconstruction and tracking",
/// 3DIMPVT 2012.
struct depth_noise {
  double constant = 0.0012;
  double quadratic = 0.0019;
  [[nodiscard]] constexpr double operator()(double z) const noexcept { return constant + quadratic * z * z; }
};

/// Options for the estimation of a keypoint's depth from its neighbourhood.
struct keypoint_depth_options {
  int radius = 1;               ///< radius of the window: 1 is 3x3, 2 is 5x5; maximum 3
  int min_valid = 3;            ///< minimum number of pixels with depth in the window
  float edge_sigmas = 4.0F;     ///< minimum size of a depth edge, in standard deviations of the depth
  float edge_relative = 0.02F;  ///< minimum size of a depth edge, as a fraction of the depth
  float min_share = 0.7F;       ///< minimum share of the valid pixels that have no depth edge between them; > 0.5
  double position_sigma = 0.5;  ///< sigma of the keypoint position, pixels; adds to the depth deviation on slopes
  depth_noise noise{};
};

/// A depth and its standard deviation, metres.
struct keypoint_depth {
  double z = 0.0;
  double sigma = 0.0;
};

/// Least-squares plane through the depths of a window. Used by `depth_at`.
class depth_plane {
 public:
  /// Adds the depth `z` of a pixel at the offset (u, v) from the centre of the window. @pre the offsets are at most 3
  void add(int u, int v, double z) noexcept {
    ++n_;
    u_ += u, v_ += v, uu_ += u * u, uv_ += u * v, vv_ += v * v;
    z_ += z, uz_ += u * z, vz_ += v * z, zz_ += z * z;
  }
  /// Returns true if the pixels determine a plane: at least six that are not collinear.
  [[nodiscard]] bool determined() const noexcept { return n_ >= 6 && determinant() > n_ * n_; }

  /// The depth of the plane, its residual variance, and its squared slope, in metres per pixel.
  struct fit {
    double z, variance, squared_slope;
  };
  /// Returns the plane at the offset (u, v). @pre determined()
  [[nodiscard]] fit at(double u, double v) const noexcept {
    const double n = n_, scale = 1.0 / determinant(), mean = 1.0 / n;
    const double uz = n * uz_ - u_ * z_, vz = n * vz_ - v_ * z_;
    const double a = scale * (spread_vv() * uz - spread_uv() * vz);
    const double b = scale * (spread_uu() * vz - spread_uv() * uz);
    const double rest = std::max(0.0, zz_ - mean * (z_ * z_ + a * uz + b * vz));
    return {mean * (z_ - a * u_ - b * v_) + a * u + b * v, rest / (n - 3.0), a * a + b * b};
  }

 private:
  // `n_` times the centred sums
  [[nodiscard]] int spread_uu() const noexcept { return n_ * uu_ - u_ * u_; }
  [[nodiscard]] int spread_uv() const noexcept { return n_ * uv_ - u_ * v_; }
  [[nodiscard]] int spread_vv() const noexcept { return n_ * vv_ - v_ * v_; }
  [[nodiscard]] int determinant() const noexcept { return spread_uu() * spread_vv() - spread_uv() * spread_uv(); }
  int n_ = 0, u_ = 0, v_ = 0, uu_ = 0, uv_ = 0, vv_ = 0;
  double z_ = 0.0, uz_ = 0.0, vz_ = 0.0, zz_ = 0.0;
};

namespace detail {

struct window_pixel {
  int x, y;
};

/// The pixel nearest to a position; empty if it is outside the image or the position is not finite.
[[nodiscard]] inline std::optional<window_pixel> window_centre(float x, float y, int width, int height) noexcept {
  if (!(x > -0.5F && y > -0.5F && x < static_cast<float>(width) - 0.5F && y < static_cast<float>(height) - 0.5F))
    return std::nullopt;
  // Rounds like lround, because x > -0.5; a sum in float would not be exact.
  return window_pixel{static_cast<int>(static_cast<double>(x) + 0.5), static_cast<int>(static_cast<double>(y) + 0.5)};
}

}  // namespace detail

/// Depth along the optical axis at a (subpixel) position `(x, y)`: the depth of a plane fitted to the valid depths
/// around it, or their median if there are too few for a plane. The standard deviation combines the sensor noise, the
/// residual of the plane and, on slopes, the keypoint's position error.
///
/// Empty if there are too few valid depths, if `(x, y)` is outside the image or not finite, or if the window straddles
/// a depth edge: the pixel may then belong to either side, and a wrong choice causes errors of decimetres. A few flying
/// pixels beyond an edge are ignored.
/// @pre 0 <= radius <= 3
template <camera::depth_source Depth>
[[nodiscard]] std::optional<keypoint_depth> depth_at(const Depth& depth, float x, float y,
                                                     const keypoint_depth_options& options = {}) {
  constexpr int max_radius = 3;
  assert(options.radius >= 0 && options.radius <= max_radius);
  const auto centre = detail::window_centre(x, y, depth.width(), depth.height());
  if (!centre) return std::nullopt;
  const auto [cx, cy] = *centre;

  struct valid_pixel {
    int u, v;  // offset from the centre
    float z;
  };
  constexpr std::size_t most = (2 * max_radius + 1) * (2 * max_radius + 1);
  std::array<valid_pixel, most> valid;
  std::size_t count = 0;
  float least = std::numeric_limits<float>::max(), greatest = 0.0F;
  depth_plane plane;
  for (int v = std::max(0, cy - options.radius); v <= std::min(depth.height() - 1, cy + options.radius); ++v)
    for (int u = std::max(0, cx - options.radius); u <= std::min(depth.width() - 1, cx + options.radius); ++u)
      if (const float metres = depth(u, v); metres > 0.0F) {
        valid[count++] = {u - cx, v - cy, metres};
        plane.add(u - cx, v - cy, static_cast<double>(metres));
        least = std::min(least, metres);
        greatest = std::max(greatest, metres);
      }
  if (count == 0 || static_cast<int>(count) < options.min_valid) return std::nullopt;

  std::array<float, most> z;
  const auto sort = [&] {
    for (std::size_t i = 0; i != count; ++i) z[i] = valid[i].z;
    std::sort(z.begin(), z.begin() + static_cast<std::ptrdiff_t>(count));
  };
  const auto is_edge = [&](float near, float far) {
    const double gap = static_cast<double>(far) - static_cast<double>(near);
    return gap > static_cast<double>(options.edge_sigmas) * options.noise(static_cast<double>(near)) &&
           gap > static_cast<double>(options.edge_relative) * static_cast<double>(near);
  };
  std::size_t begin = 0, end = count;
  const bool is_even = !is_edge(least, greatest);  // then no two depths have an edge: noise grows with depth
  if (!is_even) {
    // Finds the largest run of sorted depths without a gap; even a steep slope has no gaps.
    sort();
    end = 0;
    for (std::size_t first = 0, i = 1; i <= count; ++i) {
      if (i != count && !is_edge(z[i - 1], z[i])) continue;
      if (i - first > end - begin) {
        begin = first;
        end = i;
      }
      first = i;
    }
    if (static_cast<float>(end - begin) < options.min_share * static_cast<float>(count)) return std::nullopt;
    least = z[begin];
    greatest = z[end - 1];
    plane = {};
    for (std::size_t i = 0; i != count; ++i)
      if (const valid_pixel& p = valid[i]; p.z >= least && p.z <= greatest)
        plane.add(p.u, p.v, static_cast<double>(p.z));
  }

  const auto nearest = static_cast<double>(least), farthest = static_cast<double>(greatest);
  if (plane.determined()) {
    const auto fit = plane.at(static_cast<double>(x) - cx, static_cast<double>(y) - cy);
    const double at = std::clamp(fit.z, nearest, farthest);  // prevents extrapolation into a hole
    const double noise = options.noise(at), by_position = options.position_sigma * options.position_sigma;
    return keypoint_depth{at, std::sqrt(noise * noise + fit.variance + by_position * fit.squared_slope)};
  }
  if (is_even) sort();
  const std::size_t middle = begin + (end - begin) / 2;
  const auto upper = static_cast<double>(z[middle]);
  const double median = (end - begin) % 2 == 1 ? upper : 0.5 * (upper + static_cast<double>(z[middle - 1]));
  return keypoint_depth{median, std::hypot(options.noise(median), 0.5 * (farthest - nearest))};
}

/// Fetches into the cache the rows of pixels that `depth_at` reads at `(x, y)` with the default radius. If called some
/// keypoints ahead, it halves the time of `depth_at` for images that are not in the cache. Does nothing near the border
/// and outside the image, and for depth that is not a `depth_view`.
template <camera::depth_source Depth>
void prefetch_depth(const Depth& depth, float x, float y) {
  if constexpr (camera::is_depth_view<Depth>) {
    const auto pixels = depth.pixels();
    const auto centre = detail::window_centre(x, y, pixels.width(), pixels.height());
    if (!centre || centre->y == 0 || centre->y + 1 == pixels.height()) return;
    for (int v = -1; v <= 1; ++v) __builtin_prefetch(&pixels(centre->x, centre->y + v));
  }
}

}  // namespace orbis::features
