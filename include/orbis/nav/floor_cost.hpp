// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What it costs to drive past obstacles: a floor map inflated as the costmaps of Nav2 are.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/nav/floor_map.hpp>

namespace orbis::nav {

/// The values of a cost map that mean something of their own, as Nav2 names them.
namespace floor_cost {
inline constexpr std::uint8_t free_space = 0;
inline constexpr std::uint8_t inscribed = 253;  ///< a robot whose middle is here touches an obstacle
inline constexpr std::uint8_t lethal = 254;     ///< an obstacle
inline constexpr std::uint8_t no_information = 255;
}  // namespace floor_cost

struct inflation_options {
  double radius = 0.2;             ///< of the robot, metres ("inscribed radius")
  double inflation_radius = 0.55;  ///< beyond, obstacles cost nothing, metres
  double cost_scaling = 3.0;       ///< how fast the cost falls, per metre
};

/// The squared distance of each cell to the nearest occupied one, between the middles, in cells; a large number if
/// nothing is occupied. Exact up to 4096 cells, and rounded to a float beyond. O(cells).
///
/// P. Felzenszwalb, D. Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8, 2012.
[[nodiscard]] inline image<float> squared_floor_distances(const image<floor_state>& states) {
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
  // The lower envelope of the parabolas of a column: which of them is the lowest, and from where on.
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
        const double here = y, there = other;  // squares of integers may overflow
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

/// The costs of the cells of a floor map, by Nav2's rule: 254 in obstacles; 253 where the robot's circle touches one
/// (the middles of the cells are at most `radius` apart); 252 exp(-cost_scaling (d - radius)), rounded down, up to the
/// inflation radius; 0 beyond; and 255 where nothing is known, unless an obstacle is within `radius`. O(cells).
/// @pre 0 <= radius; cost_scaling >= 0
[[nodiscard]] inline image<std::uint8_t> inflate(const floor_map& map, const inflation_options& options = {}) {
  assert(options.radius >= 0.0 && options.cost_scaling >= 0.0);
  const image<float> squared = squared_floor_distances(map.states);
  const double rounding = 1e-9 * map.resolution;  // three cells of 0.05 m are at most 0.15 m apart
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
