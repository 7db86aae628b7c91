// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The statistics on which a cloud is judged: how much sparser than its surroundings, or than what
/// the sensor's range explains, each point lies, in natural logarithms.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/cloud/filter_chain.hpp>

namespace orbis::cloud::detail {

/// A value that the fraction `q` of `values` does not exceed; 0 for none. Reorders them. O(n).
[[nodiscard]] inline double quantile(std::span<double> values, double q) {
  if (values.empty()) return 0;
  const auto rank = static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + rank, values.end());
  return values[static_cast<std::size_t>(rank)];
}

/// A value that half of the weight does not exceed; 0 for none. Entries are value and weight.
[[nodiscard]] inline double weighted_median(std::vector<std::array<double, 2>> entries) {
  std::sort(entries.begin(), entries.end());
  double total = 0;
  for (const auto& e : entries) total += e[1];
  double sum = 0;
  for (const auto& e : entries) {
    sum += e[1];
    if (2 * sum >= total) return e[0];
  }
  return 0;
}

/// The Theil-Sen line through the 40 % quantiles of log spacing in 24 bins of log range, weighted by the
/// numbers of their points, so that ranges at which there are few points but outliers do not bend it; empty
/// where fewer than four bins are populated. Range can only thin a cloud out, and no faster than its noise
/// grows: the slope is clipped to 0 ... 2.5. O(n).
/// Source: P. K. Sen, "Estimates of the regression coefficient based on Kendall's tau", JASA 63, 1968.
[[nodiscard]] inline std::optional<log_line> fit_log_line(std::span<const double> log_spacing,
                                                          std::span<const double> log_range) {
  constexpr std::size_t bins = 24;
  constexpr std::size_t enough = 20;  // points for a usable quantile
  if (log_spacing.empty()) return std::nullopt;
  std::vector<double> sorted(log_range.begin(), log_range.end());
  const double low = quantile(sorted, 0.01);
  const double width = (quantile(sorted, 0.99) - low) / bins;
  if (!(width > 1e-6)) return std::nullopt;
  std::array<std::vector<double>, bins> members;
  for (std::size_t i = 0; i != log_range.size(); ++i) {
    const double bin = (log_range[i] - low) / width;
    if (bin >= 0 && bin < bins) members[static_cast<std::size_t>(bin)].push_back(log_spacing[i]);
  }
  struct knot {
    double x, y, weight;
  };
  std::vector<knot> knots;
  for (std::size_t b = 0; b != bins; ++b) {
    if (members[b].size() < enough) continue;
    knots.push_back({low + (static_cast<double>(b) + 0.5) * width, quantile(members[b], 0.4),
                     static_cast<double>(members[b].size())});
  }
  if (knots.size() < 4) return std::nullopt;
  std::vector<std::array<double, 2>> slopes;
  for (std::size_t i = 0; i != knots.size(); ++i) {
    for (std::size_t j = i + 1; j != knots.size(); ++j) {
      slopes.push_back({(knots[j].y - knots[i].y) / (knots[j].x - knots[i].x), knots[i].weight * knots[j].weight});
    }
  }
  log_line line;
  line.slope = std::clamp(weighted_median(std::move(slopes)), 0.0, 2.5);
  std::vector<std::array<double, 2>> intercepts;
  for (const knot& k : knots) intercepts.push_back({k.y - line.slope * k.x, k.weight});
  line.intercept = weighted_median(std::move(intercepts));
  return line;
}

/// Where the bulk of some values lies, and how wide it is to either side: the median, and 1.4826
/// times the median distance to it of the values below and above (for a normal distribution, its
/// standard deviation).
struct bulk {
  double median = 0;
  double left_scale = 0;
  double right_scale = 0;
};
[[nodiscard]] inline bulk bulk_of(std::span<const double> values) {
  std::vector<double> v(values.begin(), values.end());
  bulk out;
  out.median = quantile(v, 0.5);
  std::vector<double> below;
  std::vector<double> above;
  for (const double x : v) {
    if (x <= out.median) below.push_back(out.median - x);
    if (x >= out.median) above.push_back(x - out.median);
  }
  out.left_scale = 1.4826 * quantile(below, 0.5);
  out.right_scale = 1.4826 * quantile(above, 0.5);
  return out;
}

/// The deepest valley of a distribution's upper tail.
struct valley {
  double position = 0;  ///< above the median
  double ratio = 0;     ///< the later peak's height over the valley's
};
/// Searches the smoothed histogram of `values - median` for the place in [lowest, 3.2] where the
/// ratio of the highest later peak to the height is largest. O(n).
[[nodiscard]] inline valley deepest_valley(std::span<const double> values, double median, double lowest) {
  constexpr double first = 0.3;
  constexpr double width = 0.08;
  constexpr std::size_t bins = 58;
  constexpr std::array<double, 5> kernel{1 / 9.0, 2 / 9.0, 3 / 9.0, 2 / 9.0, 1 / 9.0};
  std::array<double, bins + 4> counts{};  // two empty bins at either end, for the kernel
  for (const double v : values) {
    const double bin = (v - median - first) / width;
    if (bin >= 0 && bin < static_cast<double>(bins)) counts[static_cast<std::size_t>(bin) + 2] += 1;
  }
  std::array<double, bins> smooth{};
  for (std::size_t i = 0; i != bins; ++i) {
    for (std::size_t j = 0; j != kernel.size(); ++j) smooth[i] += kernel[j] * counts[i + j];
  }
  valley best;
  double peak = 0;
  for (std::size_t i = bins; i-- > 0;) {
    const double x = first + (static_cast<double>(i) + 0.5) * width;
    if (x < lowest) break;
    // The 2 stands for shot noise: a bump of a few points is no peak.
    const double ratio = (peak + 2) / (smooth[i] + 2);
    if (x <= 3.2 && ratio >= best.ratio) best = {x, ratio};
    peak = std::max(peak, smooth[i]);
  }
  return best;
}

}  // namespace orbis::cloud::detail
