// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The neighbours of the remaining points of a cloud, and the tests that share them: density, isolation and clusters.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/cluster-inl.hpp>
#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/knn/neighbor_graph.hpp>
#include <orbis/cloud/detail/knn/squared_distance.hpp>
#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/detail/select/local_shape.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud::detail {

/// Values for a subset of the points 0 ... n - 1. Takes 0.25 bytes per point and 4 bytes per value; twice as much while
/// values are added.
class sparse_values {
 public:
  /// Adds `value(i)` for each i < count that has no value yet and for which `wanted(i)` is true. Both functions are
  /// called from several threads. O(count); the result is the same for every policy. @pre count is the same in all
  /// calls
  template <execution_policy Policy, class Wanted, class Value>
  void add(const Policy& policy, std::size_t count, const Wanted& wanted, const Value& value) {
    const sparse_values before = *this;
    words_.resize((count + 63) / 64);
    for_each_index(policy, words_.size(), 64, [&](std::size_t w) {
      for (std::size_t i = 64 * w; i != count && i != 64 * (w + 1); ++i) {
        const std::uint64_t bit = std::uint64_t{1} << (i % 64);
        if ((words_[w].mask & bit) == 0 && wanted(i)) words_[w].mask |= bit;
      }
    });
    std::uint32_t sum = 0;
    for (word& w : words_) {
      w.before = sum;
      sum += static_cast<std::uint32_t>(std::popcount(w.mask));
    }
    values_.resize(sum);
    for_each_index(policy, words_.size(), 8, [&](std::size_t w) {
      std::size_t at = words_[w].before;
      for (std::uint64_t left = words_[w].mask; left != 0; left &= left - 1, ++at) {
        const std::size_t i = 64 * w + static_cast<std::size_t>(std::countr_zero(left));
        values_[at] = before.has(i) ? before.at(i) : value(i);
      }
    });
  }
  [[nodiscard]] bool has(std::size_t i) const noexcept {
    return i / 64 < words_.size() && (words_[i / 64].mask >> (i % 64) & 1U) != 0;
  }
  /// Returns the value of a point; NaN if it has none.
  [[nodiscard]] float at(std::size_t i) const noexcept {
    if (!has(i)) return std::numeric_limits<float>::quiet_NaN();
    const word& w = words_[i / 64];
    const std::uint64_t below = w.mask & ((std::uint64_t{1} << (i % 64)) - 1);
    return values_[w.before + static_cast<std::size_t>(std::popcount(below))];
  }

 private:
  struct word {
    std::uint64_t mask = 0;
    std::uint32_t before = 0;  ///< number of values in the preceding words
  };
  std::vector<word> words_;
  std::vector<float> values_;
};

/// The remaining points of a cloud with their neighbours. Points are identified by the places of a `neighbor_graph`;
/// all data are indexed by place. Log spacings are NaN for single points and for points identical to all their
/// neighbours. About 45 bytes per point.
template <class = void>
class basic_surroundings {
 public:
  static constexpr std::size_t width = 12;       ///< number of neighbours in the graph; increased if more are averaged
  static constexpr std::size_t shape_width = 8;  ///< number of neighbours that determine the shape
  static constexpr float bulk_end = 0.3F;        ///< residual at which the bulk ends; below it, no shape is needed

  /// Builds the neighbour graph. `left`: for each point, nonzero to include it; non-finite points are never included.
  /// `ranges`: for each point of the cloud, metres, non-finite or negative if unknown; empty if all are unknown. The
  /// ranges must outlive this object.
  template <execution_policy Policy>
  basic_surroundings(const Policy& policy, const point_view& points, std::span<const char> left,
                     std::span<const float> ranges, std::size_t neighbors)
      : ranges_{ranges} {
    const std::size_t most_copies = std::min(std::max(width, neighbors), left.size()) + 1;
    measure(policy, make_leaves(policy, points, most_copies, left), left.size(), neighbors);
  }

  [[nodiscard]] std::size_t size() const noexcept { return graph_.size(); }
  /// Cloud index of the point at place `i`.
  [[nodiscard]] std::uint32_t index(std::size_t i) const noexcept { return graph_.index(i); }
  [[nodiscard]] std::span<const float> log_spacing() const noexcept { return log_spacing_; }
  [[nodiscard]] bool has_range(std::size_t i) const noexcept {
    return !ranges_.empty() && std::isfinite(ranges_[index(i)]) && ranges_[index(i)] >= 0;
  }
  /// Log range of a point; NaN if unknown.
  [[nodiscard]] float log_range(std::size_t i) const noexcept {
    return has_range(i) ? std::log(std::max(ranges_[index(i)], 1e-3F)) : nan;
  }
  /// For each place, nonzero if a test removed the point.
  [[nodiscard]] std::span<const char> gone() const noexcept { return gone_; }
  /// Restores an earlier state of the removals. @pre one entry per point
  void restore(std::vector<char> gone) { gone_ = std::move(gone); }

  /// Returns the usual log spacing around each point.
  template <execution_policy Policy>
  std::span<const float> local_spacing(const Policy& policy) {
    if (local_.empty()) local_ = smoothed_over_neighbors(policy, graph_, log_spacing_);
    return local_;
  }

  /// Returns the log spacing of each point above the usual one; NaN if unknown.
  template <execution_policy Policy>
  [[nodiscard]] std::vector<float> residuals(const Policy& policy, const density_step& step) {
    const bool is_local = step.mode == filter_mode::local_log_statistical;
    const auto local = is_local ? local_spacing(policy) : std::span<const float>{};  // first, because it allocates
    std::vector<float> out(size());
    if (is_local) {
      for (std::size_t i = 0; i != size(); ++i) out[i] = log_spacing_[i] - local[i] - static_cast<float>(step.offset);
    } else {
      for_each_index(policy, size(), 4096, [&](std::size_t i) { out[i] = log_spacing_[i] - usual(step.usual, i); });
    }
    return out;
  }

