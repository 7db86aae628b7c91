// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Binary descriptors from brightness comparisons in a rotated pattern.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/extract/orb_parts.hpp>
#include <orbis/features/detail/extract/smooth.hpp>
#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

/// Two pixels relative to a keypoint: the test is true if the second is brighter than the first.
struct brightness_test {
  std::int8_t x0, y0, x1, y1;
};

/// The 256 tests of the ORB paper (chosen for high variance and low correlation), in the order that all implementations
/// use, so that vocabularies and descriptors are compatible. Determined from an implementation's responses to single
/// bright and dark pixels.
// clang-format off
inline constexpr std::array<brightness_test, 256> orb_pattern{{
    {8, -3, 9, 5}, {4, 2, 7, -12}, {-11, 9, -8, 2}, {7, -12, 12, -13}, {2, -13, 2, 12}, {1, -7, 1, 6},
    {-2, -10, -2, -4}, {-13, -13, -11, -8}, {-13, -3, -12, -9}, {10, 4, 11, 9}, {-13, -8, -8, -9}, {-11, 7, -9, 12},
    {7, 7, 12, 6}, {-4, -5, -3, 0}, {-13, 2, -12, -3}, {-9, 0, -7, 5}, {12, -6, 12, -1}, {-3, 6, -2, 12},
    {-6, -13, -4, -8}, {11, -13, 12, -8}, {4, 7, 5, 1}, {5, -3, 10, -3}, {3, -7, 6, 12}, {-8, -7, -6, -2},
    {-2, 11, -1, -10}, {-13, 12, -8, 10}, {-7, 3, -5, -3}, {-4, 2, -3, 7}, {-10, -12, -6, 11}, {5, -12, 6, -7},
    {5, -6, 7, -1}, {1, 0, 4, -5}, {9, 11, 11, -13}, {4, 7, 4, 12}, {2, -1, 4, 4}, {-4, -12, -2, 7},
    {-8, -5, -7, -10}, {4, 11, 9, 12}, {0, -8, 1, -13}, {-13, -2, -8, 2}, {-3, -2, -2, 3}, {-6, 9, -4, -9},
    {8, 12, 10, 7}, {0, 9, 1, 3}, {7, -5, 11, -10}, {-13, -6, -11, 0}, {10, 7, 12, 1}, {-6, -3, -6, 12},
    {10, -9, 12, -4}, {-13, 8, -8, -12}, {-13, 0, -8, -4}, {3, 3, 7, 8}, {5, 7, 10, -7}, {-1, 7, 1, -12},
    {3, -10, 5, 6}, {2, -4, 3, -10}, {-13, 0, -13, 5}, {-13, -7, -12, 12}, {-13, 3, -11, 8}, {-7, 12, -4, 7},
    {6, -10, 12, 8}, {-9, -1, -7, -6}, {-2, -5, 0, 12}, {-12, 5, -7, 5}, {3, -10, 8, -13}, {-7, -7, -4, 5},
    {-3, -2, -1, -7}, {2, 9, 5, -11}, {-11, -13, -5, -13}, {-1, 6, 0, -1}, {5, -3, 5, 2}, {-4, -13, -4, 12},
    {-9, -6, -9, 6}, {-12, -10, -8, -4}, {10, 2, 12, -3}, {7, 12, 12, 12}, {-7, -13, -6, 5}, {-4, 9, -3, 4},
    {7, -1, 12, 2}, {-7, 6, -5, 1}, {-13, 11, -12, 5}, {-3, 7, -2, -6}, {7, -8, 12, -7}, {-13, -7, -11, -12},
    {1, -3, 12, 12}, {2, -6, 3, 0}, {-4, 3, -2, -13}, {-1, -13, 1, 9}, {7, 1, 8, -6}, {1, -1, 3, 12}, {9, 1, 12, 6},
    {-1, -9, -1, 3}, {-13, -13, -10, 5}, {7, 7, 10, 12}, {12, -5, 12, 9}, {6, 3, 7, 11}, {5, -13, 6, 10},
    {2, -12, 2, 3}, {3, 8, 4, -6}, {2, 6, 12, -13}, {9, -12, 10, 3}, {-8, 4, -7, 9}, {-11, 12, -4, -6},
    {1, 12, 2, -8}, {6, -9, 7, -4}, {2, 3, 3, -2}, {6, 3, 11, 0}, {3, -3, 8, -8}, {7, 8, 9, 3}, {-11, -5, -6, -4},
    {-10, 11, -5, 10}, {-5, -8, -3, 12}, {-10, 5, -9, 0}, {8, -1, 12, -6}, {4, -6, 6, -11}, {-10, 12, -8, 7},
    {4, -2, 6, 7}, {-2, 0, -2, 12}, {-5, -8, -5, 2}, {7, -6, 10, 12}, {-9, -13, -8, -8}, {-5, -13, -5, -2},
    {8, -8, 9, -13}, {-9, -11, -9, 0}, {1, -8, 1, -2}, {7, -4, 9, 1}, {-2, 1, -1, -4}, {11, -6, 12, -11},
    {-12, -9, -6, 4}, {3, 7, 7, 12}, {5, 5, 10, 8}, {0, -4, 2, 8}, {-9, 12, -5, -13}, {0, 7, 2, 12}, {-1, 2, 1, 7},
    {5, 11, 7, -9}, {3, 5, 6, -8}, {-13, -4, -8, 9}, {-5, 9, -3, -3}, {-4, -7, -3, -12}, {6, 5, 8, 0},
    {-7, 6, -6, 12}, {-13, 6, -5, -2}, {1, -10, 3, 10}, {4, 1, 8, -4}, {-2, -2, 2, -13}, {2, -12, 12, 12},
    {-2, -13, 0, -6}, {4, 1, 9, 3}, {-6, -10, -3, -5}, {-3, -13, -1, 1}, {7, 5, 12, -11}, {4, -2, 5, -7},
    {-13, 9, -9, -5}, {7, 1, 8, 6}, {7, -8, 7, 6}, {-7, -4, -7, 1}, {-8, 11, -7, -8}, {-13, 6, -12, -8}, {2, 4, 3, 9},
    {10, -5, 12, 3}, {-6, -5, -6, 7}, {8, -3, 9, -8}, {2, -12, 2, 8}, {-11, -2, -10, 3}, {-12, -13, -7, -9},
    {-11, 0, -10, -5}, {5, -3, 11, 8}, {-2, -13, -1, 12}, {-1, -8, 0, 9}, {-13, -11, -12, -5}, {-10, -2, -10, 11},
    {-3, 9, -2, -13}, {2, -3, 3, 2}, {-9, -13, -4, 0}, {-4, 6, -3, -10}, {-4, 12, -2, -7}, {-6, -11, -4, 9},
    {6, -3, 6, 11}, {-13, 11, -5, 5}, {11, 11, 12, 6}, {7, -5, 12, -2}, {-1, 12, 0, 7}, {-4, -8, -3, -2},
    {-7, 1, -6, 7}, {-13, -12, -8, -13}, {-7, -2, -6, -8}, {-8, 5, -6, -9}, {-5, -1, -4, 5}, {-13, 7, -8, 10},
    {1, 5, 5, -13}, {1, 0, 10, -13}, {9, 12, 10, -1}, {5, -8, 10, -9}, {-1, 11, 1, -13}, {-9, -3, -6, 2},
    {-1, -10, 1, 12}, {-13, 1, -8, -10}, {8, -11, 10, -6}, {2, -13, 3, -6}, {7, -13, 12, -9}, {-10, -10, -5, -7},
    {-10, -8, -8, -13}, {4, -6, 8, 5}, {3, 12, 8, -13}, {-4, 2, -3, -3}, {5, -13, 10, -12}, {4, -13, 5, -1},
    {-9, 9, -4, 3}, {0, 3, 3, -9}, {-12, 1, -6, 1}, {3, 2, 4, -8}, {-10, -10, -10, 9}, {8, -13, 12, 12},
    {-8, -12, -6, -5}, {2, 2, 3, 7}, {10, 6, 11, -8}, {6, 8, 8, -12}, {-7, 10, -6, 5}, {-3, -9, -3, 9},
    {-1, -13, -1, 5}, {-3, -7, -3, 4}, {-8, -2, -8, 3}, {4, 2, 12, 12}, {2, -5, 3, 11}, {6, -9, 11, -13},
    {3, -1, 7, 12}, {11, -1, 12, 4}, {-3, 0, -3, 6}, {4, -11, 4, 12}, {2, -4, 2, 1}, {-10, -6, -8, 1},
    {-13, 7, -11, 1}, {-13, 12, -11, -13}, {6, 0, 11, -13}, {0, -1, 1, 4}, {-13, 3, -9, -2}, {-9, 8, -6, -3},
    {-13, -6, -8, -2}, {5, -9, 8, 10}, {2, 7, 3, -9}, {-1, -6, -1, -1}, {9, 5, 11, -2}, {11, -3, 12, -8},
    {3, 0, 3, 5}, {-1, 4, 0, 10}, {3, -6, 4, 5}, {-13, 0, -10, 5}, {5, 8, 12, 11}, {8, 9, 9, -6}, {7, -4, 8, -12},
    {-10, 4, -10, 9}, {7, 3, 12, 4}, {9, -7, 10, -2}, {7, 0, 12, -2}, {-1, -6, 0, -11}
}};
// clang-format on

