// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Alignment of a small patch with an image by inverse compositional Gauss-Newton steps, with motion blur.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <optional>

#include <orbis/core/image.hpp>
#include <orbis/core/simd/convert.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/math.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/landmark_patch.hpp>

namespace orbis::slam::detail {

/// Returns the value of an image between pixels, by bilinear interpolation.
/// @pre 0 <= x < width - 1, 0 <= y < height - 1
[[nodiscard]] inline float interpolate(image_view<const std::uint8_t> image, float x, float y) noexcept {
  const int left = static_cast<int>(x), top = static_cast<int>(y);
  const float fx = x - static_cast<float>(left), fy = y - static_cast<float>(top);
  const auto at = [&](int dx, int dy) { return static_cast<float>(image(left + dx, top + dy)); };
  const float upper = at(0, 0) + fx * (at(1, 0) - at(0, 0)), lower = at(0, 1) + fx * (at(1, 1) - at(0, 1));
  return upper + fy * (lower - upper);
}

/// A filter for motion blur: the mean along a line centred on a pixel, as weights of the surrounding pixels.
class line_kernel {
 public:
  static constexpr int reach = 6;                 ///< pixels from the middle
  static constexpr double longest = 2.0 * reach;  ///< pixels; longer lines are shortened

  explicit line_kernel(vec2 line) {
    const double extent = std::max(std::abs(line.x()), std::abs(line.y()));
    if (!(norm(line) >= 0.1 && norm(line) < 1e6)) {  // also true for NaN
      weights_[count_++] = {0, 0, 1.0F};
      return;
    }
    if (extent > longest) line = (longest / extent) * line;
    const int steps = 2 * static_cast<int>(std::ceil(norm(line))) + 1;
    std::array<float, std::size_t{side} * side> dense{};
    for (int k = 0; k != steps; ++k) {
      const double t = (k + 0.5) / steps - 0.5, x = reach + t * line.x(), y = reach + t * line.y();
      const int left = std::min(static_cast<int>(x), side - 2), top = std::min(static_cast<int>(y), side - 2);
      const double fx = x - left, fy = y - top;
      const auto cell = static_cast<std::size_t>(top * side + left);
      dense[cell] += static_cast<float>((1.0 - fx) * (1.0 - fy) / steps);
      dense[cell + 1] += static_cast<float>(fx * (1.0 - fy) / steps);
      dense[cell + side] += static_cast<float>((1.0 - fx) * fy / steps);
      dense[cell + side + 1] += static_cast<float>(fx * fy / steps);
    }
    for (int y = 0; y != side; ++y)
      for (int x = 0; x != side; ++x)
        if (const float w = dense[static_cast<std::size_t>(y * side + x)]; w > 0.0F) {
          weights_[count_++] = {x - reach, y - reach, w};
          reach_x_ = std::max(reach_x_, std::abs(x - reach));
          reach_y_ = std::max(reach_y_, std::abs(y - reach));
        }
  }

  /// The horizontal and vertical distances of the farthest pixels with a nonzero weight.
  [[nodiscard]] int reach_x() const noexcept { return reach_x_; }
  [[nodiscard]] int reach_y() const noexcept { return reach_y_; }

  /// Sets `to`, `Rows` rows of 16 values, to the weighted means around the values starting at `from`, whose rows are
  /// `stride` apart.
  template <int Rows, simd::target Target>
  ORBIS_ALWAYS_INLINE void apply(const float* from, std::ptrdiff_t stride, float* to) const {
    using lanes = simd::vec<float, 8, Target>;
    for (int y = 0; y != Rows; ++y, from += stride, to += 16) {
      lanes left(0.0F), right(0.0F);
      for (std::size_t k = 0; k != count_; ++k) {
        const float* const row = from + weights_[k].y * stride + weights_[k].x;
        left += lanes(weights_[k].weight) * lanes::load(row);
        right += lanes(weights_[k].weight) * lanes::load(row + 8);
      }
      left.store(to), right.store(to + 8);
    }
  }

