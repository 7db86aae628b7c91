// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Binary descriptors by comparing brightness in a rotated pattern.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/extract/orb_pattern.hpp>
#include <orbis/features/detail/extract/orientation.hpp>
#include <orbis/features/detail/extract/smooth.hpp>
#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

/// The coordinates of the tests' first pixels, then those of their second ones.
struct alignas(64) split_pattern {
  std::array<float, 512> x;
  std::array<float, 512> y;
};
inline constexpr split_pattern orb_points = [] {
  split_pattern p{};
  for (std::size_t i = 0; i != orb_pattern.size(); ++i) {
    p.x[i] = static_cast<float>(orb_pattern[i].x0);
    p.y[i] = static_cast<float>(orb_pattern[i].y0);
    p.x[i + 256] = static_cast<float>(orb_pattern[i].x1);
    p.y[i + 256] = static_cast<float>(orb_pattern[i].y1);
  }
  return p;
}();

/// Adding it leaves the nearest integer (ties to even) in the low bits of a small float.
inline constexpr float rounder = 12582912.0F;

/// Turns all points and rounds them to pixels; bit i says whether the second pixel of test i is brighter than the
/// first.
struct steered_brief_kernel {
  using signature = binary_descriptor<256>(const split_pattern& points, const orientation& o,
                                           const std::uint8_t* centre, std::ptrdiff_t stride);
  template <class Target>
  static ORBIS_ALWAYS_INLINE binary_descriptor<256> run(const split_pattern& points, const orientation& o,
                                                        const std::uint8_t* centre, std::ptrdiff_t stride) {
    using floats = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    using bytes = simd::vec<std::uint8_t, 64, Target>;
    const floats cosine(o.cosine), sine(o.sine), magic(rounder);
    const integers step(static_cast<std::int32_t>(stride));
    // y * stride + x with the rounder's bits in both; they are taken out together.
    const integers offset(static_cast<std::int32_t>(static_cast<std::uint32_t>(std::bit_cast<std::int32_t>(rounder)) *
                                                    (static_cast<std::uint32_t>(stride) + 1)));
    alignas(64) std::array<std::int32_t, 512> at;
    for (std::size_t i = 0; i != at.size(); i += floats::count) {
      const floats px = floats::load(points.x.data() + i), py = floats::load(points.y.data() + i);
      const floats x = px * cosine - py * sine, y = px * sine + py * cosine;
      const integers ix = simd::bits_as<std::int32_t>(x + magic), iy = simd::bits_as<std::int32_t>(y + magic);
      (iy * step + ix - offset).store(at.data() + i);
    }
    alignas(64) std::array<std::uint8_t, 512> brightness;
#pragma GCC unroll 8
    for (std::size_t i = 0; i != at.size(); ++i) brightness[i] = centre[at[i]];
    binary_descriptor<256> d;
    for (std::size_t w = 0; w != d.words.size(); ++w) {
      const std::uint8_t* const first = brightness.data() + 64 * w;
      d.words[w] = bits(bytes::load(first) < bytes::load(first + 256));
    }
    return d;
  }
};

/// ORB's descriptor: the standard pattern, turned to the keypoint's direction and rounded to pixels,
/// on the image smoothed by a Gaussian (7x7, sigma 2). The same bits as OpenCV's ORB wherever the direction is the
/// same.
struct steered_brief {
  using descriptor = binary_descriptor<256>;
  static constexpr int reach = 18;     ///< of the turned pattern, pixels
  static constexpr int diameter = 31;  ///< of the described neighbourhood, by convention

  struct workspace {
    std::vector<std::uint8_t> pixels;
    image_view<const std::uint8_t> smoothed;
    smooth_workspace smoothing;
  };

  /// Smooths what descriptors of keypoints in rows `[first, last)` need. @pre image of at least 4x4 pixels
  void prepare(image_view<const std::uint8_t> image, int first, int last, workspace& memory) const {
    const std::ptrdiff_t stride = (static_cast<std::ptrdiff_t>(image.width()) + 63) / 64 * 64;
    const auto needed = static_cast<std::size_t>(stride) * static_cast<std::size_t>(image.height());
    if (memory.pixels.size() < needed) memory.pixels.resize(needed);
    const image_view<std::uint8_t> to{memory.pixels.data(), image.width(), image.height(), stride};
    smooth(image, to, std::max(0, first - reach), std::min(image.height(), last + reach), memory.smoothing);
    memory.smoothed = to;
  }

  /// @pre at least `reach` pixels from the edge of the prepared image, in its prepared rows
  [[nodiscard]] descriptor operator()(const workspace& prepared, int x, int y, const orientation& o) const {
    const image_view<const std::uint8_t>& image = prepared.smoothed;
    assert(x >= reach && y >= reach && x + reach < image.width() && y + reach < image.height());
    const auto describe = simd::kernel<steered_brief_kernel, steered_brief_kernel::signature>();
    return describe(orb_points, o, image.data() + y * image.stride() + x, image.stride());
  }
};
static_assert(patch_descriptor<steered_brief>);

}  // namespace orbis::features::detail

ORBIS_COMPILED_KERNEL(orbis::features::detail::steered_brief_kernel,
                      orbis::features::detail::steered_brief_kernel::signature);
