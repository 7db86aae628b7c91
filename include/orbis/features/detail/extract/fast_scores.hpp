// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// FAST-9/16 scores of a row of pixels, and the pixels whose scores are local maxima.
///
/// The score of a pixel is the largest difference by which nine contiguous pixels on the circle around it are all
/// brighter, or all darker, than the pixel: the maximum over all arcs of the minimum over an arc. Every arc of nine
/// pixels consists of one of the eight 8-pixel arcs that start at an odd pixel, and the pixel before or after it. Eight
/// arcs, each built by doubling, therefore give all sixteen, without branches.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/vec.hpp>

namespace orbis::features::detail {

inline constexpr int circle_radius = 3;
/// Offsets of the circle's pixels, clockwise from the top.
inline constexpr std::array<int, 16> circle_x{0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
inline constexpr std::array<int, 16> circle_y{-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};

[[nodiscard]] inline std::array<std::ptrdiff_t, 16> circle_offsets(std::ptrdiff_t stride) noexcept {
  std::array<std::ptrdiff_t, 16> offsets{};
  for (std::size_t i = 0; i != 16; ++i) offsets[i] = circle_y[i] * stride + circle_x[i];
  return offsets;
}

/// The score of one pixel, directly from the definition.
[[nodiscard]] inline int fast_score(const std::uint8_t* centre, const std::array<std::ptrdiff_t, 16>& circle) noexcept {
  int best = 0;
  for (std::size_t start = 0; start != 16; ++start) {
    int darkest = 255, brightest = 0;
    for (std::size_t i = 0; i != 9; ++i) {
      const int p = centre[circle[(start + i) % 16]];
      darkest = std::min(darkest, p);
      brightest = std::max(brightest, p);
    }
    best = std::max({best, darkest - *centre, *centre - brightest});
  }
  return best;
}

/// Writes the scores of `count` pixels of a row, 0 for scores up to `threshold`.
/// @pre the circles around all pixels are readable
struct fast_scores_kernel {
  using signature = void(const std::uint8_t* centre, std::ptrdiff_t stride, int count, std::uint8_t threshold,
                         std::uint8_t* scores);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint8_t* centre, std::ptrdiff_t stride, int count,
                                      std::uint8_t threshold, std::uint8_t* scores) {
    const auto circle = circle_offsets(stride);
    if (count >= static_cast<int>(Target::bytes))
      return run_in_blocks<Target::bytes, Target>(centre, circle, count, threshold, scores);
    if (count >= 16) return run_in_blocks<16, Target>(centre, circle, count, threshold, scores);
    for (int x = 0; x != count; ++x) {
      const int score = fast_score(centre + x, circle);
      scores[x] = static_cast<std::uint8_t>(score > threshold ? score : 0);
    }
  }

 private:
  /// @pre count >= N
  template <std::size_t N, class Target>
  static ORBIS_ALWAYS_INLINE void run_in_blocks(const std::uint8_t* centre,
                                                const std::array<std::ptrdiff_t, 16>& circle, int count,
                                                std::uint8_t threshold, std::uint8_t* scores) {
    using bytes = simd::vec<std::uint8_t, N, Target>;
    const bytes least(threshold);
    const auto block = [&](int x) ORBIS_INLINE_LAMBDA {
      const std::uint8_t* at = centre + x;
      const bytes c = bytes::load(at);
      // Every arc of nine contains at least one pixel of each opposite pair, which bounds the score.
      bytes pair_max = max(bytes::load(at + circle[0]), bytes::load(at + circle[8]));
      bytes pair_min = min(bytes::load(at + circle[0]), bytes::load(at + circle[8]));
#pragma GCC unroll 3
      for (std::size_t i = 2; i != 8; i += 2) {
        const bytes a = bytes::load(at + circle[i]), b = bytes::load(at + circle[i + 8]);
        pair_max = min(pair_max, max(a, b));
        pair_min = max(pair_min, min(a, b));
      }
      const bytes bound = max(subtract_saturated(pair_max, c), subtract_saturated(c, pair_min));
      bytes score(0);
      if (any(bound > least)) {
        bytes p[16], low[8], high[8];
#pragma GCC unroll 16
        for (std::size_t i = 0; i != 16; ++i) p[i] = bytes::load(at + circle[i]);
#pragma GCC unroll 8
        for (std::size_t k = 0; k != 8; ++k) {
          low[k] = min(p[2 * k + 1], p[(2 * k + 2) % 16]);
          high[k] = max(p[2 * k + 1], p[(2 * k + 2) % 16]);
        }
        bytes brightest = c, darkest = c;
#pragma GCC unroll 8
        for (std::size_t k = 0; k != 8; ++k) {
          const bytes low8 = min(min(low[k], low[(k + 1) % 8]), min(low[(k + 2) % 8], low[(k + 3) % 8]));
          const bytes high8 = max(max(high[k], high[(k + 1) % 8]), max(high[(k + 2) % 8], high[(k + 3) % 8]));
          const bytes a = p[2 * k], b = p[(2 * k + 9) % 16];
          brightest = max(brightest, min(low8, max(a, b)));
          darkest = min(darkest, max(high8, min(a, b)));
        }
        score = max(brightest - c, c - darkest);
        score = select(score > least, score, bytes(0));
      }
      score.store(scores + x);
    };
    constexpr int step = static_cast<int>(N);
    for (int x = 0; x <= count - step; x += step) block(x);
    if (count % step != 0) block(count - step);  // overlaps the previous block
  }
};

/// Writes the columns of scores that are larger than their eight neighbours, in ascending order; returns their number.
/// With `ties`, a score may equal neighbours that precede it by row, then column. @pre 64 bytes before the rows and
/// after their `count` scores are readable and zero
struct fast_peaks_kernel {
  using signature = std::size_t(const std::uint8_t* above, const std::uint8_t* row, const std::uint8_t* below,
                                int count, bool ties, std::uint32_t* columns);
  template <class Target>
  static ORBIS_ALWAYS_INLINE std::size_t run(const std::uint8_t* above, const std::uint8_t* row,
                                             const std::uint8_t* below, int count, bool ties, std::uint32_t* columns) {
    using bytes = simd::native_vec<std::uint8_t, Target>;
    const auto at = [](const std::uint8_t* p) ORBIS_INLINE_LAMBDA { return bytes::load(p); };
    const bytes zero(0), allowed(ties ? std::uint8_t{1} : std::uint8_t{0});
    std::size_t found = 0;
    for (int x = 0; x < count; x += static_cast<int>(bytes::count)) {
      const bytes s = at(row + x);
      if (!any(s != zero)) continue;
      const bytes before = max(max(at(above + x - 1), at(above + x)), max(at(above + x + 1), at(row + x - 1)));
      const bytes after = max(max(at(below + x - 1), at(below + x)), max(at(below + x + 1), at(row + x + 1)));
      const bytes bound = max(after, subtract_saturated(before, allowed));  // s >= before means s > before - 1
      for (auto peaks = bits(s > bound); peaks != 0; peaks &= peaks - 1)
        columns[found++] = static_cast<std::uint32_t>(x + std::countr_zero(peaks));
    }
    return found;
  }
};

}  // namespace orbis::features::detail
