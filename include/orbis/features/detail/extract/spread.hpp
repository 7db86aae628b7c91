// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Choosing corners that cover the image evenly.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/features/detail/extract/corner.hpp>

namespace orbis::features {

namespace detail {

/// How many features each level gives: proportional to the side of its image. What a coarse level
/// cannot give goes to the finer ones; what is left then, to any that has more.
inline void share_out(std::span<const level_corners> levels, int wanted, std::vector<int>& quotas) {
  quotas.resize(levels.size());
  double sides = 0.0;
  for (const level_corners& level : levels) sides += 1.0 / level.scale;
  int left = wanted;
  for (std::size_t i = levels.size(); i-- != 0;) {
    const double share = 1.0 / levels[i].scale / sides;
    const int most = static_cast<int>(levels[i].corners.size());
    quotas[i] = i == 0 ? std::min(most, left) : std::min(most, static_cast<int>(std::lround(left * share)));
    left -= quotas[i];
    sides -= 1.0 / levels[i].scale;
  }
  for (std::size_t i = 0; i != levels.size(); ++i) {
    const int more = std::min(left, static_cast<int>(levels[i].corners.size()) - quotas[i]);
    quotas[i] += more;
    left -= more;
  }
}

/// Leaves the `wanted` strongest.
inline void keep_strongest(std::vector<corner>& corners, int wanted) {
  const auto count = std::min(corners.size(), static_cast<std::size_t>(std::max(0, wanted)));
  std::nth_element(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(count), corners.end(), stronger);
  corners.resize(count);
  std::sort(corners.begin(), corners.end(), before_in_image);
}

}  // namespace detail

/// Cuts the area into about `wanted / per_cell` square cells. First every cell gives its strongest corner, then
/// every cell its second, and so on; the last round takes the strongest. O(n log n), in most images O(n).
struct even_cells {
  double per_cell = 1.0;

  struct workspace {
    std::vector<int> quotas;
    std::vector<std::uint32_t> first;  ///< of each cell, in `sorted`
    std::vector<std::uint32_t> cell;   ///< of each corner
    std::vector<corner> sorted;
    std::vector<std::uint32_t> in_round;
    std::vector<corner> last;
  };

  /// @pre per_cell > 0
  void operator()(std::span<level_corners> levels, int wanted, workspace& memory) const {
    detail::share_out(levels, wanted, memory.quotas);
    for (std::size_t i = 0; i != levels.size(); ++i)
      choose(levels[i].corners, memory.quotas[i], levels[i].area, memory);
  }

 private:
  void choose(std::vector<corner>& corners, int wanted, const region& area, workspace& memory) const {
    if (wanted <= 0) return corners.clear();
    if (corners.size() <= static_cast<std::size_t>(wanted)) {
      std::sort(corners.begin(), corners.end(), before_in_image);
      return;
    }
    const double side = std::max(1.0, std::sqrt(per_cell * area.width * area.height / wanted));
    const int columns = std::max(1, static_cast<int>(std::lround(area.width / side)));
    const int rows = std::max(1, static_cast<int>(std::lround(area.height / side)));
    sort_into_cells(corners, area, columns, rows, memory);

    // How many corners the first, second, ... of their cells there are.
    memory.in_round.clear();
    const std::size_t cells = memory.first.size() - 1;
    for (std::size_t c = 0; c != cells; ++c) {
      const std::uint32_t count = memory.first[c + 1] - memory.first[c];
      std::sort(memory.sorted.begin() + memory.first[c], memory.sorted.begin() + memory.first[c + 1], stronger);
      if (count > memory.in_round.size()) memory.in_round.resize(count, 0);
      for (std::uint32_t i = 0; i != count; ++i) ++memory.in_round[i];
    }
    std::uint32_t whole_rounds = 0;
    auto left = static_cast<std::size_t>(wanted);
    while (memory.in_round[whole_rounds] <= left) left -= memory.in_round[whole_rounds++];

    corners.clear();
    memory.last.clear();
    for (std::size_t c = 0; c != cells; ++c)
      for (std::uint32_t i = memory.first[c]; i != memory.first[c + 1] && i - memory.first[c] <= whole_rounds; ++i)
        (i - memory.first[c] < whole_rounds ? corners : memory.last).push_back(memory.sorted[i]);
    const auto cut = memory.last.begin() + static_cast<std::ptrdiff_t>(left);
    std::nth_element(memory.last.begin(), cut, memory.last.end(), stronger);
    corners.insert(corners.end(), memory.last.begin(), cut);
    std::sort(corners.begin(), corners.end(), before_in_image);
  }

  static void sort_into_cells(const std::vector<corner>& corners, const region& area, int columns, int rows,
                              workspace& memory) {
    const auto part = [](int at, int size, int parts) {
      return static_cast<std::uint32_t>(static_cast<std::uint64_t>(at) * static_cast<std::uint64_t>(parts) /
                                        static_cast<std::uint64_t>(size));
    };
    memory.first.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows) + 2, 0);
    memory.cell.clear();
    for (const corner& c : corners) {
      memory.cell.push_back(part(c.y - area.y, area.height, rows) * static_cast<std::uint32_t>(columns) +
                            part(c.x - area.x, area.width, columns));
      ++memory.first[memory.cell.back() + 2];
    }
    for (std::size_t c = 2; c != memory.first.size(); ++c) memory.first[c] += memory.first[c - 1];
    memory.sorted.resize(corners.size());
    for (std::size_t i = 0; i != corners.size(); ++i) memory.sorted[memory.first[memory.cell[i] + 1]++] = corners[i];
    memory.first.pop_back();
  }
};
static_assert(corner_distribution<even_cells>);

/// The strongest ones of each level, wherever they are: no spread at all. O(n).
struct strongest {
  struct workspace {
    std::vector<int> quotas;
  };
  void operator()(std::span<level_corners> levels, int wanted, workspace& memory) const {
    detail::share_out(levels, wanted, memory.quotas);
    for (std::size_t i = 0; i != levels.size(); ++i) detail::keep_strongest(levels[i].corners, memory.quotas[i]);
  }
};
static_assert(corner_distribution<strongest>);

}  // namespace orbis::features
