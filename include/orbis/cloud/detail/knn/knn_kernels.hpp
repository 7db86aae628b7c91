// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The inner loops of the search for the neighbours of all points: what they do, and how without any
/// particular instructions.
///
/// Distances to boxes are computed by the same operations in the same order as those to points.
/// Rounding is monotonic, so the distance to a box is never more than that to a point within it, and
/// no neighbour is lost to rounding.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/squared_distance.hpp>

namespace orbis::cloud::detail {

/// The leaves near a group of queries, and their boxes.
struct nearby_leaves {
  explicit nearby_leaves(std::size_t most)
      : boxes(most / leaf_width + 2), leaves((most / leaf_width + 2) * leaf_width) {}
  std::vector<box_row> boxes;
  std::vector<std::uint32_t> leaves;
  std::size_t count = 0;
  /// Whether a further row of children may be added.
  [[nodiscard]] bool has_room() const noexcept { return count + 2 * leaf_width <= leaves.size(); }
  /// Fills up the last row with boxes at infinity.
  void finish() noexcept {
    const box_row none = empty_boxes();
    for (std::size_t i = count; i % leaf_width != 0; ++i) {
      for (std::size_t a = 0; a != 3; ++a) {
        boxes[i / leaf_width].low[a][i % leaf_width] = none.low[a][0];
        boxes[i / leaf_width].high[a][i % leaf_width] = none.high[a][0];
      }
    }
  }
};

/// What is known of the `wanted` smallest of some squared distances.
struct nearest_sum {
  double roots = 0;           ///< the sum of their roots, to within the slack; negative where that is not known
  float largest_squared = 0;  ///< the largest of them
};

/// The relative error that `nearest_sum::roots` may have: that of the vector kernels' roots, and of
/// corrections added up in float.
[[nodiscard]] inline double roots_slack(std::size_t wanted) noexcept {
  return 0x1p-40 + 0x1p-46 * static_cast<double>(wanted);
}

/// One set of inner loops.
struct knn_kernels {
  /// The squared distances from `query` to sixteen boxes; returns those within `bound` as bits.
  std::uint32_t (*near_boxes)(const box_row& boxes, const box3& query, float bound, float* distance);
  /// Adds to `near` the boxes with bits in `mask`; the first one is that of leaf `first`.
  void (*gather)(const box_row& boxes, std::uint32_t mask, std::uint32_t first, nearby_leaves& near);
  /// Writes the squared distances within `bound` from `query` to the points of `near`, then sixteen
  /// times infinity, and returns the number of the former. Ends early with more than `capacity` of
  /// them; touches no more than `capacity + 3 * leaf_width`. `scratch`: longer by sixteen than
  /// `near.leaves`.
  std::size_t (*near_points)(const point_row* leaves, const nearby_leaves& near, const std::array<float, 3>& query,
                             float bound, std::uint32_t* scratch, float* found, std::size_t capacity);
  /// The same for one leaf, whatever its box, and without infinity at the end.
  std::size_t (*in_leaf)(const point_row& leaf, const std::array<float, 3>& query, float bound, float* found);
  /// The squared distances from `query` to the points of a leaf; returns those within `bound` as bits.
  std::uint32_t (*distances)(const point_row& leaf, const std::array<float, 3>& query, float bound, float* distance);
  /// @pre 0 < wanted <= count, no distance above `bound`, and sixteen times infinity after them
  nearest_sum (*sum_nearest)(float* found, std::size_t count, std::size_t wanted, float bound);
};

/// The distance from a value to an interval.
[[nodiscard]] inline float gap(float low, float high, float from_low, float from_high) noexcept {
  return std::max(std::max(low - from_high, from_low - high), 0.0F);
}

inline std::uint32_t near_boxes_portable(const box_row& boxes, const box3& query, float bound, float* distance) {
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i != leaf_width; ++i) {
    std::array<float, 3> d;
    for (std::size_t a = 0; a != 3; ++a) d[a] = gap(boxes.low[a][i], boxes.high[a][i], query.low[a], query.high[a]);
    distance[i] = squared_distance<float>(d, {0.0F, 0.0F, 0.0F});
    mask |= (distance[i] <= bound ? 1U : 0U) << i;
  }
  return mask;
}

inline void gather_portable(const box_row& boxes, std::uint32_t mask, std::uint32_t first, nearby_leaves& near) {
  for (; mask != 0; mask &= mask - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(mask));
    box_row& row = near.boxes[near.count / leaf_width];
    for (std::size_t a = 0; a != 3; ++a) {
      row.low[a][near.count % leaf_width] = boxes.low[a][i];
      row.high[a][near.count % leaf_width] = boxes.high[a][i];
    }
    near.leaves[near.count++] = first + static_cast<std::uint32_t>(i);
  }
}

inline std::uint32_t distances_portable(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                        float* distance) {
  std::uint32_t mask = 0;
  for (std::size_t i = 0; i != leaf_width; ++i) {
    distance[i] = squared_distance<float>(query, {leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]});
    mask |= (distance[i] <= bound ? 1U : 0U) << i;
  }
  return mask;
}

inline std::size_t in_leaf_portable(const point_row& leaf, const std::array<float, 3>& query, float bound,
                                    float* found) {
  std::size_t count = 0;
  for (std::size_t i = 0; i != leaf_width; ++i) {
    const float d = squared_distance<float>(query, {leaf.axis[0][i], leaf.axis[1][i], leaf.axis[2][i]});
    found[count] = d;
    count += d <= bound ? 1 : 0;
  }
  return count;
}

inline std::size_t near_points_portable(const point_row* leaves, const nearby_leaves& near,
                                        const std::array<float, 3>& query, float bound, std::uint32_t* /*scratch*/,
                                        float* found, std::size_t capacity) {
  const box3 box{query, query};
  std::array<float, leaf_width> distance;
  std::size_t count = 0;
  for (std::size_t first = 0; first < near.count; first += leaf_width) {
    std::uint32_t mask = near_boxes_portable(near.boxes[first / leaf_width], box, bound, distance.data());
    for (; mask != 0; mask &= mask - 1) {
      const std::uint32_t leaf = near.leaves[first + static_cast<std::size_t>(std::countr_zero(mask))];
      count += in_leaf_portable(leaves[leaf], query, bound, found + count);
      if (count > capacity) break;
    }
    if (count > capacity) break;
  }
  std::fill_n(found + count, leaf_width, std::numeric_limits<float>::infinity());
  return count;
}

inline nearest_sum sum_nearest_portable(float* found, std::size_t count, std::size_t wanted, float /*bound*/) {
  float* const last = found + (wanted - 1);
  std::nth_element(found, last, found + count);
  nearest_sum out{0, *last};
  for (std::size_t i = 0; i != wanted; ++i) out.roots += std::sqrt(double{found[i]});
  return out;
}

}  // namespace orbis::cloud::detail
