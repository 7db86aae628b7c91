// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Converts rolling-shutter images to global-shutter images at the frame's time.
///
/// @code
///   orbis::camera::shutter_correction<orbis::camera::pinhole> correct{camera};
///   if (correct.is_needed(shutter, twist)) {
///     correct.depth(shutter, twist, frame.depth_metres(), depth.view());
///     correct.color(shutter, twist, orbis::camera::depth_view{depth, scale}, frame.color.view(), color.view());
///   }
/// @endcode
///
/// The camera is assumed to move with a constant twist during the read-out. Each depth is moved to the pixel that
/// observes it at the frame's time, where the nearest depth wins; this determines the surface that a pixel shows. The
/// pixel's depth is then read at the position where the depth image observed that point on the surface: interpolated
/// linearly in inverse depth, which is exact on planes, using only pixels on that surface. Planes therefore stay
/// planar, and depth edges stay sharp.
///
/// For the constant-velocity model, see J. Hedborg, P.-E. Forssen, M. Felsberg, E. Ringaby, "Rolling shutter bundle
/// adjustment", CVPR 2012; for rolling-shutter depth images, see E. Ringaby, P.-E. Forssen, "Scan rectification for
/// structured light range sensors with rolling shutters", ICCV 2011.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/detail/shutter/row_warp.hpp>
#include <orbis/camera/detail/shutter/warp_kernels.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/core/types.hpp>

namespace orbis::camera {

namespace detail {

/// Inverse of a depth in metres; 0 if there is no depth or its inverse is not finite.
[[nodiscard]] inline float inverse_depth(float metres) noexcept {
  const float inverse = metres > 0.0F ? 1.0F / metres : 0.0F;
  return inverse <= std::numeric_limits<float>::max() ? inverse : 0.0F;
}

}  // namespace detail

/// Corrects the images of one camera. Reuses its working memory, and allocates none after the first image. Not
/// thread-safe.
template <camera_model Camera>
class shutter_correction {
 public:
  /// Allocates the tables for the camera. O(width * height / 256)
  explicit shutter_correction(Camera camera)
      : camera_{std::move(camera)},
        to_frame_{camera_, detail::warp_direction::to_frame},
        to_row_{camera_, detail::warp_direction::to_row},
        surface_(to_row_.padded_width()),
        metres_(to_row_.padded_width()),
        index_(to_row_.padded_width()),
        warped_{to_row_.padded_width()} {}

  /// Returns true if images taken during this motion differ from global-shutter images. `twist`: twist of the camera in
  /// its own frame, per second, translation first.
  [[nodiscard]] static bool is_needed(const shutter& s, const vec6& twist) noexcept {
    return !s.is_global() && !(twist.array() == 0.0).all();
  }

  /// Computes the global-shutter depth image at the frame's time. `out` is 0 where nothing was measured, or where the
  /// measured point is not visible. `T` is the stored type of `depth` if it is a `depth_view` (`out` then has the same
  /// scale), otherwise `float` (metres). If the camera does not move, or all rows are read at the frame's time, `out`
  /// equals `depth`. Errors: `invalid_argument` if the twist is not finite, or turns the camera by more than 0.3
  /// radians between the frame's time and the time of a row; `out` is then unchanged. O(pixels).
  /// @pre the images have the size of the camera and do not overlap
  template <depth_source Depth, class T>
  requires std::same_as<T, depth_pixel<Depth>>
  [[nodiscard]] result<void> depth(const shutter& s, const vec6& twist, const Depth& depth, image_view<T> out) {
    assert(has_size(depth) && has_size(out));
    const int width = camera_.width(), height = camera_.height();
    constexpr bool is_view = is_depth_view<Depth>;
    double scale = 1.0;
    if constexpr (is_view) scale = depth.scale();
    const auto time = detail::row_time::of_depth(s, height);
    if (auto usable = check(time, twist); !usable) return usable;
    if (time.is_zero() || !is_needed(s, twist)) {
      for (int y = 0; y != height; ++y)
        for (int x = 0; x != width; ++x) {
          if constexpr (is_view)
            out(x, y) = depth.pixels()(x, y);
          else
            out(x, y) = stored<T>(depth(x, y), scale);
        }
      return {};
    }
    to_frame_.assign(camera_, time, twist);
    to_row_.assign(camera_, time, twist);
    move_depths(depth);
    const auto read = simd::kernel<detail::read_surface_kernel, detail::read_surface_kernel::signature>();
    for (int y = 0; y != height; ++y) {
      find_surfaces(y);
      to_row_.evaluate(camera_, y, surface_, warped_);
      read({surface_.size(), width, height, surface_.data(), warped_.x.data(), warped_.y.data(), warped_.ratio.data(),
            inverse_.data(), metres_.data()});
      const auto row = out.row(y);
      for (std::size_t x = 0; x != row.size(); ++x) row[x] = stored<T>(metres_[x], scale);
    }
    return {};
  }