 private:
  static constexpr int side = 2 * reach + 1;
  struct cell {
    int x, y;
    float weight;
  };
  std::array<cell, std::size_t{side} * side> weights_;
  std::size_t count_ = 0;
  int reach_x_ = 0, reach_y_ = 0;
};

/// The placement of a patch in an image: pixel (u, v) of the patch, relative to its centre, is at
/// `centre + u * across + v * down`, in pixels of the image.
struct patch_placement {
  vec2 centre, across, down;
};

/// The result of aligning a patch.
struct patch_shift {
  vec2 shift;          ///< from the expected position to the measured one, pixels of the patch
  double correlation;  ///< normalised correlation of the central 8 x 8 pixels
};

/// Aligns a patch with an image; see `match_patch`.
struct match_patch_kernel {
  using signature = bool(const landmark_patch::pixel_array&, const line_kernel&, const line_kernel&,
                         image_view<const std::uint8_t>, const patch_placement&, patch_shift&);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE bool run(const landmark_patch::pixel_array& pixels, const line_kernel& by_image,
                                      const line_kernel& by_patch, image_view<const std::uint8_t> image,
                                      const patch_placement& expected, patch_shift& found) {
    using lanes = simd::vec<float, 8, Target>;
    constexpr int side = 8;           // size of the compared region: a row is one vector
    constexpr int around = 3;         // maximum shift, pixels
    constexpr double weakest = 64.0;  // smallest eigenvalue of the sum of squared gradients, grey levels squared
    constexpr int most_iterations = 12;
    constexpr double enough = 0.01;  // pixels

    // The blurred centre of the patch, with a border for the gradient.
    constexpr int size = landmark_patch::size, first = (size - side) / 2 - 1;
    std::array<float, std::size_t{size} * size + 16> values;
    for (std::size_t k = 0; k != pixels.size(); ++k) values[k] = static_cast<float>(pixels[k]);
    for (std::size_t k = pixels.size(); k != values.size(); ++k) values[k] = 0.0F;
    float blurred[10][16];
    by_image.apply<10, Target>(values.data() + first * size + first, size, blurred[0]);
    lanes t[side], gx[side], gy[side], sum_t(0.0F), sum_x(0.0F), sum_y(0.0F);
    for (int y = 0; y != side; ++y) {
      t[y] = lanes::load(&blurred[y + 1][1]);
      gx[y] = lanes(0.5F) * (lanes::load(&blurred[y + 1][2]) - lanes::load(&blurred[y + 1][0]));
      gy[y] = lanes(0.5F) * (lanes::load(&blurred[y + 2][1]) - lanes::load(&blurred[y][1]));
      sum_t += t[y], sum_x += gx[y], sum_y += gy[y];
    }
    constexpr float share = 1.0F / (side * side);
    const lanes mean_t(share * simd::sum(sum_t)), mean_x(share * simd::sum(sum_x)), mean_y(share * simd::sum(sum_y));
    lanes sum_xx(0.0F), sum_xy(0.0F), sum_yy(0.0F), sum_tt(0.0F), sum_tx(0.0F), sum_ty(0.0F);
    for (int y = 0; y != side; ++y) {
      t[y] -= mean_t, gx[y] -= mean_x, gy[y] -= mean_y;
      sum_xx += gx[y] * gx[y], sum_xy += gx[y] * gy[y], sum_yy += gy[y] * gy[y];
      sum_tt += t[y] * t[y], sum_tx += t[y] * gx[y], sum_ty += t[y] * gy[y];
    }
    const double xx = lane_sum(sum_xx), xy = lane_sum(sum_xy), yy = lane_sum(sum_yy), tt = lane_sum(sum_tt);
    const double tx = lane_sum(sum_tx), ty = lane_sum(sum_ty);
    const double determinant = xx * yy - xy * xy, trace = xx + yy;
    if (!(0.5 * (trace - std::sqrt(std::max(0.0, trace * trace - 4.0 * determinant))) >= weakest)) return false;

    // The image around the expected position, sampled at pixels of the patch.
    constexpr int window = side + 2 * (around + 1), margin = line_kernel::reach, stride = window + 2 * margin + 4;
    static_assert(window == 16 && stride % 8 == 0);
    std::array<float, std::size_t{stride} * (window + 2 * margin) + 8> seen;  // a vector may extend beyond its row
    if (!sample<Target>(image, expected, by_patch, seen.data(), stride)) return false;
    float there[window][16];
    by_patch.apply<window, Target>(seen.data() + margin * stride + margin, stride, there[0]);

    found = {zeros<vec2>(), 0.0};
    for (int k = 0; k != most_iterations; ++k) {
      const double px = found.shift.x() + around + 1, py = found.shift.y() + around + 1;
      const int left = static_cast<int>(px), top = static_cast<int>(py);
      const lanes fx(static_cast<float>(px - left)), fy(static_cast<float>(py - top));
      lanes values_here[side], sum(0.0F);
      lanes above = lanes::load(&there[top][left]);
      above += fx * (lanes::load(&there[top][left + 1]) - above);
      for (int y = 0; y != side; ++y) {
        lanes below = lanes::load(&there[top + y + 1][left]);
        below += fx * (lanes::load(&there[top + y + 1][left + 1]) - below);
        values_here[y] = above + fy * (below - above);
        sum += values_here[y];
        above = below;
      }
      const lanes mean(share * simd::sum(sum));
      lanes sum_ii(0.0F), sum_it(0.0F), sum_ix(0.0F), sum_iy(0.0F);
      for (int y = 0; y != side; ++y) {
        const lanes v = values_here[y] - mean;
        sum_ii += v * v, sum_it += v * t[y], sum_ix += v * gx[y], sum_iy += v * gy[y];
      }
      const double ii = lane_sum(sum_ii);
      if (!(ii > 0.0)) return false;
      found.correlation = lane_sum(sum_it) / std::sqrt(ii * tt);
      const double contrast = std::sqrt(tt / ii);
      const double bx = contrast * lane_sum(sum_ix) - tx, by = contrast * lane_sum(sum_iy) - ty;
      const vec2 step((yy * bx - xy * by) / determinant, (xx * by - xy * bx) / determinant);
      found.shift = {found.shift.x() - step.x(), found.shift.y() - step.y()};
      if (!(std::abs(found.shift.x()) < around && std::abs(found.shift.y()) < around)) return false;
      if (step.x() * step.x() + step.y() * step.y() < enough * enough) return true;
    }
    return false;
  }

