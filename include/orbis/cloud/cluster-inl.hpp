// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of cluster.hpp.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <span>
#include <utility>

#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/detail/knn/knn_kernels.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/neighbor_graph.hpp>
#include <orbis/cloud/detail/knn/squared_distance.hpp>
#include <orbis/cloud/detail/select/decision.hpp>

namespace orbis::cloud {
namespace detail {

inline constexpr std::size_t most_box_levels = 8;  // 2^32 points need seven

/// Calls `sink.add(place, squared distance)` for the points within `sink.bound_squared()` of `q`, near leaves first,
/// until `add` returns false. The bound may shrink during the search. A place is the index of a point in `members`.
/// @pre q is finite
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
      within &= (1U << tree.leaf_size(next.index)) - 1;
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
      if (child >= children) break;  // reached if the bound is infinite
      open[count++] = {distance[n], level, static_cast<std::uint32_t>(child)};
      if (open[count - 1].distance > open[first].distance) continue;
      std::swap(open[count - 1], open[first]);  // keep the nearest at the bottom until the loop ends
    }
    if (count > first) std::swap(open[count - 1], open[first]);  // then move it to the top
  }
}

/// Place and squared distance of the point nearest to a query.
struct nearest_place {
  std::uint32_t place = std::numeric_limits<std::uint32_t>::max();
  float distance_squared = std::numeric_limits<float>::infinity();
  [[nodiscard]] bool found() const noexcept { return place != std::numeric_limits<std::uint32_t>::max(); }
};

/// Finds the point nearest to `q` among those for which `counts(place)` is true. Of several nearest points, it is the
/// one with the lowest index; any of them if they coincide with `q`. `found()` is false if there is no such point.
/// @pre q is finite
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

}  // namespace detail

namespace detail {

/// Disjoint sets that several threads can join concurrently. The root of a set is its smallest element, independent of
/// the order of joins.
/// Source: R. J. Anderson, H. Woll, "Wait-free parallel algorithms for the union-find problem", STOC 1991.
template <class = void>
class basic_disjoint_sets {
 public:
  explicit basic_disjoint_sets(std::size_t count) : parent_(count) {
    for (std::size_t i = 0; i != count; ++i) parent_[i] = static_cast<std::uint32_t>(i);
  }
  void join(std::uint32_t a, std::uint32_t b) noexcept {
    for (;;) {
      a = root(a);
      b = root(b);
      if (a == b) return;
      if (a < b) std::swap(a, b);
      std::uint32_t expected = a;
      if (at(a).compare_exchange_strong(expected, b, std::memory_order_relaxed)) return;
    }
  }
  /// Returns the set index of each element; sets are in the order of their smallest elements. `count`: number of sets.
  [[nodiscard]] std::vector<std::uint32_t> numbered(std::uint32_t& count) && {
    count = 0;
    for (std::size_t i = 0; i != parent_.size(); ++i)  // the parent is smaller and already numbered
      parent_[i] = parent_[i] == i ? count++ : parent_[parent_[i]];
    return std::move(parent_);
  }

 private:
  [[nodiscard]] std::uint32_t root(std::uint32_t i) noexcept {
    for (;;) {
      std::uint32_t up = at(i).load(std::memory_order_relaxed);
      if (up == i) return i;
      const std::uint32_t above = at(up).load(std::memory_order_relaxed);
      if (above != up) at(i).compare_exchange_weak(up, above, std::memory_order_relaxed);  // halve the path
      i = above;
    }
  }
  [[nodiscard]] std::atomic_ref<std::uint32_t> at(std::uint32_t i) noexcept { return std::atomic_ref{parent_[i]}; }
  std::vector<std::uint32_t> parent_;
};
using disjoint_sets = basic_disjoint_sets<>;

[[nodiscard]] inline std::size_t smallest_large(const cluster_options& options, std::size_t points) noexcept {
  if (options.min_size != 0) return options.min_size;
  return std::min<std::size_t>(200, std::max<std::size_t>(30, points / 250));
}

/// Connected components of the neighbour graph, in the order of their first vertices.
struct linked_components {
  std::vector<std::uint32_t> component;  ///< component of each vertex
  std::vector<std::uint32_t> sizes;      ///< number of vertices of each component
  std::vector<char> goes;                ///< for each component, 1 if it is removed
  std::size_t min_size = 0;              ///< the `min_size` that was applied

