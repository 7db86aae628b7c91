// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Density statistics: natural logarithm of a point's spacing relative to its surroundings or to the spacing expected
/// at its range.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/cloud/filter_chain.hpp>

namespace orbis::cloud::detail {

/// Rank of the `q` quantile of `count` values in ascending order. @pre count > 0
[[nodiscard]] inline std::ptrdiff_t quantile_rank(std::ptrdiff_t count, double q) noexcept {
  return static_cast<std::ptrdiff_t>(q * static_cast<double>(count - 1) + 0.5);
}
/// Returns the `q` quantile of `values`; 0 if empty. Reorders `values`. O(n).
template <std::ranges::contiguous_range Values>
[[nodiscard]] double quantile(Values&& values, double q) {
  if (std::ranges::empty(values)) return 0;
  auto* const first = std::ranges::data(values);  // one instantiation for all ranges
  auto* const at = first + quantile_rank(std::ranges::ssize(values), q);
  std::nth_element(first, at, first + std::ranges::size(values));
  return static_cast<double>(*at);
}

/// Returns the weighted median; 0 if empty. Entries are pairs of value and weight.
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

/// Fits a Theil-Sen line through the 40 % quantiles of log spacing in 24 bins of log range. Bins are weighted by their
/// numbers of points, so that ranges that contain few points other than outliers do not distort the line. Empty if
/// fewer than four bins are populated. The slope is clipped to 0 ... 2.5, because spacing can only grow with range, and
/// no faster than the noise. Points with a non-finite spacing or range are ignored. O(n), 4 bytes per point. Source: P.
/// K. Sen, "Estimates of the regression coefficient based on Kendall's tau", JASA 63, 1968.
/// @pre one range for each spacing
[[nodiscard]] inline std::optional<log_line> fit_log_line(std::span<const float> log_spacing,
                                                          std::span<const float> log_range) {
  constexpr std::size_t bins = 24;
  constexpr std::size_t enough = 20;  // points for a usable quantile
  const auto for_each_point = [&](auto&& f) {
    for (std::size_t i = 0; i != log_range.size(); ++i)
      if (std::isfinite(log_spacing[i]) && std::isfinite(log_range[i])) f(log_spacing[i], log_range[i]);
  };
  std::size_t count = 0;
  for_each_point([&](float, float) { ++count; });
  if (count == 0) return std::nullopt;
  std::vector<float> values;  // first used for the ranges
  values.reserve(count);
  for_each_point([&](float, float range) { values.push_back(range); });
  const double low = quantile(values, 0.01);
  const double width = (quantile(values, 0.99) - low) / bins;
  if (!(width > 1e-6)) return std::nullopt;
  const auto bin_of = [&](double range) {
    const double bin = (range - low) / width;
    return bin >= 0 && bin < bins ? static_cast<std::size_t>(bin) : bins;  // the last bin holds the rest
  };
  std::array<std::size_t, bins + 2> begin{};
  for_each_point([&](float, float range) { ++begin[bin_of(range) + 1]; });
  for (std::size_t b = 0; b != bins + 1; ++b) begin[b + 1] += begin[b];
  std::array<std::size_t, bins + 1> next;
  std::copy_n(begin.begin(), next.size(), next.begin());
  for_each_point([&](float spacing, float range) { values[next[bin_of(range)]++] = spacing; });
  struct knot {
    double x, y, weight;
  };
  std::vector<knot> knots;
  for (std::size_t b = 0; b != bins; ++b) {
    const auto members = std::span{values}.subspan(begin[b], begin[b + 1] - begin[b]);
    if (members.size() < enough) continue;
    knots.push_back(
        {low + (static_cast<double>(b) + 0.5) * width, quantile(members, 0.4), static_cast<double>(members.size())});
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

/// Location and width of the bulk of some values: the median, and for either side 1.4826 times the median distance of
/// the values on that side from the median (for a normal distribution, the standard deviation).
struct bulk {
  double median = 0;
  double left_scale = 0;
  double right_scale = 0;
};
[[nodiscard]] inline bulk fit_bulk(std::vector<float> values) {
  bulk out;
  out.median = quantile(values, 0.5);
  if (values.empty()) return out;
  // Ranks of distances follow from ranks of values (on the left, from the other end), so no distances are stored.
  const auto median = static_cast<float>(out.median);
  float* const begin = values.data();
  float* const end = begin + values.size();
  float* const end_below = std::partition(begin, end, [&](float x) { return x <= median; });
  const std::ptrdiff_t count_below = end_below - begin;
  float* const left = begin + (count_below - 1 - quantile_rank(count_below, 0.5));
  std::nth_element(begin, left, end_below);
  out.left_scale = 1.4826 * (out.median - double{*left});
  const std::ptrdiff_t equal = std::count(begin, end_below, median);
  const std::ptrdiff_t rank = quantile_rank(equal + (end - end_below), 0.5);
  if (rank < equal) return out;
  float* const right = end_below + (rank - equal);
  std::nth_element(end_below, right, end);
  out.right_scale = 1.4826 * (double{*right} - out.median);
  return out;
}

/// Deepest valley in the upper tail of a distribution.
struct valley {
  double position = 0;  ///< distance above the median
  double ratio = 0;     ///< height of the later peak / height of the valley
};
/// Smooths the histogram of `values - median` and finds the position in [lowest, 3.2] at which the ratio of the
/// highest peak to its right to the height there is largest. O(n).
[[nodiscard]] inline valley deepest_valley(std::span<const float> values, double median, double lowest) {
  constexpr double first = 0.3;
  constexpr double width = 0.08;
  constexpr std::size_t bins = 58;
  constexpr std::array<double, 5> kernel{1 / 9.0, 2 / 9.0, 3 / 9.0, 2 / 9.0, 1 / 9.0};
  std::array<double, bins + 4> counts{};  // two empty bins at either end, for the kernel
  for (const float v : values) {
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
    // Adding 2 accounts for shot noise: a bump of a few points is not a peak.
    const double ratio = (peak + 2) / (smooth[i] + 2);
    if (x <= 3.2 && ratio >= best.ratio) best = {x, ratio};
    peak = std::max(peak, smooth[i]);
  }
  return best;
}

}  // namespace orbis::cloud::detail