  /// Computes the shapes around the points whose `residual`, or whose log spacing above `line`, is beyond the bulk.
  template <execution_policy Policy>
  void compute_shapes(const Policy& policy, std::span<const float> residual, const log_line& line) {
    flat_.add(
        policy, size(), [&](std::size_t i) { return residual[i] >= bulk_end || !is_bulk(line, i); },
        [&](std::size_t i) { return static_cast<float>(off_plane_at(i)); });
  }
  /// Returns true if the point lies in a plane with its neighbours, or has enough neighbours of similar spacing that
  /// belong to the bulk or lie in a plane.
  /// @pre the shapes of the point and of its sparse neighbours were computed with the same line
  [[nodiscard]] bool on_surface(std::size_t i, const surface_test& test, const log_line& line) const {
    const auto is_flat = [&](std::size_t j) { return double{flat_.at(j)} < test.flatness; };
    if (is_flat(i)) return true;
    std::size_t support = 0;
    graph_.for_each_neighbor(i, std::min(shape_width, graph_.width()), [&](std::uint32_t n) {
      if (double{log_spacing_[n]} < double{log_spacing_[i]} - test.same_scale) return;
      if (is_bulk(line, n) || is_flat(n)) ++support;
    });
    return support >= test.support;
  }

  template <execution_policy Policy>
  void apply(const Policy& policy, const density_step& step) {
    const std::vector<float> residual = residuals(policy, step);
    compute_shapes(policy, residual, step.surface_line());
    for_each_index(policy, size(), 1024, [&](std::size_t i) {
      if (gone_[i] == 0 && double{residual[i]} > step.threshold && !on_surface(i, step.surface, step.surface_line()))
        gone_[i] = 1;
    });
  }

  template <execution_policy Policy>
  void apply(const Policy& policy, const isolation_step& step) {
    local_spacing(policy);
    std::vector<float> spacing = std::exchange(local_, {});  // computed again if needed
    for (std::size_t i = 0; i != size(); ++i) {
      const float around = spacing[i] + static_cast<float>(step.offset);
      const float line = usual(step.usual, i);
      const float widest = line > around ? line : around;
      // With an infinite spacing, only the spacing of the other point limits a link.
      spacing[i] = std::isnan(widest) ? std::numeric_limits<float>::infinity() : std::exp(widest);
    }
    const cluster_options options{.neighbors = width, .reach = step.reach, .min_size = step.min_size, .min_gap = 0};
    remove_components(policy, spacing, options, [&](std::size_t i) {
      return !std::isnan(log_spacing_[i]);  // identical points are not isolated
    });
  }

  template <execution_policy Policy>
  void apply(const Policy& policy, const cluster_options& options) {
    remove_components(policy, graph_.mean_distance(policy, options.neighbors), options,
                      [](std::size_t) { return true; });
  }

 private:
  static constexpr float nan = std::numeric_limits<float>::quiet_NaN();

  [[nodiscard]] float usual(const log_line& line, std::size_t i) const noexcept {
    return static_cast<float>(line.slope != 0 ? line.at(double{log_range(i)}) : line.intercept);
  }
  [[nodiscard]] bool is_bulk(const log_line& line, std::size_t i) const noexcept {
    return log_spacing_[i] - usual(line, i) < bulk_end;
  }
  /// Computes all data that depend only on the points.
  template <execution_policy Policy>
  void measure(const Policy& policy, leaf_hierarchy tree, std::size_t points, std::size_t neighbors) {
    graph_ = neighbor_graph{policy, std::move(tree), points, std::max(width, neighbors)};
    gone_.assign(size(), 0);
    log_spacing_ = graph_.mean_distance(policy, neighbors);
    for_each_index(policy, size(), 4096, [&](std::size_t i) {
      float& s = log_spacing_[i];
      s = s > 0 && std::isfinite(s) ? std::log(s) : nan;
    });
  }

  /// Returns `off_plane` of the nearest neighbours.
  [[nodiscard]] double off_plane_at(std::size_t i) const {
    std::array<std::array<float, 3>, shape_width + 1> points;
    std::array<neighbor<float>, shape_width> row;
    points[0] = graph_.position(i);
    const std::size_t count = std::min(shape_width, graph_.width());
    std::uint32_t n = 0;
    graph_.for_each_neighbor(i, count, [&](std::uint32_t j) {
      points[n + 1] = graph_.position(j);
      row[n] = {n + 1, std::sqrt(squared_distance(points[0], points[n + 1]))};
      ++n;
    });
    return off_plane(points, 0, std::span{row}.first(count));
  }

  /// Removes the points of the removable components for which `can_go(i)` is true.
  template <execution_policy Policy, class CanGo>
  void remove_components(const Policy& policy, std::span<const float> spacing, const cluster_options& options,
                         const CanGo& can_go) {
    const linked_components found = separate(policy, graph_, gone_, spacing, options);
    for (std::uint32_t i = 0; i != size(); ++i) {
      if (gone_[i] == 0 && found.goes[found.component[i]] != 0 && can_go(i)) gone_[i] = 1;
    }
  }

  std::span<const float> ranges_;  ///< one per point of the cloud
  neighbor_graph graph_;
  std::vector<float> log_spacing_;
  std::vector<float> local_;  ///< usual log spacing around each point; empty before the first use
  sparse_values flat_;        ///< `off_plane` of the analysed points
  std::vector<char> gone_;
};
using surroundings = basic_surroundings<>;

}  // namespace orbis::cloud::detail
