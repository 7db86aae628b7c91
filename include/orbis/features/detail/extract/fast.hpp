// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// FAST corners.
///
/// Source: Rosten, Porter, Drummond, "Faster and better: a machine learning approach to corner
/// detection", PAMI 2010 (segment test of 9 on a circle of 16, score, non-maximum suppression).
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/core/simd/integer.hpp>
#include <orbis/core/simd/vec.hpp>
#include <orbis/features/detail/extract/fast_scores.hpp>
#include <orbis/features/detail/extract/orb_parts.hpp>
#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

/// to[x] = (a[x] + 2 b[x] + c[x] + 2) / 4. @pre `to` does not overlap the inputs
struct binomial_kernel {
  using signature = void(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
                         std::uint8_t* to);
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const std::uint8_t* a, const std::uint8_t* b, const std::uint8_t* c, int count,
                                      std::uint8_t* to) {
    using bytes = simd::native_vec<std::uint8_t, Target>;
    constexpr int step = static_cast<int>(bytes::count);
    const auto block = [&](int x) ORBIS_INLINE_LAMBDA {
      // The mean of a and c, rounded down, then its mean with b, rounded up: together they round correctly.
      const bytes va = bytes::load(a + x), vb = bytes::load(b + x), vc = bytes::load(c + x);
      const bytes ac = average(va, vc) - ((va ^ vc) & bytes(1));
      average(ac, vb).store(to + x);
    };
    if (count < step) {
      for (int x = 0; x < count; ++x) to[x] = static_cast<std::uint8_t>((a[x] + 2 * b[x] + c[x] + 2) >> 2);
      return;
    }
    for (int x = 0; x <= count - step; x += step) block(x);
    if (count % step != 0) block(count - step);  // overlaps the previous block
  }
};

inline constexpr std::size_t row_margin = 64;  // padding of rows that kernels may access
inline constexpr int band_rows = 64;

/// Position of the maximum of the parabola through three values at -1, 0 and 1. @pre the middle value is the largest,
/// and not all are equal
[[nodiscard]] inline float parabola_peak(int before, int middle, int after) {
  return static_cast<float>(before - after) / static_cast<float>(2 * (before - 2 * middle + after));
}

ORBIS_LAZY_INLINE void fast9::operator()(image_view<const std::uint8_t> image, const region& area,
                                         const corner_thresholds& thresholds, workspace& memory,
                                         std::vector<corner>& corners) const {
  corners.clear();
  assert(cell >= 1 && 0 <= thresholds.weak && thresholds.weak <= thresholds.strong && thresholds.strong <= 254);
  assert(area.empty() || (area.x >= 0 && area.y >= 0 && area.x + area.width <= image.width() &&
                          area.y + area.height <= image.height()));
  find_peaks(image, area, thresholds.weak, memory, corners);
  if (thresholds.weak != thresholds.strong) drop_weak(area, thresholds.strong, memory, corners);
}

ORBIS_LAZY_INLINE void fast9::find_peaks(image_view<const std::uint8_t> image, const region& area, int threshold,
                                         workspace& memory, std::vector<corner>& corners) const {
  // Scores are needed one pixel around the area, to test whether its outermost pixels are peaks.
  const int left = std::max(circle_radius, area.x - 1);
  const int right = std::min(image.width() - circle_radius, area.x + area.width + 1);
  const int top = std::max(circle_radius, area.y - 1);
  const int bottom = std::min(image.height() - circle_radius, area.y + area.height + 1);
  if (area.empty() || left >= right || top >= bottom) return;
  const auto score_row = simd::kernel<fast_scores_kernel, fast_scores_kernel::signature>();
  const auto peaks_in_row = simd::kernel<fast_peaks_kernel, fast_peaks_kernel::signature>();
  const int count = right - left;
  const auto width = static_cast<std::size_t>(count);
  const std::size_t pitch = width + 2 * row_margin;
  memory.scores.assign(std::max(memory.scores.size(), 3 * pitch), 0);
  if (memory.columns.size() < width) memory.columns.resize(width);
  const auto row_of = [&](int y) {
    return memory.scores.data() + static_cast<std::size_t>(y % 3) * pitch + row_margin;
  };

  for (int y = top; y <= bottom; ++y) {
    if (y == bottom) {
      std::memset(row_of(y), 0, width);
    } else if (smooth) {
      const int in_band = (y - top) % band_rows;
      if (in_band == 0) smooth_band(image, left, count, y, std::min(bottom, y + band_rows), memory);
      score_row(memory.band.data() + static_cast<std::size_t>(in_band + circle_radius) * pitch + row_margin,
                static_cast<std::ptrdiff_t>(pitch), count, static_cast<std::uint8_t>(threshold), row_of(y));
    } else {
      score_row(image.data() + y * image.stride() + left, image.stride(), count, static_cast<std::uint8_t>(threshold),
                row_of(y));
    }
    const int inner = y - 1;  // both neighbouring rows are now known
    if (inner < std::max(top, area.y) || inner >= area.y + area.height) continue;
    const std::uint8_t* row = row_of(inner);
    const std::uint8_t* above = row_of(inner + 2);  // the previous slot, cyclically; zero before the first row
    const std::size_t found = peaks_in_row(above, row, row_of(y), count, ties, memory.columns.data());
    for (std::size_t i = 0; i != found; ++i) {
      const std::uint32_t column = memory.columns[i];
      const int x = left + static_cast<int>(column);
      if (x < area.x || x >= area.x + area.width) continue;
      corners.push_back({x, inner, static_cast<float>(row[column] - 1)});
      if (!subpixel) continue;
      const std::uint8_t* here = row + column;  // the bytes before column 0 are the margin
      corners.back().dx = parabola_peak(here[-1], here[0], here[1]);
      corners.back().dy = parabola_peak(above[column], here[0], row_of(y)[column]);
    }
  }
}

