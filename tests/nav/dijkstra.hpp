// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What paths over the middles of cells have to be as cheap as.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include <orbis/core/types.hpp>

namespace orbis::test {

/// What the cheapest way from `start` to `goal` over the middles of cells costs, by E. Dijkstra's algorithm; infinite:
/// there is none. Cells are 0 ... size - 1 along each axis, `cell` wide, from the origin on; a step costs its length
/// times the mean of both `density(cell)`, and the first and last bit their lengths.
template <class Middle, class IsFree, class Density>
[[nodiscard]] double cheapest_on_grid(std::array<int, 3> size, Middle&& middle, IsFree&& is_free, Density&& density,
                                      double cell, const vec3& start, const vec3& goal) {
  using place = std::array<int, 3>;
  const auto index = [&](const place& p) { return static_cast<std::size_t>((p[2] * size[1] + p[1]) * size[0] + p[0]); };
  const auto for_each_near = [&](const place& p, auto&& visit) {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) {
          const place q{p[0] + x, p[1] + y, p[2] + z};
          if (q == p || q[0] < 0 || q[1] < 0 || q[2] < 0 || q[0] >= size[0] || q[1] >= size[1] || q[2] >= size[2])
            continue;
          visit(q);
        }
  };
  const auto doors = [&](const vec3& p) {
    const auto along = [&](int i) { return static_cast<int>(std::floor(p[i] / cell)); };
    const place own{along(0), along(1), size[2] == 1 ? 0 : along(2)};
    if (is_free(p, middle(own))) return std::vector{own};
    std::vector<place> found;
    for_each_near(own, [&](const place& q) {
      if (is_free(p, middle(q))) found.push_back(q);
    });
    return found;
  };
  std::vector<double> cost(static_cast<std::size_t>(size[0] * size[1] * size[2]),
                           std::numeric_limits<double>::infinity());
  std::vector<double> densities(cost.size(), 0.0);
  const auto density_of = [&](const place& p) {
    double& d = densities[index(p)];
    if (d == 0.0) d = density(p);
    return d;
  };
  using entry = std::pair<double, place>;
  std::priority_queue<entry, std::vector<entry>, std::greater<>> open;
  const auto offer = [&](const place& p, double c) {
    if (c >= cost[index(p)]) return;
    cost[index(p)] = c;
    open.push({c, p});
  };
  for (const place& p : doors(start)) offer(p, (middle(p) - start).norm());
  while (!open.empty()) {
    const auto [c, p] = open.top();
    open.pop();
    if (c > cost[index(p)]) continue;
    for_each_near(p, [&, c = c, p = p](const place& q) {
      if (!is_free(middle(p), middle(q))) return;
      offer(q, c + (middle(q) - middle(p)).norm() * 0.5 * (density_of(p) + density_of(q)));
    });
  }
  double best = std::numeric_limits<double>::infinity();
  for (const place& p : doors(goal)) best = std::min(best, cost[index(p)] + (middle(p) - goal).norm());
  return best;
}

}  // namespace orbis::test