 private:
  template <class L>
  static ORBIS_ALWAYS_INLINE double lane_sum(const L& v) {
    return static_cast<double>(simd::sum(v));
  }
  /// Samples the image at the patch pixels that `by_patch` needs. `to`: the samples, starting at patch coordinate
  /// -(8 + margin), in rows `stride` apart. Returns false if one of these pixels is outside the image.
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE bool sample(image_view<const std::uint8_t> image, const patch_placement& expected,
                                         const line_kernel& by_patch, float* to, int stride) {
    using lanes = simd::vec<float, 8, Target>;
    using integers = simd::vec<std::int32_t, 8, Target>;
    constexpr int window = 16, margin = line_kernel::reach, side = window + 2 * margin;
    const auto place = [&](int x, int y) {
      const double u = x - 0.5 * (side - 1), v = y - 0.5 * (side - 1);
      return vec2(expected.centre.x() + u * expected.across.x() + v * expected.down.x(),
                  expected.centre.y() + u * expected.across.y() + v * expected.down.y());
    };
    const int x0 = margin - by_patch.reach_x(), x1 = side - x0, y0 = margin - by_patch.reach_y(), y1 = side - y0;
    for (const int x : {x0, x1 - 1})
      for (const int y : {y0, y1 - 1}) {
        const vec2 corner = place(x, y);
        if (!(corner.x() >= 0.01 && corner.y() >= 0.01 && corner.x() < image.width() - 1.01 &&
              corner.y() < image.height() - 1.01))
          return false;
      }
    // Lanes beyond x1 are clamped to the image and not used.
    const lanes right(static_cast<float>(image.width()) - 1.01F), bottom(static_cast<float>(image.height()) - 1.01F);
    alignas(32) constexpr std::array<float, 8> ramp{0, 1, 2, 3, 4, 5, 6, 7};
    const lanes along = lanes::load(ramp.data());
    const lanes step_x = along * lanes(static_cast<float>(expected.across.x()));
    const lanes step_y = along * lanes(static_cast<float>(expected.across.y()));
    for (int y = y0; y != y1; ++y)
      for (int x = x0; x < x1; x += 8) {
        const vec2 begin = place(x, y);
        const lanes u = max(lanes(0.0F), min(right, lanes(static_cast<float>(begin.x())) + step_x));
        const lanes v = max(lanes(0.0F), min(bottom, lanes(static_cast<float>(begin.y())) + step_y));
        const integers left = simd::convert<std::int32_t>(u), top = simd::convert<std::int32_t>(v);
        // Reading two neighbouring pixels of a row at once halves the number of loads, which take half of the time.
        std::array<std::int32_t, 8> columns, rows;
        std::array<std::uint16_t, 8> upper_pairs, lower_pairs;
        left.store(columns.data()), top.store(rows.data());
        for (std::size_t k = 0; k != 8; ++k) {
          const std::uint8_t* const at = &image(columns[k], rows[k]);
          std::memcpy(&upper_pairs[k], at, 2);
          std::memcpy(&lower_pairs[k], at + image.stride(), 2);
        }
        const lanes fx = u - simd::convert<float>(left), fy = v - simd::convert<float>(top);
        constexpr int first_bit = std::endian::native == std::endian::little ? 0 : 8;  // of the left pixel
        const auto between = [&](const std::array<std::uint16_t, 8>& pairs) ORBIS_INLINE_LAMBDA {
          const integers both = simd::convert<std::int32_t>(simd::vec<std::uint16_t, 8, Target>::load(pairs.data()));
          const lanes first = simd::convert<float>((both >> first_bit) & integers(255));
          const lanes second = simd::convert<float>((both >> (8 - first_bit)) & integers(255));
          return first + fx * (second - first);
        };
        const lanes upper = between(upper_pairs), lower = between(lower_pairs);
        (upper + fy * (lower - upper)).store(to + y * stride + x);
      }
    return true;
  }
};

/// Measures the position of a patch in `image`, at most three pixels of the patch from the expected position. Both are
/// blurred by motion: the patch by `patch_smear`, the image by `image_smear` (in pixels of the patch). Each is
/// additionally blurred by the motion of the other, which makes both equal: blur along two lines does not depend on
/// their order. Patch and image may differ in mean and contrast. Empty if the patch lacks texture in some direction,
/// leaves the image, or is not found.
///
/// Sources: S. Baker, I. Matthews, "Lucas-Kanade 20 years on", IJCV 56 (2004), for the inverse compositional steps;
/// H. Jin, P. Favaro, R. Cipolla, "Visual tracking in the presence of motion blur", CVPR 2005, for blurring the patch.
[[nodiscard]] inline std::optional<patch_shift> match_patch(const landmark_patch& patch, const vec2& patch_smear,
                                                            const vec2& image_smear,
                                                            image_view<const std::uint8_t> image,
                                                            const patch_placement& expected) {
  const auto match = simd::kernel<match_patch_kernel, match_patch_kernel::signature>();
  patch_shift found{};
  if (!match(*patch.pixels, line_kernel(image_smear), line_kernel(patch_smear), image, expected, found))
    return std::nullopt;
  return found;
}

}  // namespace orbis::slam::detail