/// Smooths rows [first, last) and the pixels on the circles around them. Called for bands of rows, so that the pixels
/// are still in the cache when the circles are evaluated.
ORBIS_LAZY_INLINE void fast9::smooth_band(image_view<const std::uint8_t> image, int left, int count, int first,
                                          int last, workspace& memory) {
  const std::size_t pitch = static_cast<std::size_t>(count) + 2 * row_margin;
  const int from = left - circle_radius, columns = count + 2 * circle_radius;  // all columns are in the image
  const int from_more = std::max(0, from - 1), to_more = std::min(image.width(), from + columns + 1);
  if (memory.band.size() < pitch * (band_rows + 2 * circle_radius))
    memory.band.resize(pitch * (band_rows + 2 * circle_radius));
  if (memory.line.size() < pitch) memory.line.resize(pitch);
  const auto mix = simd::kernel<binomial_kernel, binomial_kernel::signature>();
  std::uint8_t* line = memory.line.data() + row_margin;  // points to column `from`
  for (int y = first - circle_radius; y != last + circle_radius; ++y) {
    const std::uint8_t* row = image.row(y).data();
    const std::uint8_t* above = image.row(std::max(0, y - 1)).data();
    const std::uint8_t* below = image.row(std::min(image.height() - 1, y + 1)).data();
    mix(above + from_more, row + from_more, below + from_more, to_more - from_more, line + (from_more - from));
    if (from == 0) line[-1] = line[0];  // replicates the pixel at the edge
    if (from + columns == image.width()) line[columns] = line[columns - 1];
    std::uint8_t* to =
        memory.band.data() + static_cast<std::size_t>(y - first + circle_radius) * pitch + row_margin - circle_radius;
    mix(line - 1, line, line + 1, columns, to);
  }
}

ORBIS_LAZY_INLINE void fast9::drop_weak(const region& area, int strong, workspace& memory,
                                        std::vector<corner>& corners) const {
  const int columns = std::max(1, (area.width + cell / 2) / cell), rows = std::max(1, (area.height + cell / 2) / cell);
  memory.strongest.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0.0F);
  if (memory.cell_of.size() < corners.size()) memory.cell_of.resize(corners.size());
  int y = -1;
  std::size_t first_of_row = 0;
  for (std::size_t i = 0; i != corners.size(); ++i) {
    const corner& c = corners[i];
    if (c.y != y) {
      y = c.y;
      first_of_row =
          static_cast<std::size_t>(std::min((y - area.y) / cell, rows - 1)) * static_cast<std::size_t>(columns);
    }
    const std::size_t at = first_of_row + static_cast<std::size_t>(std::min((c.x - area.x) / cell, columns - 1));
    memory.cell_of[i] = static_cast<std::uint32_t>(at);
    memory.strongest[at] = std::max(memory.strongest[at], c.response);
  }
  // Branch-free: the outcome is hard to predict.
  const auto bound = static_cast<float>(strong);
  std::size_t kept = 0;
  for (std::size_t i = 0; i != corners.size(); ++i) {
    const bool weak = corners[i].response < bound, strong_near = memory.strongest[memory.cell_of[i]] >= bound;
    corners[kept] = corners[i];
    kept += static_cast<std::size_t>(!(weak & strong_near));
  }
  corners.resize(kept);
}
}  // namespace orbis::features::detail