  [[nodiscard]] bool is_small(std::uint32_t i) const noexcept { return sizes[component[i]] < min_size; }
};

/// Finds the components of a graph and decides which of them to remove. `gone`: for each place, nonzero to ignore the
/// point; empty to ignore none. `spacing`: for each place, metres. O(links); 4 bytes per vertex and 5 per component.
template <execution_policy Policy>
[[nodiscard]] linked_components separate(const Policy& policy, const neighbor_graph& graph, std::span<const char> gone,
                                         std::span<const float> spacing, const cluster_options& options) {
  const std::size_t count = graph.size(), width = std::min(options.neighbors, graph.width());
  const auto reach = static_cast<float>(options.reach);
  const auto takes_part = [&](std::uint32_t i) { return gone.empty() || gone[i] == 0; };
  const auto for_each_link = [&](std::uint32_t i, auto&& f) {
    const std::array<float, 3> at = graph.position(i);
    graph.for_each_neighbor(i, width, [&](std::uint32_t j) {
      if (!takes_part(j)) return;
      const float distance = std::sqrt(squared_distance(at, graph.position(j)));
      if (distance <= reach * std::min(spacing[i], spacing[j])) f(j, distance);
    });
  };
  disjoint_sets sets{count};
  for_each_index(policy, count, 2048, [&](std::size_t vertex) {
    const auto i = static_cast<std::uint32_t>(vertex);
    if (takes_part(i)) for_each_link(i, [&](std::uint32_t j, float) { sets.join(i, j); });
  });
  linked_components out;
  std::uint32_t components = 0;
  out.component = std::move(sets).numbered(components);
  out.sizes.resize(components);
  out.goes.resize(components);
  std::size_t present = 0;
  for (std::uint32_t i = 0; i != count; ++i) {
    if (!takes_part(i)) continue;
    ++present;
    ++out.sizes[out.component[i]];
  }
  out.min_size = smallest_large(options, present);
  std::vector<std::uint32_t> small_ones;
  for (std::uint32_t i = 0; i != count; ++i) {
    if (takes_part(i) && out.is_small(i)) small_ones.push_back(i);
  }
  if (small_ones.empty() || small_ones.size() == present) return out;
  const auto is_main = [&](std::uint32_t j) { return takes_part(j) && !out.is_small(j); };
  const knn_kernels kernels;
  std::vector<char> apart(small_ones.size(), 0);
  for_each_index(policy, small_ones.size(), 64, [&](std::size_t s) {
    const std::uint32_t i = small_ones[s];
    const nearest_place main = find_nearest(graph.tree(), kernels, graph.position(i), is_main);
    assert(main.found());
    double within = 0;  // mean length of the links of the component
    double links = 0;
    for_each_link(i, [&](std::uint32_t, float length) {
      within += length;
      links += 1;
    });
    if (links > 0) within /= links;
    const double local = std::max(within, double{spacing[main.place]});
    const double gap = options.min_gap > 0 ? options.min_gap * local : 0;  // spacings may be infinite
    apart[s] = std::sqrt(main.distance_squared) > gap ? 1 : 0;
  });
  for (const std::uint32_t i : small_ones) out.goes[out.component[i]] = 1;
  for (std::size_t s = 0; s != small_ones.size(); ++s) {
    if (apart[s] == 0) out.goes[out.component[small_ones[s]]] = 0;  // one point near the surface keeps the component
  }
  return out;
}

/// Orders components by their first points. `vertex(i)`: vertex of point `i` of the cloud, negative if it has none.
/// `stays(i)`: true if a point without a vertex is nevertheless an inlier.
template <class Vertex, class Stays>
[[nodiscard]] cluster_result numbered(const linked_components& found, std::size_t count, const Vertex& vertex,
                                      const Stays& stays) {
  cluster_result out;
  out.min_size = found.min_size;
  out.component.assign(count, cluster_result::none);
  std::vector<std::uint32_t> number(found.sizes.size(), cluster_result::none);  // indexed by component of the graph
  for (std::size_t i = 0; i != count; ++i) {
    const std::int64_t v = vertex(i);
    if (v < 0) continue;
    const std::uint32_t c = found.component[static_cast<std::size_t>(v)];
    if (number[c] == cluster_result::none) {
      number[c] = static_cast<std::uint32_t>(out.sizes.size());
      out.sizes.push_back(found.sizes[c]);
      out.removed.push_back(found.goes[c]);
    }
    out.component[i] = number[c];
  }
  out.inliers = indices_where(count, [&](std::size_t i) {
    return out.component[i] != cluster_result::none ? out.removed[out.component[i]] == 0 : stays(i);
  });
  return out;
}

template <execution_policy Policy>
cluster_result filter_clusters(const Policy& policy, const point_view& points, const cluster_options& options) {
  const std::size_t count = points.size();
  const neighbor_graph graph{policy, make_leaves(policy, points, std::min(options.neighbors, count) + 1), count,
                             options.neighbors};
  const std::vector<std::uint32_t> place_of = graph.places(count);
  return numbered(
      separate(policy, graph, {}, graph.mean_distance(policy, options.neighbors), options), count,
      [&](std::size_t i) {
        return place_of[i] == neighbor_graph::no_place ? -1 : static_cast<std::int64_t>(place_of[i]);
      },
      [&](std::size_t) { return options.non_finite == non_finite::keep; });
}

}  // namespace detail

}  // namespace orbis::cloud
