// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of depth_smoothing.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <limits>
#include <span>

#include <orbis/cloud/depth_smoothing.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// Maximum number of floats in a native vector.
inline constexpr std::size_t widest_vector = 16;

/// A pair of opposite pixels.
struct pixel_pair {
  std::ptrdiff_t offset;  ///< of one pixel in the padded image; the other is at the negative offset
  float steepest;         ///< maximum relative difference of inverse depth from the pixel in the middle
};

struct smoothing_limits {
  float noise;       ///< maximum difference between the sum of a pair and twice the pixel, 1 / metre
  float resolution;  ///< as above, for quantisation: metres
};

/// Writes the smoothed depths of a row of `width` pixels. `center`: their inverse depths, NaN where unknown, followed
/// by as many values as a vector has.
struct smooth_row {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* center, int width, std::span<const pixel_pair> pairs,
                                      const smoothing_limits& limits, float* depth) {
    using lanes = simd::native_vec<float, Target>;
    static_assert(lanes::count <= widest_vector);
    const lanes zero(0.0F), one(1.0F);
    for (int x = 0; x < width; x += static_cast<int>(lanes::count), center += lanes::count) {
      const lanes w = lanes::load(center), twice = w + w;
      const lanes apart = max(lanes(limits.noise), lanes(limits.resolution) * (w * w));
      lanes sum = w, agreed = zero;
      for (const pixel_pair& pair : pairs) {
        const lanes before = lanes::load(center - pair.offset), after = lanes::load(center + pair.offset);
        const lanes both = before + after, slope = max(apart, lanes(pair.steepest) * w);
        const auto agrees = (abs(both - twice) < apart) & (abs(before - w) < slope);
        sum = sum + select(agrees, both, zero);
        agreed = agreed + select(agrees, one, zero);
      }
      const lanes mean = (agreed + agreed + one) / sum;
      select(w > zero, mean, zero).store(depth + x, std::min(lanes::count, static_cast<std::size_t>(width - x)));
    }
  }
};

template <execution_policy Policy>
void write_smoothed_depth(const Policy& policy, const depth_row_reader& depth, image_view<float> out,
                          const depth_smoothing_options& options, image<float>& memory) {
  const int width = out.width(), height = out.height(), radius = options.radius;
  const int padded_width = width + 2 * radius + static_cast<int>(widest_vector), padded_height = height + 2 * radius;
  constexpr float unknown = std::numeric_limits<float>::quiet_NaN();
  if (memory.width() != padded_width || memory.height() != padded_height)
    memory = image<float>(padded_width, padded_height);
  constexpr std::size_t grain = 32;
  for_each_index(policy, static_cast<std::size_t>(padded_height), grain, [&](std::size_t row) {
    const int y = static_cast<int>(row) - radius;
    float* const w = &memory(0, static_cast<int>(row));
    std::fill_n(w, padded_width, unknown);
    if (y < 0 || y >= height) return;
    depth.read(depth.depth, y, width, w + radius);
    for (int x = radius; x != radius + width; ++x)
      w[x] = w[x] > 0.0F && w[x] < std::numeric_limits<float>::infinity() ? 1.0F / w[x] : unknown;
  });

  std::array<pixel_pair, (17 * 17 - 1) / 2> pairs;  // of the square around the largest disc
  std::size_t count = 0;
  const std::ptrdiff_t stride = image_view<float>(memory).stride();
  for (int dy = 0; dy <= radius; ++dy)
    for (int dx = dy == 0 ? 1 : -radius; dx <= radius; ++dx)
      if (dx * dx + dy * dy <= radius * radius + 1)
        pairs[count++] = {dy * stride + dx, static_cast<float>(options.steepest * std::max(std::abs(dx), dy))};
  const double of_sum = std::sqrt(6.0) * options.sigmas;  // of the sum of a pair minus twice the pixel
  const smoothing_limits limits{static_cast<float>(of_sum * options.noise),
                                static_cast<float>(of_sum * 0.5 * options.resolution)};  // rounded by up to half a step
  auto* const smooth =
      simd::kernel<smooth_row, void(const float*, int, std::span<const pixel_pair>, const smoothing_limits&, float*)>();
  for_each_index(policy, static_cast<std::size_t>(height), grain, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    smooth(&memory(radius, y + radius), width, {pairs.data(), count}, limits, out.row(y).data());
  });
}

}  // namespace orbis::cloud::detail
