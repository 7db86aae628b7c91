// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Kernels that resample images at warped pixels.
#pragma once

#include <cstddef>
#include <cstdint>

#include <orbis/camera/detail/shutter/row_warp.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::camera::detail {

/// Computes the memory offset of the pixel nearest to each position, or -1 outside the image.
struct nearest_pixels_kernel {
  struct arguments {
    std::size_t count;  ///< number of pixels, a multiple of warp_cell
    int width, height;
    std::int32_t stride;  ///< row stride of the image in memory
    const float *x, *y;
    std::int32_t* index;
  };
  using signature = void(const arguments&);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const arguments& a) {
    using lanes = simd::vec<float, warp_cell, Target>;
    using numbers = simd::vec<std::int32_t, warp_cell, Target>;
    const lanes right(static_cast<float>(a.width)), bottom(static_cast<float>(a.height));
    for (std::size_t i = 0; i != a.count; i += warp_cell) {
      const lanes x = lanes::load(a.x + i) + 0.5F, y = lanes::load(a.y + i) + 0.5F;
      const auto inside = (x >= lanes(0.0F)) & (x < right) & (y >= lanes(0.0F)) & (y < bottom);
      const numbers px = simd::convert<std::int32_t>(select(inside, x, lanes(0.0F)));
      const numbers py = simd::convert<std::int32_t>(select(inside, y, lanes(0.0F)));
      select(inside, px + py * numbers(a.stride), numbers(-1)).store(a.index + i);
    }
  }
};

/// Maximum relative difference in inverse depth between neighbouring pixels on one surface.
inline constexpr float same_surface = 0.03F;

/// Interpolates inverse depth linearly between pixels, using only pixels that lie on the target surface.
struct read_surface_kernel {
  struct arguments {
    std::size_t count;  ///< number of pixels, a multiple of warp_cell
    int width, height;
    const float* surface;  ///< inverse depth of the target surface
    const float *x, *y;    ///< position at which the target surface was observed
    const float* ratio;    ///< ratio of the depth at (x, y) to the depth at this pixel
    const float* inverse;  ///< inverse depth of the original image, with a border of one zero pixel
    float* metres;         ///< 0 where undefined
  };
  using signature = void(const arguments&);

  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const arguments& a) {
    using lanes = simd::vec<float, warp_cell, Target>;
    using numbers = simd::vec<std::int32_t, warp_cell, Target>;
    const lanes zero(0.0F), one(1.0F);
    const lanes right(static_cast<float>(a.width + 1)), bottom(static_cast<float>(a.height + 1));
    const std::int32_t stride = a.width + 2;
    for (std::size_t i = 0; i != a.count; i += warp_cell) {
      const lanes x = lanes::load(a.x + i) + one, y = lanes::load(a.y + i) + one;  // in the padded image
      const lanes ratio = lanes::load(a.ratio + i), here = lanes::load(a.surface + i);
      const auto inside = (x > zero) & (x < right) & (y > zero) & (y < bottom) & (here > zero) & (ratio > zero);
      if (none(inside)) {
        zero.store(a.metres + i);
        continue;
      }
      const lanes px = select(inside, x, zero), py = select(inside, y, zero);
      const numbers x0 = simd::convert<std::int32_t>(px), y0 = simd::convert<std::int32_t>(py);
      const lanes u = px - simd::convert<float>(x0), v = py - simd::convert<float>(y0);
      const numbers at = x0 + y0 * numbers(stride);
      const lanes surface = select(inside, here, one) / select(inside, ratio, one);
      const lanes most = surface * lanes(same_surface);
      lanes sum = zero, weights = zero;
      const auto add = [&](const numbers& place, const lanes& weight) ORBIS_INLINE_LAMBDA {
        const lanes read = simd::gather(a.inverse, place);
        const lanes used = select(simd::abs(read - surface) < most, weight, zero);
        sum += used * read;
        weights += used;
      };
      add(at, (one - u) * (one - v));
      add(at + numbers(1), u * (one - v));
      add(at + numbers(stride), (one - u) * v);
      add(at + numbers(stride + 1), u * v);
      constexpr float least = 0.24F;  // weight of a pixel that is half a pixel off in both directions, with a margin
      const auto found = inside & (weights >= lanes(least));
      // 1 / (sum / weights * ratio)
      select(found, weights / select(found, sum * ratio, one), zero).store(a.metres + i);
    }
  }
};

}  // namespace orbis::camera::detail
