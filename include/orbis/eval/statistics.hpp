// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Summary statistics of a list of errors.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace orbis::eval {

/// Error statistics in the unit of the errors. `median` and `p95` are interpolated between adjacent values.
struct error_statistics {
  std::size_t count = 0;
  double rmse = 0.0;
  double mean = 0.0;
  double median = 0.0;
  double p95 = 0.0;
  double max = 0.0;
};

/// The `q`-quantile (0 to 1) of `sorted`, interpolated linearly between adjacent values.
/// @pre !sorted.empty(), sorted
[[nodiscard]] inline double quantile(std::span<const double> sorted, double q) {
  const double at = q * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<std::size_t>(at);
  const auto above = std::min(below + 1, sorted.size() - 1);
  return sorted[below] + (at - static_cast<double>(below)) * (sorted[above] - sorted[below]);
}

/// Statistics of non-negative errors; all 0 for an empty list. O(n log n).
[[nodiscard]] inline error_statistics summarize(std::vector<double> errors) {
  if (errors.empty()) return {};
  std::sort(errors.begin(), errors.end());
  double sum = 0.0, squares = 0.0;
  for (const double e : errors) {
    sum += e;
    squares += e * e;
  }
  const auto n = static_cast<double>(errors.size());
  return {errors.size(), std::sqrt(squares / n), sum / n, quantile(errors, 0.5), quantile(errors, 0.95), errors.back()};
}

}  // namespace orbis::eval
