// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of floor_cost.hpp.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/core/inline.hpp>
#include <orbis/nav/floor_cost.hpp>

namespace orbis::nav {

ORBIS_LAZY_INLINE image<float> squared_floor_distances(const image<floor_state>& states) {
  constexpr float far = 1e18F;
  image<float> squared(states.width(), states.height(), far);
  const int width = states.width(), height = states.height();
  for (int y = 0; y != height; ++y) {
    int last = -1;
    const auto offer = [&](int x, int from) {
      const auto d = static_cast<float>(x - from);
      squared(x, y) = std::min(squared(x, y), d * d);
    };
    for (int x = 0; x != width; ++x) {
      if (states(x, y) == floor_state::occupied) last = x;
      if (last >= 0) offer(x, last);
    }
    last = -1;
    for (int x = width; x-- != 0;) {
      if (states(x, y) == floor_state::occupied) last = x;
      if (last >= 0) offer(x, last);
    }
  }
  // The lower envelope of the parabolas in a column: the index of each lowest parabola, and where it begins.
  std::vector<double> column(static_cast<std::size_t>(height)), begin(column.size());
  std::vector<int> lowest(column.size());
  for (int x = 0; x != width; ++x) {
    std::size_t count = 0;
    for (int y = 0; y != height; ++y) {
      const double value = column[static_cast<std::size_t>(y)] = squared(x, y);
      if (value >= static_cast<double>(far)) continue;
      double from = -std::numeric_limits<double>::infinity();
      for (; count != 0; --count) {
        const int other = lowest[count - 1];
        const double here = y, there = other;  // doubles: squares of integers may overflow
        from = (value + here * here - column[static_cast<std::size_t>(other)] - there * there) / (2.0 * (here - there));
        if (from > begin[count - 1]) break;
        from = -std::numeric_limits<double>::infinity();
      }
      lowest[count] = y;
      begin[count++] = from;
    }
    if (count == 0) continue;
    std::size_t at = 0;
    for (int y = 0; y != height; ++y) {
      while (at + 1 != count && begin[at + 1] < y) ++at;
      const int from = lowest[at];
      const double along = y - from;
      squared(x, y) = static_cast<float>(column[static_cast<std::size_t>(from)] + along * along);
    }
  }
  return squared;
}

ORBIS_LAZY_INLINE image<std::uint8_t> inflate(const floor_map& map, const inflation_options& options) {
  assert(options.radius >= 0.0 && options.cost_scaling >= 0.0);
  const image<float> squared = squared_floor_distances(map.states);
  const double rounding = 1e-9 * map.resolution;  // three cells of 0.05 m must count as 0.15 m
  image<std::uint8_t> costs(map.states.width(), map.states.height(), floor_cost::free_space);
  for (std::size_t i = 0; i != squared.pixels().size(); ++i) {
    const double d = std::sqrt(static_cast<double>(squared.pixels()[i])) * map.resolution;
    std::uint8_t& cost = costs.pixels()[i];
    if (map.states.pixels()[i] == floor_state::occupied) {
      cost = floor_cost::lethal;
    } else if (d <= options.radius + rounding) {
      cost = floor_cost::inscribed;
    } else if (map.states.pixels()[i] == floor_state::unknown) {
      cost = floor_cost::no_information;
    } else if (d <= options.inflation_radius + rounding) {
      const double beyond = std::max(0.0, d - options.radius);
      cost = static_cast<std::uint8_t>((floor_cost::inscribed - 1) * std::exp(-options.cost_scaling * beyond));
    }
  }
  return costs;
}

}  // namespace orbis::nav
