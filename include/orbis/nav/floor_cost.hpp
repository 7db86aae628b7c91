// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Costs of driving near obstacles: a floor map with inflated obstacles, as in Nav2's costmaps.
#pragma once

#include <cstdint>

#include <orbis/core/image.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/nav/floor_map.hpp>

namespace orbis::nav {

/// Special values of a cost map, with Nav2's names.
namespace floor_cost {
inline constexpr std::uint8_t free_space = 0;
inline constexpr std::uint8_t inscribed = 253;  ///< a robot whose centre is here touches an obstacle
inline constexpr std::uint8_t lethal = 254;     ///< an obstacle
inline constexpr std::uint8_t no_information = 255;
}  // namespace floor_cost

struct inflation_options {
  double radius = 0.2;             ///< radius of the robot, metres ("inscribed radius")
  double inflation_radius = 0.55;  ///< metres; obstacles farther away add no cost
  double cost_scaling = 3.0;       ///< rate at which the cost decreases, per metre
};

/// The squared distance between the centres of each cell and its nearest occupied cell, in cells; a large number if no
/// cell is occupied. Exact up to 4096 cells; larger distances are rounded to float. O(cells).
///
/// P. Felzenszwalb, D. Huttenlocher, "Distance transforms of sampled functions", Theory of Computing 8, 2012.
ORBIS_LAZY [[nodiscard]] image<float> squared_floor_distances(const image<floor_state>& states);

/// The costs of the cells of a floor map according to Nav2's rule: 254 in obstacles; 253 where the robot's circle
/// touches an obstacle (the cell centres are at most `radius` apart); 252 exp(-cost_scaling (d - radius)), rounded
/// down, up to the inflation radius; 0 farther away; and 255 in unknown cells, unless an obstacle is within `radius`.
/// O(cells).
/// @pre 0 <= radius; cost_scaling >= 0
ORBIS_LAZY [[nodiscard]] image<std::uint8_t> inflate(const floor_map& map, const inflation_options& options = {});

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/floor_cost-inl.hpp>
#endif
