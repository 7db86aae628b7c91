// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Flying pixels of depth images: at the edge of a near surface before a far one, pixels that see both
/// measure something in between, where there is nothing.
///
/// The test works on the inverse of depth along the rows and columns of the image. Inverse depth is linear
/// over the image of a plane, however slanted, and its noise and quantisation are the same at every depth
/// for a camera that triangulates (sigma_z ~ z^2). A pixel flies if the surfaces to its two sides, each
/// extended to the pixel along its own slope, miss each other by a jump, and it lies between the two, clear
/// of both; unless enough of the pixels around it lie where it does, as on a narrow thing that really is
/// there. A missing measurement counts as infinitely far: the shadow beside a near surface is an edge, too.
///
/// Sources: M. Reynolds, J. Dobos, L. Peel, T. Weyrich, G. J. Brostow, "Capturing time-of-flight data with
/// confidence", CVPR 2011; A. Sabov, J. Krueger, "Identification and correction of flying pixels in range
/// camera data", SCCG 2008. For the noise: K. Khoshelham, S. O. Elberink, "Accuracy and resolution of Kinect
/// depth data for indoor mapping applications", Sensors 12, 2012.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/simd.hpp>

namespace orbis::cloud {

struct flying_pixel_options {
  /// Pixels to either side at which the surfaces are looked for: the widest transition that is recognised
  /// as a whole. 1 ... 8
  int reach = 2;
  double noise = 1.425e-3;    ///< deviation of inverse depth: sigma_z / z^2, 1 / metre; the default is a Kinect's
  double resolution = 0.001;  ///< least difference of depth that counts, metres
  double sigmas = 4.0;        ///< clear of a surface: by this many times the noise, or the resolution
  double jump = 3.0;          ///< an edge: by this many times as much
  double margin = 0.05;       ///< clear of a surface: by this part of the jump as well
  int support = 4;            ///< of the eight pixels around, this many at the same depth prove a thing
};

/// What was looked at and what was found.
struct flying_pixel_count {
  std::size_t valid = 0;    ///< pixels with a depth
  std::size_t removed = 0;  ///< of these
  friend bool operator==(const flying_pixel_count&, const flying_pixel_count&) = default;
};

/// Memory that calls can share, one at a time: for images of one size nothing is allocated after the first.
class flying_pixel_workspace {
 public:
  /// Inverse depth with `border` pixels around it of which nothing is known (NaN).
  image_view<float> inverse(int width, int height, int border) {
    const int padded_width = width + 2 * border + lanes;
    const int padded_height = height + 2 * border;
    if (inverse_.width() != padded_width || inverse_.height() != padded_height || border_ != border ||
        width_ != width) {
      inverse_ = image<float>(padded_width, padded_height, std::numeric_limits<float>::quiet_NaN());
      border_ = border;
      width_ = width;
    }
    return inverse_;
  }
  /// One for each row.
  std::span<flying_pixel_count> counts(int height) {
    counts_.assign(static_cast<std::size_t>(height), {});
    return counts_;
  }
  static constexpr int lanes = 16;  ///< pixels that are tested at once

