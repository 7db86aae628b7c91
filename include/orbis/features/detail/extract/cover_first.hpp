// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Selection of corners: first a subset that covers the image, then the strongest corners of each level.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/inline.hpp>
#include <orbis/features/detail/extract/orb_parts.hpp>
#include <orbis/features/extractor.hpp>

namespace orbis::features::detail {

/// Computes the number of features per level, proportional to the side length of the level's image. Levels with too few
/// corners pass the remainder to finer levels, and then to any level with more corners.
inline void assign_quotas(std::span<const level_corners> levels, int wanted, std::vector<int>& quotas) {
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

/// Keeps the `wanted` strongest corners.
inline void keep_strongest(std::vector<corner>& corners, int wanted) {
  const auto count = std::min(corners.size(), static_cast<std::size_t>(std::max(0, wanted)));
  std::nth_element(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(count), corners.end(), stronger);
  corners.resize(count);
  std::sort(corners.begin(), corners.end(), before_in_image);
}

ORBIS_LAZY_INLINE void cover_first::operator()(std::span<level_corners> levels, int wanted, workspace& memory) const {
  assign_quotas(levels, wanted, memory.quotas);
  take_covering(levels, wanted, memory);
  for (std::size_t l = 0; l != levels.size(); ++l) {
    std::vector<corner>&corners = levels[l].corners, &covering = memory.covering[l];
    keep_strongest(covering, memory.quotas[l]);
    keep_strongest(corners, memory.quotas[l] - static_cast<int>(covering.size()));
    corners.insert(corners.end(), covering.begin(), covering.end());
    std::sort(corners.begin(), corners.end(), before_in_image);
  }
}

/// Moves the strongest corner of each cell to `memory.covering`.
ORBIS_LAZY_INLINE void cover_first::take_covering(std::span<level_corners> levels, int wanted,
                                                  workspace& memory) const {
  if (memory.covering.size() < levels.size()) memory.covering.resize(levels.size());
  for (auto& corners : memory.covering) corners.clear();
  std::size_t all = 0;
  for (const level_corners& level : levels) all += level.corners.size();
  const double cells = share * wanted;
  if (cells < 1.0 || all <= static_cast<std::size_t>(wanted)) return;
  const region& area = levels[0].area;
  const double side = std::max(1.0, std::sqrt(static_cast<double>(area.width) * area.height / cells));
  const int columns = static_cast<int>(area.width / side) + 1, rows = static_cast<int>(area.height / side) + 1;
  memory.best.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), {});
  for (std::uint32_t l = 0; l != levels.size(); ++l) {
    // Computes a corner's cell with one multiplication and one addition; positions outside belong to the nearest cell.
    const double step = levels[l].scale / side, left = area.x / side, top = area.y / side;
    for (std::uint32_t i = 0; i != levels[l].corners.size(); ++i) {
      const corner& c = levels[l].corners[i];
      const int column = std::clamp(static_cast<int>(c.x * step - left), 0, columns - 1);
      const int row = std::clamp(static_cast<int>(c.y * step - top), 0, rows - 1);
      auto& best = memory.best[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) +
                               static_cast<std::size_t>(column)];
      const bool tie = c.response == best.response && best.level == l;
      if (c.response > best.response || (tie && before_in_image(c, levels[l].corners[best.index])))
        best = {c.response, l, i};
    }
  }
  constexpr float taken = -1.0F;
  for (const auto& best : memory.best) {
    if (best.response < 0.0F) continue;
    corner& c = levels[best.level].corners[best.index];
    memory.covering[best.level].push_back(c);
    c.response = taken;
  }
  for (level_corners& level : levels) std::erase_if(level.corners, [](const corner& c) { return c.response == taken; });
}

}  // namespace orbis::features::detail
