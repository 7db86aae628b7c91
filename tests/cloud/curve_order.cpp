// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <numeric>
#include <vector>

#include <orbis/cloud/curve_order.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

TEST_CASE("the curve goes from each cell to one that shares a face with it") {
  // All cells of the curve's first 16^3 cube, in its order.
  std::vector<std::pair<std::uint64_t, std::array<std::uint32_t, 3>>> cells;
  for (std::uint32_t x = 0; x != 16; ++x)
    for (std::uint32_t y = 0; y != 16; ++y)
      for (std::uint32_t z = 0; z != 16; ++z) cells.push_back({orbis::cloud::hilbert_key({x, y, z}), {x, y, z}});
  std::sort(cells.begin(), cells.end());
  std::size_t jumps = 0;
  for (std::size_t i = 0; i != cells.size(); ++i) {
    CHECK(cells[i].first == i);  // the cube at the origin comes first, without gaps
    if (i == 0) continue;
    std::uint32_t steps = 0;
    for (std::size_t a = 0; a != 3; ++a) {
      const auto& from = cells[i - 1].second;
      const auto& to = cells[i].second;
      steps += std::max(from[a], to[a]) - std::min(from[a], to[a]);
    }
    if (steps != 1) ++jumps;
  }
  CHECK(jumps == 0);
}

TEST_CASE("ordering keeps every finite point once and joins identical ones") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    const auto ordered = orbis::cloud::order_along_curve(orbis::par.with(2), cloud);
    std::vector<int> seen(cloud.size(), 0);
    bool in_place = true;
    ordered.for_each_member([&, &points = cloud](std::size_t position, std::uint32_t i) {
      ++seen[i];
      const auto& p = ordered.positions[position];
      in_place = in_place && points[i] == orbis::vec3f{p[0], p[1], p[2]};
    });
    CHECK(in_place);
    for (std::size_t i = 0; i != cloud.size(); ++i) CHECK(seen[i] == (orbis::test::finite(cloud[i]) ? 1 : 0));
    auto positions = ordered.positions;
    std::sort(positions.begin(), positions.end());
    CHECK(std::adjacent_find(positions.begin(), positions.end()) == positions.end());
    CHECK(std::accumulate(ordered.multiplicity.begin(), ordered.multiplicity.end(), std::size_t{0}) == ordered.finite);
  }
}
