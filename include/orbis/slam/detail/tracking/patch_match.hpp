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
    const double share = 1.0 / steps, end = 0.5 - 0.5 * share;
    reach_x_ = static_cast<int>(std::ceil(end * std::abs(line.x())));
    reach_y_ = static_cast<int>(std::ceil(end * std::abs(line.y())));
    const int columns = 2 * reach_x_ + 2, rows = 2 * reach_y_ + 2;  // one more for the neighbour of the last pixel
    std::array<float, std::size_t{side + 1} * (side + 1)> dense;
    std::fill_n(dense.begin(), columns * rows, 0.0F);
    for (int k = 0; k != steps; ++k) {
      const double t = (k + 0.5) * share - 0.5, x = reach_x_ + t * line.x(), y = reach_y_ + t * line.y();
      const int left = static_cast<int>(x), top = static_cast<int>(y);
      const double fx = x - left, fy = share * (y - top);
      const auto cell = static_cast<std::size_t>(top * columns + left),
                 below = cell + static_cast<std::size_t>(columns);
      dense[cell] += static_cast<float>((1.0 - fx) * (share - fy));
      dense[cell + 1] += static_cast<float>(fx * (share - fy));
      dense[below] += static_cast<float>((1.0 - fx) * fy);
      dense[below + 1] += static_cast<float>(fx * fy);
    }
    for (int y = 0; y + 1 != rows; ++y)
      for (int x = 0; x + 1 != columns; ++x)
        if (const float w = dense[static_cast<std::size_t>(y * columns + x)]; w > 0.0F)
          weights_[count_++] = {x - reach_x_, y - reach_y_, w};
  }

  /// The horizontal and vertical distances of the farthest pixels.
  [[nodiscard]] int reach_x() const noexcept { return reach_x_; }
  [[nodiscard]] int reach_y() const noexcept { return reach_y_; }

  /// Sets `rows` rows of `columns` values at `to`, 16 values apart, to the weighted means around the values starting at
  /// `from`, whose rows are `stride` apart. @pre 8 <= columns <= 16
  template <simd::target Target>
  ORBIS_ALWAYS_INLINE void apply(int rows, int columns, const float* from, std::ptrdiff_t stride, float* to) const {
    using lanes = simd::vec<float, 8, Target>;
    const int second = columns - 8;  // the two vectors may overlap
    for (int y = 0; y != rows; ++y, from += stride, to += 16) {
      lanes left(0.0F), right(0.0F);
      for (std::size_t k = 0; k != count_; ++k) {
        const float* const row = from + weights_[k].y * stride + weights_[k].x;
        left += lanes(weights_[k].weight) * lanes::load(row);
        right += lanes(weights_[k].weight) * lanes::load(row + second);
      }
      left.store(to), right.store(to + second);
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
    constexpr double weakest = 64.0;  // smallest eigenvalue of the sum of squared gradients, grey levels squared
    constexpr int most_iterations = 12;
    constexpr double enough = 0.01;  // pixels

    // The blurred centre of the patch, with a border for the gradient.
    constexpr int size = landmark_patch::size, first = (size - side) / 2 - 1;
    std::array<float, std::size_t{size} * size> values;
    const int rows = side + 2 + 2 * by_image.reach_y(), begin = size * (size - rows) / 2;
    for (int k = begin; k != begin + size * rows; ++k)
      values[static_cast<std::size_t>(k)] = static_cast<float>(pixels[static_cast<std::size_t>(k)]);
    float blurred[10][16];
    by_image.apply<Target>(10, 10, values.data() + first * size + first, size, blurred[0]);
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

    // The image at the pixels of the patch, with the expected position in the middle. Most shifts are below one pixel:
    // a wider region is sampled only if a step leaves it.
    float there[window][window];
    int around = 1;
    if (!sample<Target>(image, expected, by_patch, around, there)) return false;

    found = {zeros<vec2>(), 0.0};
    for (int k = 0; k != most_iterations; ++k) {
      const double px = found.shift.x() + farthest + 1, py = found.shift.y() + farthest + 1;
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
      const double shift = std::max(std::abs(found.shift.x()), std::abs(found.shift.y()));
      if (!(shift < farthest)) return false;
      if (step.x() * step.x() + step.y() * step.y() < enough * enough) return true;
      if (shift < around) continue;
      around = farthest;
      if (!sample<Target>(image, expected, by_patch, around, there)) return false;
    }
    return false;
  }

 private:
  static constexpr int side = 8;      ///< size of the compared region: a row is one vector
  static constexpr int farthest = 3;  ///< maximum shift, pixels
  static constexpr int window = side + 2 * (farthest + 1);
  static_assert(window == 16);  // as `line_kernel::apply` expects

  template <class L>
  static ORBIS_ALWAYS_INLINE double lane_sum(const L& v) {
    return static_cast<double>(simd::sum(v));
  }
  /// Samples the image at the pixels of the patch for shifts of up to `around` pixels, and blurs the samples by
  /// `by_patch`. `to`: the pixels around the centre, of which those that are needed are set. Returns false if a sample
  /// is outside the image.
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE bool sample(image_view<const std::uint8_t> image, const patch_placement& expected,
                                         const line_kernel& by_patch, int around, float (*to)[window]) {
    using lanes = simd::vec<float, 8, Target>;
    using integers = simd::vec<std::int32_t, 8, Target>;
    constexpr int margin = line_kernel::reach, stride = window + 2 * margin;
    const int first = farthest + 1 - around, count = side + 2 * around;  // rows and columns of `to`
    const auto place = [&](int x, int y) {
      const double u = x - 0.5 * (stride - 1), v = y - 0.5 * (stride - 1);
      return vec2(expected.centre.x() + u * expected.across.x() + v * expected.down.x(),
                  expected.centre.y() + u * expected.across.y() + v * expected.down.y());
    };
    const int x0 = margin + first - by_patch.reach_x(), x1 = margin + first + count + by_patch.reach_x();
    const int y0 = margin + first - by_patch.reach_y(), y1 = margin + first + count + by_patch.reach_y();
    for (const int x : {x0, x1 - 1})
      for (const int y : {y0, y1 - 1}) {
        const vec2 corner = place(x, y);
        if (!(corner.x() >= 0.01 && corner.y() >= 0.01 && corner.x() < image.width() - 1.01 &&
              corner.y() < image.height() - 1.01))
          return false;
      }
    alignas(32) constexpr std::array<float, 8> ramp{0, 1, 2, 3, 4, 5, 6, 7};
    const lanes along = lanes::load(ramp.data());
    const lanes step_x = along * lanes(static_cast<float>(expected.across.x()));
    const lanes step_y = along * lanes(static_cast<float>(expected.across.y()));
    const integers image_stride(static_cast<std::int32_t>(image.stride()));
    std::array<float, std::size_t{stride} * stride> samples;
    for (int y = y0; y != y1; ++y)
      for (int next = x0; next < x1; next += 8) {
        const int x = std::min(next, x1 - 8);
        const vec2 begin = place(x, y);
        const lanes u = lanes(static_cast<float>(begin.x())) + step_x,
                    v = lanes(static_cast<float>(begin.y())) + step_y;
        const integers left = simd::convert<std::int32_t>(u), top = simd::convert<std::int32_t>(v);
        // Reading two neighbouring pixels of a row at once halves the number of loads, which take half of the time.
        std::array<std::int32_t, 8> offsets;
        std::array<std::uint16_t, 8> upper_pairs, lower_pairs;
        (top * image_stride + left).store(offsets.data());
        for (std::size_t k = 0; k != 8; ++k) {
          const std::uint8_t* const at = image.data() + offsets[k];
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
        (upper + fy * (lower - upper)).store(&samples[static_cast<std::size_t>(y * stride + x)]);
      }
    by_patch.apply<Target>(count, count, &samples[static_cast<std::size_t>((margin + first) * (stride + 1))], stride,
                           &to[first][first]);
    return true;
  }
};

/// Measures the position of a patch in `image`, at most three pixels of the patch from the expected position. Both are
/// blurred by motion: the patch by `patch_smear`, the image by `image_smear` (in pixels of the patch). Each is
/// additionally blurred by the motion of the other, which makes both equal: blur along two lines does not depend on
/// their order. Patch and image may differ in mean and contrast. Empty if the patch lacks texture in some direction,
/// leaves the image, or is not found. The image must contain the pixels that the search needs: those for shifts of up
/// to one pixel and, if a step goes beyond, of up to three.
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
