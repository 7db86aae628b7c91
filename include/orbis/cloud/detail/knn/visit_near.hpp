// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The points of a hierarchy from near to far, as long as they are wanted.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>

namespace orbis::cloud::detail {

inline constexpr std::size_t most_box_levels = 8;  // 2^32 points make seven

/// Calls `sink.add(place, squared distance)` for the points within `sink.bound_squared()` of `q`, which may shrink,
/// near leaves first, until it returns false. A place is the number of a point in `members`. @pre q is finite
template <class Sink>
void visit_near(const leaf_hierarchy& tree, const knn_kernels& kernels, const std::array<float, 3>& q, Sink& sink) {
  struct box_to_visit {
    float distance;       // squared
    std::uint32_t level;  // 0: a leaf
    std::uint32_t index;
  };
  assert(tree.levels.size() <= most_box_levels);
  if (tree.leaves.empty()) return;
  const box3 box{q, q};
  std::array<box_to_visit, most_box_levels * leaf_width> open;
  std::size_t count = 0;
  open[count++] = {0, static_cast<std::uint32_t>(tree.levels.size()), 0};
  while (count != 0) {
    const box_to_visit next = open[--count];
    const auto bound = static_cast<float>(sink.bound_squared());
    if (next.distance > bound) continue;
    std::array<float, leaf_width> distance;
    if (next.level == 0) {
      std::uint32_t within = kernels.distances(tree.leaves[next.index], q, bound, distance.data());
      within &= (1U << tree.size_of(next.index)) - 1;
      for (; within != 0; within &= within - 1) {
        const auto n = static_cast<std::size_t>(std::countr_zero(within));
        if (!sink.add(static_cast<std::uint32_t>(next.index * leaf_width + n), distance[n])) return;
      }
      continue;
    }
    const std::uint32_t level = next.level - 1;
    std::uint32_t mask = kernels.near_boxes(tree.levels[level][next.index], box, bound, distance.data());
    const std::size_t children = level == 0 ? tree.leaves.size() : tree.levels[level - 1].size();
    const std::size_t first = count;
    for (; mask != 0; mask &= mask - 1) {
      const auto n = static_cast<std::size_t>(std::countr_zero(mask));
      const std::size_t child = next.index * leaf_width + n;
      if (child >= children) break;  // where the bound is infinite
      open[count++] = {distance[n], level, static_cast<std::uint32_t>(child)};
      if (open[count - 1].distance > open[first].distance) continue;
      std::swap(open[count - 1], open[first]);  // the nearest at the bottom, for now
    }
    if (count > first) std::swap(open[count - 1], open[first]);  // and on top
  }
}

/// The place of the point nearest to some other, and its squared distance.
struct nearest_place {
  std::uint32_t place = std::numeric_limits<std::uint32_t>::max();
  float distance_squared = std::numeric_limits<float>::infinity();
  [[nodiscard]] bool found() const noexcept { return place != std::numeric_limits<std::uint32_t>::max(); }
};

/// The nearest to `q` of the points for whose place `counts(place)` is true; of several the one with the lowest index,
/// except at `q` itself. `found()` is false if there is none. @pre q is finite
template <class Counts>
[[nodiscard]] nearest_place find_nearest(const leaf_hierarchy& tree, const knn_kernels& kernels,
                                         const std::array<float, 3>& q, const Counts& counts) {
  struct {
    const leaf_hierarchy& tree;
    const Counts& counts;
    nearest_place best{};
    [[nodiscard]] float bound_squared() const noexcept { return best.distance_squared; }
    bool add(std::uint32_t place, float d) {
      if (!(d <= best.distance_squared) || !counts(place)) return true;
      if (!best.found() || d < best.distance_squared || tree.members[place] < tree.members[best.place])
        best = {place, d};
      return best.distance_squared > 0;
    }
  } sink{tree, counts};
  visit_near(tree, kernels, q, sink);
  return sink.best;
}

}  // namespace orbis::cloud::detail
