// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a point's neighbours say beside their distance: what is usual around it, and whether it lies
/// on a surface with them.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include <orbis/cloud/detail/knn/neighbor_graph.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud::detail {

struct smoothing_options {
  std::size_t neighbors = 12;  ///< of each point, in each round
  int rounds = 4;
  double quantile = 0.35;  ///< of the neighbours' values, 0 to 1
};

/// For each place the value that is usual in its surroundings: the quantile over its neighbours, round
/// after round, so that they reach further than the neighbours. Values that are not finite (NaN) stay and
/// do not count; so do those of points without neighbours. O(n rounds neighbors), the same for every policy.
/// @pre values has an entry for each place
template <execution_policy Policy>
[[nodiscard]] std::vector<float> smoothed_over_neighbors(const Policy& policy, const neighbor_graph& graph,
                                                         std::vector<float> values,
                                                         const smoothing_options& options = {}) {
  constexpr float inf = std::numeric_limits<float>::infinity();
  const auto rank_of = [&](std::size_t count) {
    return static_cast<std::size_t>(options.quantile * static_cast<double>(count - 1) + 0.5);
  };
  const std::size_t width = std::min(options.neighbors, graph.width());
  if (width == 0) return values;
  const std::size_t most = rank_of(width) + 1;
  std::vector<float> next(values.size());
  for (int round = 0; round != options.rounds; ++round) {
    for_each_chunk(policy, values.size(), 4096, [&](std::size_t begin, std::size_t end) {
      std::vector<float> smallest(most);  // ascending
      for (std::size_t i = begin; i != end; ++i) {
        next[i] = values[i];
        if (!std::isfinite(values[i])) continue;
        std::fill(smallest.begin(), smallest.end(), inf);
        std::size_t count = 0;
        graph.for_each_neighbor(i, width, [&](std::uint32_t n) {
          float v = values[n];
          const bool counts = std::isfinite(v);
          count += counts ? 1 : 0;
          v = counts ? v : inf;
          for (float& s : smallest) {  // without branches: pushes the larger ones out
            const float low = v < s ? v : s;
            v = v < s ? s : v;
            s = low;
          }
        });
        if (count > 0) next[i] = smallest[rank_of(count)];
      }
    });
    values.swap(next);
  }
  return values;
}

/// How far a point and its neighbours are from lying in one plane, in units of their mean distance: the
/// root of the sum of two squares, the neighbours' deviation from the plane that fits them best and the
/// point's own distance to it. 0 in a plane, some 0.2 at an edge, 0.4 and more in a volume or beside a
/// surface; infinity with fewer than four neighbours. @pre the neighbours are points of the cloud
template <point_range Points>
[[nodiscard]] double off_plane(const Points& points, std::size_t i, std::span<const neighbor<float>> neighbors) {
  if (neighbors.size() < 4) return std::numeric_limits<double>::infinity();
  const auto at = [&](std::size_t j) {
    const auto p = coordinates<double>(point_at(points, j));
    return vec3{p[0], p[1], p[2]};
  };
  const vec3 own = at(i);
  const auto count = static_cast<double>(neighbors.size());
  vec3 mean = vec3::Zero();
  mat3 squares = mat3::Zero();
  double distance = 0;
  for (const auto& n : neighbors) {
    const vec3 d = at(n.index) - own;
    mean += d;
    squares += d * d.transpose();
    distance += static_cast<double>(n.distance);
  }
  mean /= count;
  distance /= count;
  if (!(distance > 0)) return 0;
  Eigen::SelfAdjointEigenSolver<mat3> solver;
  solver.computeDirect((squares / count - mean * mean.transpose()) / (distance * distance));
  const double thickness = std::max(0.0, solver.eigenvalues()[0]);
  const double height = solver.eigenvectors().col(0).dot(mean) / distance;
  return std::sqrt(thickness + height * height);
}

}  // namespace orbis::cloud::detail
