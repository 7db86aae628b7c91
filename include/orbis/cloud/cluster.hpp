// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Small groups of points that hang in the air: dense enough for every test of density, but apart from
/// the surface.
///
/// Points are linked with those of their neighbours that are no further than a few times their spacing;
/// linked points make components. A component that is small, and separated from the large ones by many
/// local spacings, goes.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/leaf_search.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// Which of two neighbours' spacings says whether they are linked.
enum class cluster_link {
  mutual,  ///< both: a lone point is linked with nothing
  either   ///< the larger one: a lone point is linked with whatever is nearest to it
};

struct cluster_options {
  std::size_t neighbors = 12;  ///< of each point that can be linked with it; > 0
  double reach = 3.0;          ///< linked up to this many times the spacing: the mean distance to the neighbours
  cluster_link link = cluster_link::mutual;
  /// Components of fewer points are small. 0: a 250th of the points, but 30 at least and 200 at most.
  std::size_t min_size = 0;
  /// Small components further from every large one than this many local spacings go: the spacing of the
  /// large one where it is nearest, or that within the small one if it is wider.
  double min_gap = 6.0;
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// The components and which of them go.
struct cluster_result {
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();

  std::vector<std::uint32_t> inliers;    ///< indices, ascending
  std::vector<std::uint32_t> component;  ///< per point, numbered by their first points; `none` where it is in none
  std::vector<std::uint32_t> sizes;      ///< points of each component
  std::vector<char> removed;             ///< for each component: whether it goes
  std::size_t min_size = 0;              ///< as it was applied
};

namespace detail {

/// Disjoint sets that several threads join at once. The root of a set is its least element, whatever the
/// order of joins.
/// Source: R. J. Anderson, H. Woll, "Wait-free parallel algorithms for the union-find problem", STOC 1991.
class disjoint_sets {
 public:
  explicit disjoint_sets(std::size_t count) : parent_(count) {
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
  [[nodiscard]] std::uint32_t root(std::uint32_t i) noexcept {
    for (;;) {
      std::uint32_t up = at(i).load(std::memory_order_relaxed);
      if (up == i) return i;
      const std::uint32_t above = at(up).load(std::memory_order_relaxed);
      if (above != up) at(i).compare_exchange_weak(up, above, std::memory_order_relaxed);  // halve the path
      i = above;
    }
  }

 private:
  [[nodiscard]] std::atomic_ref<std::uint32_t> at(std::uint32_t i) noexcept { return std::atomic_ref{parent_[i]}; }
  std::vector<std::uint32_t> parent_;
};

[[nodiscard]] inline std::size_t smallest_large(const cluster_options& options, std::size_t points) noexcept {
  if (options.min_size != 0) return options.min_size;
  return std::min<std::size_t>(200, std::max<std::size_t>(30, points / 250));
}

}  // namespace detail

/// The components of a neighbour graph that is known already, and which of them go: see `cluster_inliers`.
/// `gone`: for each point whether it is an outlier already, or empty; those take no part, and are not among
/// the inliers. `spacing`: for each point the spacing that counts, metres, or empty for the mean over the
/// first `neighbors` of its row. Points without a row are kept or dropped as `non_finite` says. O(n k).
/// @pre table is that of points; gone and spacing are empty or as long as points; reach, min_gap >= 0
template <execution_policy Policy, point_range Points>
[[nodiscard]] cluster_result cluster_decision(const Policy& policy, const Points& points, const neighbor_table& table,
                                              std::span<const char> gone, std::span<const float> spacing,
                                              const cluster_options& options = {}) {
  const std::size_t count = std::ranges::size(points);
  assert(table.points == count && options.neighbors > 0 && options.reach >= 0 && options.min_gap >= 0);
  assert(gone.empty() || gone.size() == count);
  assert(spacing.empty() || spacing.size() == count);
  const std::size_t width = std::min(options.neighbors, table.width);
  std::vector<float> own;
  if (spacing.empty()) {
    own = mean_knn_distance(policy, table, options.neighbors);
    spacing = own;
  }
  const auto takes_part = [&](std::size_t i) {
    return (gone.empty() || gone[i] == 0) && is_finite(coordinates<float>(detail::point_at(points, i)));
  };
  const auto reach = static_cast<float>(options.reach);
  // Calls `f(neighbour)` for those of a point's neighbours that are linked with it by its row.
  const auto for_each_link = [&](std::size_t i, auto&& f) {
    const neighbor<float>* const row = table.rows.data() + i * table.width;
    for (std::size_t n = 0; n != width; ++n) {
      const auto [j, distance] = row[n];
      if (!gone.empty() && gone[j] != 0) continue;
      const float limit =
          options.link == cluster_link::mutual ? std::min(spacing[i], spacing[j]) : std::max(spacing[i], spacing[j]);
      if (distance <= reach * limit) f(row[n]);
    }
  };

  detail::disjoint_sets sets{count};
  std::vector<char> part(count, 0);
  for_each_index(policy, count, 2048, [&](std::size_t i) {
    if (!takes_part(i)) return;
    part[i] = 1;
    if (width == 0) return;
    for_each_link(i, [&](const neighbor<float>& n) { sets.join(static_cast<std::uint32_t>(i), n.index); });
  });

  cluster_result out;
  out.component.assign(count, cluster_result::none);
  std::size_t present = 0;
  for (std::size_t i = 0; i != count; ++i) {
    if (part[i] == 0) continue;
    ++present;
    const std::uint32_t root = sets.root(static_cast<std::uint32_t>(i));  // the first of its set: numbered by now
    if (root == i) {
      out.component[i] = static_cast<std::uint32_t>(out.sizes.size());
      out.sizes.push_back(0);
    }
    out.component[i] = out.component[root];
    ++out.sizes[out.component[i]];
  }
  out.min_size = detail::smallest_large(options, present);
  out.removed.assign(out.sizes.size(), 0);

  const auto small = [&](std::size_t i) { return out.sizes[out.component[i]] < out.min_size; };
  std::vector<std::uint32_t> main_points;
  std::vector<std::uint32_t> small_points;
  for (std::size_t i = 0; i != count; ++i) {
    if (part[i] != 0) (small(i) ? small_points : main_points).push_back(static_cast<std::uint32_t>(i));
  }
  if (!small_points.empty() && !main_points.empty()) {
    std::vector<std::array<float, 3>> surface;
    surface.reserve(main_points.size());
    for (const std::uint32_t i : main_points) surface.push_back(coordinates<float>(detail::point_at(points, i)));
    const leaf_search search{policy, surface};
    std::vector<char> apart(small_points.size(), 0);
    for_each_chunk(policy, small_points.size(), 64, [&](std::size_t begin, std::size_t end) {
      std::vector<neighbor<float>> nearest;
      for (std::size_t s = begin; s != end; ++s) {
        const std::uint32_t i = small_points[s];
        search.knn(coordinates<float>(detail::point_at(points, i)), 1, nearest);
        double within = 0;  // mean length of its links
        double links = 0;
        for_each_link(i, [&](const neighbor<float>& n) {
          within += n.distance;
          links += 1;
        });
        if (links > 0) within /= links;
        const double local = std::max(within, double{spacing[main_points[nearest.front().index]]});
        const double gap = options.min_gap > 0 ? options.min_gap * local : 0;  // spacings may be infinite
        apart[s] = nearest.front().distance > gap ? 1 : 0;
      }
    });
    for (const std::uint32_t i : small_points) out.removed[out.component[i]] = 1;
    for (std::size_t s = 0; s != small_points.size(); ++s) {
      if (apart[s] == 0) out.removed[out.component[small_points[s]]] = 0;  // one point close to the surface is enough
    }
  }
  out.inliers = detail::indices_where(count, [&](std::size_t i) {
    if (part[i] != 0) return out.removed[out.component[i]] == 0;
    return (gone.empty() || gone[i] == 0) && options.non_finite == non_finite::keep;
  });
  return out;
}

/// Finds the points that `cluster_inliers` returns, and the components they are in.
template <execution_policy Policy, point_range Points>
[[nodiscard]] cluster_result cluster_filter(const Policy& policy, const Points& points,
                                            const cluster_options& options = {}) {
  assert(options.neighbors > 0);
  return cluster_decision(policy, points, all_knn(policy, points, options.neighbors), {}, {}, options);
}

/// The indices, ascending, of the points that are not in a small component of the neighbour graph far from
/// every large one; of all points where no component is large. O(n (log n + k)); the same result for every
/// policy. @pre neighbors > 0, reach >= 0, min_gap >= 0, fewer than 2^32 - 1 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] std::vector<std::uint32_t> cluster_inliers(const Policy& policy, const Points& points,
                                                         const cluster_options& options = {}) {
  return cluster_filter(policy, points, options).inliers;
}

}  // namespace orbis::cloud