 private:
  image<float> inverse_;
  std::vector<flying_pixel_count> counts_;
  int border_ = 0;
  int width_ = 0;
};

namespace detail {

/// Inverse depths of sixteen neighbouring pixels, and of those `reach` and twice `reach` away on either side.
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

/// By how much inverse depths may differ by accident.
ORBIS_ALWAYS_INLINE float flying_tolerance(float w, const flying_limits& limits) noexcept {
  const float quantised = limits.resolution * (w * w);
  return quantised < limits.noise ? limits.noise : quantised;
}

/// All ones where `x > y`.
ORBIS_ALWAYS_INLINE std::uint32_t exceeds(float x, float y) noexcept { return x > y ? ~0U : 0U; }

/// All ones unless `x == y`.
ORBIS_ALWAYS_INLINE std::uint32_t differ(float x, float y) noexcept { return x == y ? 0U : ~0U; }

/// `x` where `mask` is all ones, 0 where it is 0.
ORBIS_ALWAYS_INLINE float masked(float x, std::uint32_t mask) noexcept {
  return std::bit_cast<float>(std::bit_cast<std::uint32_t>(x) & mask);
}

/// Sets `flags[i]` where pixel i lies between the two surfaces beside it. In loops that compilers turn into
/// vector instructions; no product is added to anything, so that there is nothing to fuse, and the result is
/// the same on every processor.
struct flag_between {
  template <simd::target>
  static ORBIS_ALWAYS_INLINE void run(const flying_lines& l, const flying_limits& limits, std::uint32_t* flags) {
    for (std::size_t i = 0; i != flying_pixel_workspace::lanes; ++i) {
      const float w = l.center[i];
      const float a = l.before[i];
      const float b = l.after[i];
      // Over `reach` pixels; where one is not measured, as the surface on the other side goes on. Outside the
      // image it is no number, and so are the differences: nothing exceeds anything.
      const std::uint32_t a_known = exceeds(a, 0.0F) & differ(l.before_that[i], 0.0F);
      const std::uint32_t b_known = exceeds(b, 0.0F) & differ(l.after_that[i], 0.0F);
      const float a_own = masked(a - l.before_that[i], a_known);
      const float b_own = masked(b - l.after_that[i], b_known);
      const float a_slope = a_own - masked(b_own, ~a_known);
      const float b_slope = b_own - masked(a_own, ~b_known);
      const float a_here = a + a_slope;
      const float b_here = b + b_slope;
      // Each surface is somewhere between flat and extended.
      const float a_low = a < a_here ? a : a_here;
      const float a_high = a_here < a ? a : a_here;
      const float b_low = b < b_here ? b : b_here;
      const float b_high = b_here < b ? b : b_here;
      const float tolerance = flying_tolerance(w, limits);
      const float share = limits.margin * std::abs(a - b);
      const float clear = tolerance < share ? share : tolerance;
      // What steep surfaces do by themselves over that distance is no edge.
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

/// How many of the eight pixels around lie at the depth of the one at `center`.
[[nodiscard]] inline int flying_support(const float* center, std::ptrdiff_t stride, float tolerance) noexcept {
  int count = -1;  // the pixel itself
  for (std::ptrdiff_t y = -1; y <= 1; ++y) {
    for (std::ptrdiff_t x = -1; x <= 1; ++x) {
      count += std::abs(center[y * stride + x] - *center) <= tolerance ? 1 : 0;
    }
  }
  return count;
}

}  // namespace detail

/// Writes the depth in metres to `out`, 0 where there is none or the pixel flies. `out` may be the memory
/// that `depth` reads, if that holds metres. O(width * height); the same result for every policy and
/// processor.
/// @pre out is as large as depth; reach is 1 ... 8
template <execution_policy Policy, camera::depth_source Depth>
flying_pixel_count remove_flying_pixels(const Policy& policy, const Depth& depth, image_view<float> out,
                                        const flying_pixel_options& options, flying_pixel_workspace& workspace) {
  const int width = depth.width();
  const int height = depth.height();
  assert(out.width() == width && out.height() == height);
  assert(options.reach >= 1 && options.reach <= 8);
  constexpr int lanes = flying_pixel_workspace::lanes;
  constexpr std::size_t grain = 32;
  const int border = 2 * options.reach;
  const image_view<float> inverse = workspace.inverse(width, height, border);
  const auto counts = workspace.counts(height);
  for_each_index(policy, counts.size(), grain, [&](std::size_t row) {
    const int y = static_cast<int>(row);
    float* const z = out.row(y).data();
    for (int x = 0; x != width; ++x) z[x] = depth(x, y);  // may be in place
    float* const w = &inverse(border, y + border);
    std::uint32_t valid = 0;
    for (int x = 0; x != width; ++x) {
      const std::uint32_t known =
          detail::exceeds(z[x], 0.0F) & detail::exceeds(std::numeric_limits<float>::infinity(), z[x]);
      z[x] = detail::masked(z[x], known);
      w[x] = detail::masked(1.0F / z[x], known);
      valid += known & 1U;
    }
    counts[row].valid = valid;
  });

  const detail::flying_limits limits{static_cast<float>(options.sigmas * options.noise),
                                     static_cast<float>(options.sigmas * options.resolution),
                                     static_cast<float>(options.jump), static_cast<float>(options.margin)};
  auto* const flag = simd::kernel<detail::flag_between,
                                  void(const detail::flying_lines&, const detail::flying_limits&, std::uint32_t*)>();
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
        if (detail::flying_support(p + i, stride, detail::flying_tolerance(p[i], limits)) >= options.support) continue;
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

/// Removes flying pixels as above, with memory that is freed at the end.
template <execution_policy Policy, camera::depth_source Depth>
flying_pixel_count remove_flying_pixels(const Policy& policy, const Depth& depth, image_view<float> out,
                                        const flying_pixel_options& options = {}) {
  flying_pixel_workspace workspace;
  return remove_flying_pixels(policy, depth, out, options, workspace);
}

}  // namespace orbis::cloud

ORBIS_COMPILED_KERNEL(orbis::cloud::detail::flag_between,
                      void(const orbis::cloud::detail::flying_lines&, const orbis::cloud::detail::flying_limits&,
                           std::uint32_t*));
