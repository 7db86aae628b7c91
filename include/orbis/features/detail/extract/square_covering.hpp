// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Choosing corners that keep their distance.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/features/detail/extract/corner.hpp>
#include <orbis/features/detail/extract/spread.hpp>

namespace orbis::features {

/// Goes through the corners from strong to weak; each that is taken covers a square around it in which no other
/// is taken. The side of the square is found by bisection so that just enough are left.
///
/// Source: Bailo, Rameau, Joo, Park, Bogdan, Kweon, "Efficient adaptive non-maximal suppression
/// algorithms for homogeneous spatial keypoint distribution", Pattern Recognition Letters 2018
/// (suppression via square covering). O(n log n + n log side).
struct square_covering {
  struct workspace {
    std::vector<int> quotas;
    std::vector<std::uint8_t> covered;
    std::vector<corner> taken;
    std::vector<corner> best;
  };

  void operator()(std::span<level_corners> levels, int wanted, workspace& memory) const {
    detail::share_out(levels, wanted, memory.quotas);
    for (std::size_t i = 0; i != levels.size(); ++i)
      choose(levels[i].corners, memory.quotas[i], levels[i].area, memory);
  }

 private:
  static void choose(std::vector<corner>& corners, int wanted, const region& area, workspace& memory) {
    if (wanted <= 0) return corners.clear();
    const auto most = static_cast<std::size_t>(wanted);
    if (corners.size() > most) {
      std::sort(corners.begin(), corners.end(), stronger);
      memory.best.assign(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(most));
      // Half sides, pixels: with `narrow` there are enough, with `wide` there may not be.
      int narrow = 0, wide = static_cast<int>(std::sqrt(static_cast<double>(area.width) * area.height / wanted)) + 2;
      while (wide - narrow > 1) {
        const int middle = (narrow + wide) / 2;
        cover(corners, middle, area, memory);
        if (memory.taken.size() < most) {
          wide = middle;
        } else {
          narrow = middle;
          memory.best.assign(memory.taken.begin(), memory.taken.begin() + static_cast<std::ptrdiff_t>(most));
        }
      }
      corners.assign(memory.best.begin(), memory.best.end());
    }
    std::sort(corners.begin(), corners.end(), before_in_image);
  }

  /// Takes corners more than `reach` pixels apart (in x or y), to half of it: the mask has cells of that size.
  static void cover(const std::vector<corner>& corners, int reach, const region& area, workspace& memory) {
    const int cell = std::max(1, (reach + 1) / 2), steps = reach / cell;
    const int columns = area.width / cell + 1, rows = area.height / cell + 1;
    memory.covered.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), 0);
    memory.taken.clear();
    for (const corner& c : corners) {
      const int column = (c.x - area.x) / cell, row = (c.y - area.y) / cell;
      if (memory.covered[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                         static_cast<std::size_t>(column)] != 0)
        continue;
      memory.taken.push_back(c);
      const int first = std::max(0, column - steps), last = std::min(columns - 1, column + steps);
      for (int r = std::max(0, row - steps); r <= std::min(rows - 1, row + steps); ++r)
        std::fill_n(memory.covered.begin() + static_cast<std::ptrdiff_t>(r) * columns + first, last - first + 1,
                    std::uint8_t{1});
    }
  }
};
static_assert(corner_distribution<square_covering>);

}  // namespace orbis::features
