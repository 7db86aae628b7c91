// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Numbers of corners for each pyramid level, and the strongest corners.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

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

/// Chooses the strongest corners of each level, wherever they are. O(n).
struct strongest {
  struct workspace {
    std::vector<int> quotas;
  };
  void operator()(std::span<level_corners> levels, int wanted, workspace& memory) const {
    share_out(levels, wanted, memory.quotas);
    for (std::size_t i = 0; i != levels.size(); ++i) keep_strongest(levels[i].corners, memory.quotas[i]);
  }
};
static_assert(corner_selection<strongest>);

}  // namespace orbis::features::detail
