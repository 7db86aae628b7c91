// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Chooses density tests and their thresholds: the valley between two populations of points that are not on surfaces.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/select/log_density.hpp>
#include <orbis/cloud/detail/select/surroundings.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/core/execution.hpp>

namespace orbis::cloud::detail {

/// A reference for the usual spacing, and the spread of the cloud around it.
struct reference {
  density_step step;
  bulk width;  ///< width of the residuals, whose median is 0
};

/// A single width of the bulk, for comparing references.
[[nodiscard]] inline double bulk_width(const bulk& b) noexcept { return std::max(b.left_scale, 0.5 * b.right_scale); }

[[nodiscard]] inline std::vector<float> finite_values(std::vector<float> values) {
  std::erase_if(values, [](float v) { return !std::isfinite(v); });
  return values;
}

/// Shifts the reference to the bulk's median, and measures the bulk.
template <execution_policy Policy>
void center(const Policy& policy, surroundings& around, reference& r) {
  r.width = fit_bulk(finite_values(around.residuals(policy, r.step)));
  (r.step.mode == filter_mode::local_log_statistical ? r.step.offset : r.step.usual.intercept) += r.width.median;
  r.width.median = 0;
}

/// Options of a density test.
struct threshold_options {
  double lowest = 0.55;         ///< lower limit of the threshold
  double without_valley = 1.6;  ///< lower limit of the threshold if there is only one population
  bool shoulders = true;        ///< true to detect a shoulder of the bulk as well; flying pixels form one
  double least_ratio = 1.6;     ///< minimum `ratio` of a valley
  bool needs_valley = false;    ///< true to remove nothing if there is no valley
};

/// Finds the threshold of a density test. Sparse points on surfaces, such as regions seen from afar or at a grazing
/// angle, are not outliers, regardless of their number. The histogram therefore contains only the other points, and the
/// threshold is high enough that at most about 40 % of the points above it lie on surfaces.
template <execution_policy Policy>
[[nodiscard]] density_evidence find_threshold(const Policy& policy, surroundings& around, const reference& r,
                                              const threshold_options& manner) {
  constexpr double first = 0.3;
  constexpr double bin_width = 0.08;
  constexpr std::size_t bins = 64;
  constexpr double most_surface = 0.4;
  constexpr double chance = 10;  // points; fewer are not significant
  const std::vector<float> residual = around.residuals(policy, r.step);
  around.compute_shapes(policy, residual, r.step.surface_line());
  std::vector<float> loose;  // residuals of sparse points that are not on surfaces
  std::array<double, bins> all{};
  std::array<double, bins> surface{};
  for (std::size_t i = 0; i != residual.size(); ++i) {
    const double x = residual[i];
    if (!(x >= first)) continue;
    const bool on_surface = around.on_surface(i, r.step.surface, r.step.surface_line());
    if (!on_surface) loose.push_back(residual[i]);
    const auto bin = static_cast<std::size_t>(std::min((x - first) / bin_width, bins - 1.0));
    all[bin] += 1;
    surface[bin] += on_surface ? 1 : 0;
  }
  density_evidence out;
  out.mode = r.step.mode;
  out.left_scale = r.width.left_scale;
  out.right_scale = r.width.right_scale;
  out.surface_end = first;
  double beyond = 0;
  double surface_beyond = 0;
  for (std::size_t b = bins; b-- > 0;) {
    beyond += all[b];
    surface_beyond += surface[b];
    if (surface_beyond <= most_surface * beyond + chance) continue;
    out.surface_end = first + bin_width * static_cast<double>(b + 1);
    break;
  }
  const double scale = r.width.left_scale;
  const valley v = deepest_valley(loose, 0, std::max({manner.lowest, std::min(2.5 * scale, 1.4), out.surface_end}));
  out.valley_position = v.position;
  out.valley_ratio = v.ratio;
  const bool two_populations = v.ratio > manner.least_ratio;
  if (!two_populations && manner.needs_valley) {
    out.threshold = std::numeric_limits<double>::infinity();
    return out;
  }
  out.source = two_populations ? threshold_source::valley : threshold_source::bulk;
  out.threshold = two_populations ? v.position : std::max({manner.without_valley, 6 * scale, out.surface_end});
  const double shoulder_start = std::max({0.75, 5 * scale, out.surface_end});
  if (manner.shoulders && shoulder_start < out.threshold) {
    const auto n = std::ranges::count_if(loose, [&](double x) { return x > shoulder_start && x <= out.threshold; });
    out.shoulder = static_cast<double>(n) / static_cast<double>(residual.size());
    if (out.shoulder > (v.ratio > 3 ? 0.025 : 0.01)) {
      out.source = threshold_source::shoulder;
      out.threshold = shoulder_start;
    }
  }
  return out;
}

/// Evaluates the remaining points of a cloud without views; adds the resulting steps and their evidence. The tests
/// store their removals in `around`.
template <execution_policy Policy>
void judge_points(const Policy& policy, surroundings& around, const select_options& options, filter_choice& choice) {
  filter_evidence& evidence = choice.evidence;
  // Choose the reference with the narrower bulk, with a bonus for the simpler one.
  reference global;
  global.step.neighbors = options.neighbors;
  center(policy, around, global);
  evidence.median_spacing = std::exp(global.step.usual.intercept);
  evidence.global_scale = bulk_width(global.width);
  std::optional<reference> ranged;
  {
    std::vector<float> log_range(around.size());
    for_each_index(policy, log_range.size(), 4096, [&](std::size_t i) { log_range[i] = around.log_range(i); });
    const auto line = fit_log_line(around.log_spacing(), log_range);
    std::vector<float>{}.swap(log_range);
    if (line) {
      ranged = global;
      ranged->step.mode = filter_mode::range_log_statistical;
      ranged->step.usual = *line;
      center(policy, around, *ranged);
      evidence.range_scale = bulk_width(ranged->width);
    }
  }
  evidence.range_exponent = ranged ? ranged->step.usual.slope : 0;
  const bool grows = evidence.range_exponent > 0;
  const bool by_range = grows && *evidence.range_scale < 0.85 * evidence.global_scale;
  const reference& usual = by_range ? *ranged : global;
  evidence.left_scale = usual.width.left_scale;
  evidence.right_scale = usual.width.right_scale;
  reference local = usual;
  local.step.mode = filter_mode::local_log_statistical;
  center(policy, around, local);
  evidence.local_scale = bulk_width(local.width);

  // Applies a step and returns the share that it removes. Undoes a step that removes too much, because outliers are a
  // minority.
  const auto try_step = [&](const auto& step) {
    constexpr double most = 0.4;
    std::vector<char> before(around.gone().begin(), around.gone().end());
    const auto count = [](std::span<const char> gone) {
      return static_cast<double>(std::ranges::count(gone, char{1}));
    };
    around.apply(policy, step);
    const double share = (count(around.gone()) - count(before)) / static_cast<double>(evidence.finite);
    if (share > most) {
      around.restore(std::move(before));
      return 0.0;
    }
    if (share > 0) choice.chain.emplace_back(step);
    return share;
  };
  const auto test = [&](reference r, const threshold_options& manner) {
    r.step.surface_spacing = usual.step.usual;
    density_evidence found = find_threshold(policy, around, r, manner);
    if (std::isfinite(found.threshold)) {
      density_step step = r.step;
      step.threshold = found.threshold;
      found.removed = try_step(step);
    }
    evidence.density.push_back(found);
  };
  test(usual, {});
  // A reference over range can hide outliers that are spread over all ranges; a constant reference detects them.
  if (by_range) {
    test(global, {.shoulders = false, .least_ratio = 3, .needs_valley = true});
  } else if (grows) {
    test(*ranged, {.shoulders = false, .least_ratio = 3, .needs_valley = true});
  }
  test(local, {.lowest = 1.0, .shoulders = false});

  isolation_step isolation;
  isolation.neighbors = options.neighbors;
  isolation.usual = usual.step.usual;
  isolation.offset = local.step.offset;
  evidence.isolated = try_step(isolation);
  cluster_options cluster;
  cluster.min_size = std::clamp<std::size_t>(around.size() / 125, 30, 300);
  cluster.min_gap = 4;
  evidence.clustered = try_step(cluster);
}

}  // namespace orbis::cloud::detail
