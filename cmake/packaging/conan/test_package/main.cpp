// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <vector>

#include <orbis/cloud.hpp>
#include <orbis/octree.hpp>

int main() {
  const std::vector<std::array<float, 3>> points{{1, 2, 3}};
  orbis::octree::occupancy_octree<> map{0.05};
  map.integrate(points, std::array{0.0F, 0.0F, 0.0F}, {.max_range = 5.0});
  return map.state(std::array{1.0F, 2.0F, 3.0F}) == orbis::octree::occupancy::occupied ? 0 : 1;
}
