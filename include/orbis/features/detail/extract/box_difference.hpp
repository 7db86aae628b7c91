// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Binary descriptors by comparing the mean brightness of boxes.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/extract/orientation.hpp>
#include <orbis/features/detail/extract/steered_brief.hpp>

namespace orbis::features {

namespace detail {

/// A test asks whether the mean of the second box is larger. Boxes have `2 radius + 1` pixels a side.
struct box_test {
  float x0, y0, x1, y1;
  int radius;
};

/// Tests over the disc of radius 15: one box anywhere, the other near or far from it by chance.
template <std::size_t Bits>
inline constexpr auto box_pattern = [] {
  std::array<box_test, Bits> tests{};
  std::uint64_t state = 0x0b05;
  const auto next = [&](int bound) {
    state = mix64(state + 0x9e3779b97f4a7c15U);
    return static_cast<int>((state >> 33U) % static_cast<std::uint64_t>(bound));
  };
  for (box_test& t : tests) {
    t.radius = 2 + next(2);
    const int reach = disc_radius - t.radius;
    const auto somewhere = [&](float& x, float& y) {
      int px = 0, py = 0;
      do {
        px = next(2 * reach + 1) - reach;
        py = next(2 * reach + 1) - reach;
      } while (px * px + py * py > reach * reach);
      x = static_cast<float>(px);
      y = static_cast<float>(py);
    };
    do {
      somewhere(t.x0, t.y0);
      somewhere(t.x1, t.y1);  // boxes that overlap by half or more say little
    } while ((t.x0 - t.x1) * (t.x0 - t.x1) + (t.y0 - t.y1) * (t.y0 - t.y1) <
             static_cast<float>((t.radius + 1) * (t.radius + 1)));
  }
  return tests;
}();

}  // namespace detail

/// Compares the means of pairs of boxes of several sizes, turned to the keypoint's direction, by the integral image
/// of the level: no smoothing, as the boxes are that. In the manner of Suarez, Buenaposada, Baumela, "Revisiting
/// binary local image description for resource limited devices" (BAD), RA-L 2021, but with a
/// pattern by chance instead of a learned one. Descriptors of another kind than ORB's: compare each with its like only.
template <std::size_t Bits = 256>
struct box_difference {
  using descriptor = binary_descriptor<Bits>;
  static constexpr int reach = detail::disc_radius + 2;  ///< of the turned centres, rounded, and the boxes' corners
  static constexpr int diameter = 2 * detail::disc_radius + 1;

  struct workspace {
    std::vector<std::uint32_t> sums;  ///< of all pixels above and to the left; modulo 2^32, which differences bear
    int width = 0, height = 0;
    std::ptrdiff_t stride = 0;
  };

  void prepare(simd::level, image_view<const std::uint8_t> image, int first, int last, workspace& memory) const {
    memory.width = image.width();
    memory.height = image.height();
    memory.stride = image.width() + 1;
    const int top = std::max(0, first - reach), bottom = std::min(image.height(), last + reach);
    const auto needed = static_cast<std::size_t>(memory.stride) * (static_cast<std::size_t>(image.height()) + 1);
    if (memory.sums.size() < needed) memory.sums.resize(needed);
    std::fill_n(memory.sums.data() + top * memory.stride, memory.stride, 0U);
    for (int y = top; y < bottom; ++y) {
      const std::uint8_t* row = image.row(y).data();
      const std::uint32_t* above = memory.sums.data() + y * memory.stride;
      std::uint32_t* to = memory.sums.data() + (y + 1) * memory.stride;
      std::uint32_t sum = 0;
      to[0] = 0;
      for (int x = 0; x != image.width(); ++x) {
        sum += row[x];
        to[x + 1] = above[x + 1] + sum;
      }
    }
  }

  /// @pre at least `reach` pixels from the edge of the prepared image, in its prepared rows
  [[nodiscard]] descriptor operator()(simd::level, const workspace& prepared, int x, int y,
                                      const orientation& o) const {
    assert(x >= reach && y >= reach && x + reach < prepared.width && y + reach < prepared.height);
    const std::ptrdiff_t stride = prepared.stride;
    const std::uint32_t* centre = prepared.sums.data() + y * stride + x;
    const auto sum = [&](float px, float py, int radius) {
      const auto dx = detail::nearest_integer(rounded_product(px, o.cosine) - rounded_product(py, o.sine));
      const auto dy = detail::nearest_integer(rounded_product(px, o.sine) + rounded_product(py, o.cosine));
      const std::uint32_t* above = centre + (dy - radius) * stride + dx - radius;
      const std::uint32_t* below = above + (2 * radius + 1) * stride;
      return below[2 * radius + 1] - below[0] - above[2 * radius + 1] + above[0];
    };
    descriptor d;
    for (std::size_t i = 0; i != Bits; ++i) {
      const detail::box_test& t = detail::box_pattern<Bits>[i];
      d.words[i / 64] |= std::uint64_t{sum(t.x0, t.y0, t.radius) < sum(t.x1, t.y1, t.radius)} << (i % 64);
    }
    return d;
  }
};
static_assert(keypoint_descriptor<box_difference<>>);

}  // namespace orbis::features