  /// Computes the colour image that belongs to a corrected depth image: each pixel gets the colour read at the position
  /// where its point was observed; a pixel without depth is treated as a point at a large distance; positions outside
  /// the image are black. If the camera does not move, or all rows are read at the frame's time, the image is copied.
  /// Only every `row_step`-th row of `out`, from the first, is changed. Errors and preconditions: those of `depth`.
  /// O(pixels). @pre row_step > 0
  template <depth_source Depth>
  [[nodiscard]] result<void> color(const shutter& s, const vec6& twist, const Depth& corrected,
                                   image_view<const rgb8> color, image_view<rgb8> out, int row_step = 1) {
    assert(has_size(corrected) && has_size(color) && has_size(out) && row_step > 0);
    const int width = camera_.width(), height = camera_.height();
    const auto time = detail::row_time::of_color(s, height);
    if (auto usable = check(time, twist); !usable) return usable;
    if (time.is_zero() || !is_needed(s, twist)) {
      for (int y = 0; y < height; y += row_step) std::ranges::copy(color.row(y), out.row(y).begin());
      return {};
    }
    to_row_.assign(camera_, time, twist);
    std::ranges::fill(surface_, 0.0F);
    const auto stride = static_cast<std::int32_t>(color.stride());
    const auto nearest_pixels = simd::kernel<detail::nearest_pixels_kernel, detail::nearest_pixels_kernel::signature>();
    for (int y = 0; y < height; y += row_step) {
      for (int x = 0; x != width; ++x) metres_[static_cast<std::size_t>(x)] = corrected(x, y);
      for (std::size_t x = 0; x != static_cast<std::size_t>(width); ++x)
        surface_[x] = detail::inverse_depth(metres_[x]);
      to_row_.evaluate(camera_, y, surface_, warped_);
      nearest_pixels({index_.size(), width, height, stride, warped_.x.data(), warped_.y.data(), index_.data()});
      const auto row = out.row(y);
      for (std::size_t x = 0; x != row.size(); ++x) row[x] = index_[x] < 0 ? rgb8{} : color.data()[index_[x]];
    }
    return {};
  }

  [[nodiscard]] const Camera& camera() const noexcept { return camera_; }

 private:
  static constexpr float no_depth = std::numeric_limits<float>::max();

  [[nodiscard]] result<void> check(const detail::row_time& time, const vec6& twist) const {
    if (!all_finite(twist)) return fail(errc::invalid_argument, "twist", "is not finite");
    constexpr double most = 0.3;
    if (!(time.largest(camera_.height()) * norm(tail<3>(twist)) <= most))
      return fail(errc::invalid_argument, "twist", "turns the camera by more than 0.3 radians during the read-out");
    return {};
  }
  template <class Image>
  [[nodiscard]] bool has_size(const Image& image) const {
    return image.width() == camera_.width() && image.height() == camera_.height();
  }
  /// Converts `metres` to the stored value.
  template <class T>
  [[nodiscard]] static T stored(float metres, double scale) noexcept {
    const double value = static_cast<double>(metres) * scale;
    if constexpr (std::same_as<T, float>)
      return static_cast<float>(value);
    else
      return value < 65534.5 ? static_cast<std::uint16_t>(value + 0.5) : T{};
  }

  /// Moves each depth to its pixel at the frame's time, in `nearest_`; stores its original inverse in `inverse_`.
  template <class Depth>
  void move_depths(const Depth& depth) {
    const int width = camera_.width(), height = camera_.height();
    if (nearest_.width() != width || nearest_.height() != height) {
      nearest_ = image<float>(width, height);
      inverse_ = image<float>(width + 2, height + 2);
    }
    std::ranges::fill(nearest_.pixels(), no_depth);
    std::ranges::fill(surface_, 0.0F);
    const auto nearest_pixels = simd::kernel<detail::nearest_pixels_kernel, detail::nearest_pixels_kernel::signature>();
    for (int y = 0; y != height; ++y) {
      for (int x = 0; x != width; ++x) metres_[static_cast<std::size_t>(x)] = depth(x, y);
      for (std::size_t x = 0; x != static_cast<std::size_t>(width); ++x)
        surface_[x] = detail::inverse_depth(metres_[x]);
      std::copy_n(surface_.begin(), width, &inverse_(1, y + 1));
      to_frame_.evaluate(camera_, y, surface_, warped_);
      nearest_pixels({index_.size(), width, height, width, warped_.x.data(), warped_.y.data(), index_.data()});
      for (std::size_t x = 0; x != static_cast<std::size_t>(width); ++x) {
        const float moved = metres_[x] * warped_.ratio[x];
        if (index_[x] < 0 || !(moved > 0.0F) || surface_[x] == 0.0F) continue;
        float& nearest = nearest_.data()[index_[x]];
        nearest = std::min(nearest, moved);
      }
    }
  }
  /// Computes the inverse depths of the surfaces that row `y` shows at the frame's time; 0 where there is no surface.
  /// Fills cracks in stretched surfaces: pixels between two pixels of one surface.
  void find_surfaces(int y) {
    const auto row = std::as_const(nearest_).row(y);
    for (std::size_t x = 0; x != row.size(); ++x)
      surface_[x] = row[x] < no_depth ? detail::inverse_depth(row[x]) : 0.0F;
    const auto between = [](float a, float b) {
      const bool is_one = a < no_depth && b < no_depth && std::abs(a - b) <= detail::same_surface * std::min(a, b);
      return is_one ? detail::inverse_depth(0.5F * (a + b)) : 0.0F;
    };
    const bool has_both = y > 0 && y + 1 < nearest_.height();
    for (std::size_t x = 0; x != row.size(); ++x) {
      if (surface_[x] > 0.0F) continue;
      if (x > 0 && x + 1 < row.size()) surface_[x] = between(row[x - 1], row[x + 1]);
      const int column = static_cast<int>(x);
      if (surface_[x] == 0.0F && has_both) surface_[x] = between(nearest_(column, y - 1), nearest_(column, y + 1));
    }
  }

  Camera camera_;
  detail::row_warp<Camera> to_frame_, to_row_;
  image<float> nearest_;  // depth at the frame's time, or no_depth
  image<float> inverse_;  // as read, with a border of one pixel; 0: no depth
  // Buffers for one row, padded to whole cells.
  std::vector<float> surface_, metres_;  // inverse depth, depth
  std::vector<std::int32_t> index_;
  detail::warped_row warped_;
};

}  // namespace orbis::camera
