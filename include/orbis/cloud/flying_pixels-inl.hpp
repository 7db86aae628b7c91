// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of flying_pixels.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>

#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud {

namespace detail {

/// Inverse depths of sixteen adjacent pixels, and of the pixels at distances `reach` and 2 `reach` on either side.
struct flying_lines {
  const float* center;
  const float* before;
  const float* before_that;
  const float* after;
  const float* after_that;
};

struct flying_limits {
  float noise;       ///< sigmas * noise, 1 / metre
  float resolution;  ///< sigmas * resolution, metres
  float jump;
  float margin;
};

/// Largest difference of inverse depths that noise can explain.
ORBIS_ALWAYS_INLINE float flying_tolerance(float w, const flying_limits& limits) noexcept {
  const float quantised = limits.resolution * (w * w);
  return quantised < limits.noise ? limits.noise : quantised;
}

/// Returns all ones if `x > y`, else 0.
ORBIS_ALWAYS_INLINE std::uint32_t exceeds(float x, float y) noexcept { return x > y ? ~0U : 0U; }

/// Returns 0 if `x == y`, else all ones.
ORBIS_ALWAYS_INLINE std::uint32_t differ(float x, float y) noexcept { return x == y ? 0U : ~0U; }

/// Returns `x` if `mask` is all ones, 0 if it is 0.
ORBIS_ALWAYS_INLINE float masked(float x, std::uint32_t mask) noexcept {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) & mask);
}

/// Sets `flags[i]` if pixel i lies between the two surfaces next to it. Compilers vectorise the loops. No sum contains
/// a product, so no operations are fused, and the result is the same on every processor.
struct flag_between {
  template <simd::target>
  static ORBIS_ALWAYS_INLINE void run(const flying_lines& l, const flying_limits& limits, std::uint32_t* flags) {
    for (std::size_t i = 0; i != flying_pixel_workspace::lanes; ++i) {
      const float w = l.center[i];
      const float a = l.before[i];
      const float b = l.after[i];
      // Slopes over `reach` pixels. If the slope on one side is unknown, that of the other side is used. Values outside
      // the image are NaN, as are differences with them, so all comparisons are false.
      const std::uint32_t a_known = exceeds(a, 0.0F) & differ(l.before_that[i], 0.0F);
      const std::uint32_t b_known = exceeds(b, 0.0F) & differ(l.after_that[i], 0.0F);
      const float a_own = masked(a - l.before_that[i], a_known);
      const float b_own = masked(b - l.after_that[i], b_known);
      const float a_slope = a_own - masked(b_own, ~a_known);
      const float b_slope = b_own - masked(a_own, ~b_known);
      const float a_here = a + a_slope;
      const float b_here = b + b_slope;
      // At the pixel, a surface may have its sampled value, its extrapolated value, or any value between the two.
      const float a_low = a < a_here ? a : a_here;
      const float a_high = a_here < a ? a : a_here;
      const float b_low = b < b_here ? b : b_here;
      const float b_high = b_here < b ? b : b_here;
      const float tolerance = flying_tolerance(w, limits);
      const float share = limits.margin * std::abs(a - b);
      const float clear = tolerance < share ? share : tolerance;
      // A difference that the slopes explain over this distance is not an edge.
      const float steep = std::abs(a_slope) + std::abs(b_slope);
      const float far_apart = limits.jump * tolerance;
      const float jump = far_apart < steep ? steep : far_apart;
      const std::uint32_t falls =
          exceeds(a_low - b_high, jump) & exceeds(a_low - w, clear) & exceeds(w - b_high, clear);
      const std::uint32_t rises =
          exceeds(b_low - a_high, jump) & exceeds(b_low - w, clear) & exceeds(w - a_high, clear);
      flags[i] |= exceeds(w, 0.0F) & (falls | rises);
    }
  }
};

/// Returns the number of neighbours (of eight) with the same depth as the pixel at `center`.
[[nodiscard]] inline int flying_support(const float* center, std::ptrdiff_t stride, float tolerance) noexcept {
  int count = -1;  // the pixel itself
  for (std::ptrdiff_t y = -1; y <= 1; ++y) {
    for (std::ptrdiff_t x = -1; x <= 1; ++x) {
      count += std::abs(center[y * stride + x] - *center) <= tolerance ? 1 : 0;
    }
  }
  return count;
}

template <execution_policy Policy>
flying_pixel_count read_without_flying_pixels(const Policy& policy, const depth_row_reader& depth,
                                              image_view<float> out, const flying_pixel_options& options,
                                              flying_pixel_workspace& workspace) {
  const int width = out.width();
  const int height = out.height();
  constexpr int lanes = flying_pixel_workspace::lanes;
  constexpr std::size_t grain = 32;
  const int border = 2 * options.reach;
  const image_view<float> inverse = workspace.inverse(width, height, border);
  const auto counts = workspace.counts(height);
  for_each_index(policy, counts.size(), grain, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    float* const z = out.row(y).data();
    depth.read(depth.depth, y, width, z);  // the output may overwrite the input
    float* const w = &inverse(border, y + border);
    std::uint32_t valid = 0;
    for (int x = 0; x != width; ++x) {
      const std::uint32_t known = exceeds(z[x], 0.0F) & exceeds(std::numeric_limits<float>::infinity(), z[x]);
      z[x] = masked(z[x], known);
      w[x] = masked(1.0F / z[x], known);
      valid += known & 1U;
    }
    counts[row].valid = valid;
  });

  const flying_limits limits{static_cast<float>(options.sigmas * options.noise),
                             static_cast<float>(options.sigmas * options.resolution), static_cast<float>(options.jump),
                             static_cast<float>(options.margin)};
  auto* const flag = simd::kernel<flag_between, void(const flying_lines&, const flying_limits&, std::uint32_t*)>();
  const std::ptrdiff_t stride = inverse.stride();
  const std::ptrdiff_t reach = options.reach;
  for_each_index(policy, counts.size(), grain, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    float* const z = out.row(y).data();
    const float* const w = &inverse(border, y + border);
    for (int x = 0; x < width; x += lanes) {
      std::array<std::uint32_t, lanes> flags{};
      const float* const p = w + x;
      flag({p, p - reach, p - 2 * reach, p + reach, p + 2 * reach}, limits, flags.data());
      flag({p, p - reach * stride, p - 2 * reach * stride, p + reach * stride, p + 2 * reach * stride}, limits,
           flags.data());
      std::array<std::uint64_t, lanes / 2> pairs;
      std::memcpy(pairs.data(), flags.data(), sizeof pairs);
      std::uint64_t any = 0;
      for (const std::uint64_t pair : pairs) any |= pair;
      if (any == 0) continue;
      for (int i = 0; i != std::min(lanes, width - x); ++i) {
        if (flags[static_cast<std::size_t>(i)] == 0) continue;
        if (flying_support(p + i, stride, flying_tolerance(p[i], limits)) >= options.support) continue;
        z[x + i] = 0.0F;
        ++counts[row].removed;
      }
    }
  });
  flying_pixel_count total;
  for (const flying_pixel_count& c : counts) {
    total.valid += c.valid;
    total.removed += c.removed;
  }
  return total;
}

}  // namespace detail

}  // namespace orbis::cloud
