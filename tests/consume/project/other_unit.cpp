// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cstddef>
#include <vector>

#include <orbis/octree/occupancy_octree.hpp>

std::size_t occupied_leaves_of_other_unit();

/// The same map as in main.cpp, made by code that this unit compiles itself.
std::size_t occupied_leaves_of_other_unit() {
  std::vector<std::array<float, 3>> points;
  for (int i = 0; i != 100; ++i)
    points.push_back({1.0F + 0.001F * static_cast<float>(i % 10), 0.001F * static_cast<float>(i / 10), 0.0F});
  points.push_back({9.0F, 9.0F, 9.0F});
  orbis::octree::occupancy_octree<> map{0.05};
  map.integrate(points, std::array<float, 3>{0.0F, 0.0F, 0.0F}, {.max_range = 5.0});
  return map.num_occupied_leaves();
}