/// The coordinates of the first pixels of all tests, then of the second pixels.
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

/// Adding this to a small float puts the nearest integer (ties to even) into the low bits.
inline constexpr float rounder = 12582912.0F;

/// Rotates all points and rounds them to pixels; bit i is set if the second pixel of test i is brighter than the first.
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
    // y * stride + x with the rounder's bits in both terms; they are subtracted together.
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

ORBIS_LAZY_INLINE void steered_brief::prepare(image_view<const std::uint8_t> image, int first, int last,
                                              workspace& memory) const {
  const std::ptrdiff_t stride = (static_cast<std::ptrdiff_t>(image.width()) + 63) / 64 * 64;
  const auto needed = static_cast<std::size_t>(stride) * static_cast<std::size_t>(image.height());
  if (memory.pixels.size() < needed) memory.pixels.resize(needed);
  const image_view<std::uint8_t> to{memory.pixels.data(), image.width(), image.height(), stride};
  smooth(image, to, std::max(0, first - reach), std::min(image.height(), last + reach), memory.smoothing);
  memory.smoothed = to;
}

ORBIS_LAZY_INLINE steered_brief::descriptor steered_brief::operator()(const workspace& prepared, int x, int y,
                                                                      const orientation& o) const {
  const image_view<const std::uint8_t>& image = prepared.smoothed;
  assert(x >= reach && y >= reach && x + reach < image.width() && y + reach < image.height());
  const auto describe = simd::kernel<steered_brief_kernel, steered_brief_kernel::signature>();
  return describe(orb_points, o, image.data() + y * image.stride() + x, image.stride());
}

}  // namespace orbis::features::detail
