// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The neighbours of what is left of a cloud, and the tests that share them: of density, of isolation
/// and of clusters.
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

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/detail/select/local_shape.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud::detail {

/// What is left of a cloud, copied, with its neighbours. Log spacings are NaN for points that have none:
/// alone, or identical to all their neighbours.
class surroundings {
 public:
  static constexpr std::size_t width = 12;       ///< neighbours in the table, more if more are averaged
  static constexpr std::size_t shape_width = 8;  ///< neighbours whose shape is looked at
  static constexpr float bulk_end = 0.3F;        ///< less sparse than this beyond usual, log, is no matter of shape

  /// `left`: for each point whether it is there; those that are not finite are not.
  /// `ranges`: metres, for each point of the cloud, NaN where unknown.
  template <execution_policy Policy, point_range Points>
  surroundings(const Policy& policy, const Points& points, std::span<const char> left, std::span<const float> ranges,
               std::size_t neighbors) {
    for (std::size_t i = 0; i != left.size(); ++i) {
      const auto p = coordinates<float>(point_at(points, i));
      if (left[i] == 0 || !is_finite(p)) continue;
      index_.push_back(static_cast<std::uint32_t>(i));
      points_.push_back(p);
      const float range = ranges[i];
      log_range_.push_back(range >= 0 ? std::log(std::max(range, 1e-3F)) : nan);
    }
    measure(policy, neighbors);
  }

  [[nodiscard]] std::size_t size() const noexcept { return points_.size(); }
  /// Of point `i` in the cloud.
  [[nodiscard]] std::uint32_t index(std::size_t i) const noexcept { return index_[i]; }
  [[nodiscard]] std::span<const float> log_spacing() const noexcept { return log_spacing_; }
  [[nodiscard]] std::span<const float> log_range() const noexcept { return log_range_; }
  /// Points that a test has removed.
  [[nodiscard]] std::span<const char> gone() const noexcept { return gone_; }
  /// Takes removals back. @pre as many as points
  void restore(std::vector<char> gone) { gone_ = std::move(gone); }

  /// The log spacing that is usual around each point.
  template <execution_policy Policy>
  std::span<const float> local_spacing(const Policy& policy) {
    if (local_.empty()) local_ = smoothed_over_neighbors(policy, table_, log_spacing_);
    return local_;
  }

  /// How much sparser each point is than usual, log; NaN where that is not known.
  template <execution_policy Policy>
  [[nodiscard]] std::vector<float> residuals(const Policy& policy, const density_step& step) {
    std::vector<float> out(size());
    if (step.mode == filter_mode::local_log_statistical) {
      const auto local = local_spacing(policy);
      for (std::size_t i = 0; i != size(); ++i) out[i] = log_spacing_[i] - local[i] - static_cast<float>(step.offset);
    } else {
      for (std::size_t i = 0; i != size(); ++i) out[i] = log_spacing_[i] - usual(step.usual, i);
    }
    return out;
  }

  /// Works out the shape around the points that are sparser than the bulk by `residual` or by `usual`.
  template <execution_policy Policy>
  void look_at_shapes(const Policy& policy, std::span<const float> residual, const log_line& line) {
    for_each_index(policy, size(), 512, [&](std::size_t i) {
      if (!std::isnan(flat_[i]) || (!(residual[i] >= bulk_end) && is_bulk(line, i))) return;
      const auto row = table_[i];
      flat_[i] = static_cast<float>(off_plane(points_, i, row.first(std::min(shape_width, row.size()))));
    });
  }
  /// Whether the point lies in a plane with its neighbours, or beside enough that do at its own scale.
  /// @pre its shape and that of its sparse neighbours was looked at, with the same line
  [[nodiscard]] bool on_surface(std::size_t i, const surface_test& test, const log_line& line) const {
    const auto is_flat = [&](std::size_t j) { return double{flat_[j]} < test.flatness; };
    if (is_flat(i)) return true;
    std::size_t support = 0;
    const auto row = table_[i];
    for (const auto& n : row.first(std::min(shape_width, row.size()))) {
      if (double{log_spacing_[n.index]} < double{log_spacing_[i]} - test.same_scale) continue;
      if (is_bulk(line, n.index) || is_flat(n.index)) ++support;
    }
    return support >= test.support;
  }

  template <execution_policy Policy>
  void apply(const Policy& policy, const density_step& step) {
    const std::vector<float> residual = residuals(policy, step);
    look_at_shapes(policy, residual, step.surface_line());
    for_each_index(policy, size(), 1024, [&](std::size_t i) {
      if (gone_[i] == 0 && double{residual[i]} > step.threshold && !on_surface(i, step.surface, step.surface_line()))
        gone_[i] = 1;
    });
  }

  template <execution_policy Policy>
  void apply(const Policy& policy, const isolation_step& step) {
    const auto local = local_spacing(policy);
    std::vector<float> spacing(size());
    for (std::size_t i = 0; i != size(); ++i) {
      const float around = local[i] + static_cast<float>(step.offset);
      const float line = usual(step.usual, i);
      const float widest = line > around ? line : around;
      spacing[i] = std::isnan(widest) ? std::numeric_limits<float>::infinity() : std::exp(widest);  // linked by others
    }
    const auto alone = outside_components(
        policy, spacing, {.neighbors = width, .reach = step.reach, .min_size = step.min_size, .min_gap = 0});
    for (const std::uint32_t i : alone) {
      if (!std::isnan(log_spacing_[i])) gone_[i] = 1;  // identical points are not alone
    }
  }

  template <execution_policy Policy>
  void apply(const Policy& policy, const cluster_options& options) {
    for (const std::uint32_t i : outside_components(policy, {}, options)) gone_[i] = 1;
  }

 private:
  static constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  static constexpr float unknown = nan;

  [[nodiscard]] float usual(const log_line& line, std::size_t i) const noexcept {
    return static_cast<float>(line.slope != 0 ? line.at(double{log_range_[i]}) : line.intercept);
  }
  [[nodiscard]] bool is_bulk(const log_line& line, std::size_t i) const noexcept {
    return log_spacing_[i] - usual(line, i) < bulk_end;
  }
  /// All that follows from the points.
  template <execution_policy Policy>
  void measure(const Policy& policy, std::size_t neighbors) {
    table_ = all_knn(policy, points_, std::max(width, neighbors));
    gone_.assign(size(), 0);
    flat_.assign(size(), unknown);
    log_spacing_ = mean_knn_distance(policy, table_, neighbors);
    for (float& s : log_spacing_) s = s > 0 && std::isfinite(s) ? std::log(s) : nan;
  }

  /// Points still there that the components leave out.
  template <execution_policy Policy>
  [[nodiscard]] std::vector<std::uint32_t> outside_components(const Policy& policy, std::span<const float> spacing,
                                                              const cluster_options& options) const {
    const cluster_result found = cluster_decision(policy, points_, table_, gone_, spacing, options);
    std::vector<std::uint32_t> out;
    std::size_t next = 0;
    for (std::uint32_t i = 0; i != size(); ++i) {
      const bool inlier = next != found.inliers.size() && found.inliers[next] == i;
      next += inlier ? 1 : 0;
      if (!inlier && gone_[i] == 0) out.push_back(i);
    }
    return out;
  }

  std::vector<std::uint32_t> index_;
  std::vector<std::array<float, 3>> points_;
  std::vector<float> log_range_;
  std::vector<float> log_spacing_;
  std::vector<float> local_;  ///< empty until asked for
  std::vector<float> flat_;   ///< `off_plane`; NaN until looked at
  std::vector<char> gone_;
  neighbor_table table_;
};

}  // namespace orbis::cloud::detail
