// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Properties of a point's neighbourhood other than density: the typical value of a quantity, and the deviation from
/// a plane.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/detail/knn/neighbor_graph.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/jacobi.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud::detail {

/// For each column of a table with 16 columns, writes the `count` smallest values, ascending, and then the largest
/// value to the rows of `out`. Finds low quantiles of 16 sets of values at a time. @pre no value is NaN
struct smallest_of_columns {
  static constexpr std::size_t columns = 16;
  static constexpr std::size_t count = 5;
  static constexpr std::size_t most_rows = 12;
  using signature = void(const float*, std::size_t, float*);
  struct block {
    alignas(64) std::array<float, most_rows * columns> table{};
    alignas(64) std::array<float, (count + 1) * columns> found{};
  };
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const float* table, std::size_t rows, float* out) {
    using lanes = simd::native_vec<float, Target>;
    for (std::size_t x = 0; x < columns; x += lanes::count) {
      lanes smallest[count];
      for (lanes& s : smallest) s = lanes(std::numeric_limits<float>::infinity());
      lanes largest = lanes(-std::numeric_limits<float>::infinity());
      for (std::size_t row = 0; row != rows; ++row) {
        lanes v = lanes::load(table + row * columns + x);
        largest = max(v, largest);
        for (lanes& s : smallest) {  // shifts out the larger values
          const lanes low = min(v, s);
          v = max(v, s);
          s = low;
        }
      }
      for (std::size_t i = 0; i != count; ++i) smallest[i].store(out + i * columns + x);
      largest.store(out + count * columns + x);
    }
  }
};

/// For each place, computes the typical value in its neighbourhood: the 35 % quantile of the values of its 12 nearest
/// neighbours, repeated in several rounds to extend the neighbourhood. Non-finite values are ignored. They are left
/// unchanged, as are the values of points none of whose neighbours has a finite value. O(n rounds); the result is the
/// same for every policy.
/// @pre values has an entry for each place
template <execution_policy Policy>
[[nodiscard]] std::vector<float> smoothed_over_neighbors(const Policy& policy, const neighbor_graph& graph,
                                                         std::span<const float> values, int rounds = 4) {
  static constexpr float inf = std::numeric_limits<float>::infinity();  // marks values to ignore
  constexpr std::size_t neighbors = smallest_of_columns::most_rows, columns = smallest_of_columns::columns;
  const auto quantile_rank = [](std::size_t count) {
    return static_cast<std::size_t>(0.35 * static_cast<double>(count - 1) + 0.5);
  };
  static_assert(smallest_of_columns::count == static_cast<std::size_t>(0.35 * (neighbors - 1) + 0.5) + 1);
  const std::size_t width = std::min(neighbors, graph.width());
  if (width == 0) return {values.begin(), values.end()};
  const auto find_smallest = simd::kernel<smallest_of_columns, smallest_of_columns::signature>();
  const auto as_counted = [](float v) { return std::isfinite(v) ? v : inf; };
  std::vector<float> counted(values.size()), next(values.size());
  std::ranges::transform(values, counted.begin(), as_counted);
  for (int round = 0; round != rounds; ++round) {
    for_each_chunk(policy, values.size(), 4096, [&](std::size_t begin, std::size_t end) {
      smallest_of_columns::block block;
      for (std::size_t first = begin; first < end; first += columns) {
        const std::size_t last = std::min(end, first + columns);
        for (std::size_t i = first; i != last; ++i) {
          float* to = block.table.data() + (i - first);
          graph.for_each_neighbor(i, width, [&](std::uint32_t n) {
            *to = counted[n];
            to += columns;
          });
        }
        find_smallest(block.table.data(), width, block.found.data());
        for (std::size_t i = first; i != last; ++i) {
          const std::size_t column = i - first;
          next[i] = counted[i];
          if (counted[i] == inf) continue;
          const auto at = [&](std::size_t row) { return block.found[row * columns + column]; };
          std::size_t count = width;
          if (at(smallest_of_columns::count) == inf)
            for (std::size_t n = 0; n != width; ++n) count -= block.table[n * columns + column] == inf ? 1 : 0;
          if (count > 0) next[i] = at(quantile_rank(count));
        }
      }
    });
    counted.swap(next);
  }
  for (std::size_t i = 0; i != values.size(); ++i)
    if (!std::isfinite(values[i])) counted[i] = values[i];
  return counted;
}

/// Deviation of a point and its neighbours from one plane, in units of their mean distance: the root of the sum of two
/// squares, the neighbours' deviation from their best-fit plane and the point's own distance to it. 0 in a plane, about
/// 0.2 at an edge, 0.4 and more in a volume or next to a surface; infinity with fewer than four neighbours. @pre the
/// neighbours are points of the cloud
template <point_range Points>
[[nodiscard]] double off_plane(const Points& points, std::size_t i, std::span<const neighbor<float>> neighbors) {
  if (neighbors.size() < 4) return std::numeric_limits<double>::infinity();
  const auto at = [&](std::size_t j) {
    const auto p = coordinates<double>(point_at(points, j));
    return vec3{p[0], p[1], p[2]};
  };
  const vec3 own = at(i);
  const auto count = static_cast<double>(neighbors.size());
  vec3 mean = zeros<vec3>();
  mat3 squares = zeros<mat3>();
  double distance = 0;
  for (const auto& n : neighbors) {
    const vec3 d = at(n.index) - own;
    mean += d;
    squares += d * transposed(d);
    distance += static_cast<double>(n.distance);
  }
  mean /= count;
  distance /= count;
  if (!(distance > 0)) return 0;
  const auto spread = eigen_of_symmetric<3>((squares / count - mean * transposed(mean)) / (distance * distance));
  const double thickness = std::max(0.0, spread.values[0]);
  const double height = dot(column_of(spread.vectors, 0), mean) / distance;
  return std::sqrt(thickness + height * height);
}

}  // namespace orbis::cloud::detail
