// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Indices of the points that a filter keeps.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud::detail {

/// Returns the indices, ascending, below `count` for which `keep` is true.
template <std::predicate<std::size_t> Keep>
[[nodiscard]] std::vector<std::uint32_t> indices_where(std::size_t count, Keep&& keep) {
  std::vector<std::uint32_t> out(count);
  std::size_t n = 0;
  for (std::size_t i = 0; i != count; ++i) {
    out[n] = static_cast<std::uint32_t>(i);
    n += keep(i) ? 1 : 0;
  }
  out.resize(n);
  return out;
}

/// Returns the indices, ascending, of the points that are not outliers by their score. Of the points without a score
/// (NaN), finite ones are kept and non-finite ones are treated according to `policy`.
template <std::predicate<float> Outlier>
[[nodiscard]] std::vector<std::uint32_t> inliers_by_score(const point_view& points, std::span<const float> score,
                                                          non_finite policy, Outlier&& outlier) {
  return indices_where(score.size(), [&](std::size_t i) {
    if (!std::isnan(score[i])) return !outlier(score[i]);
    return policy == non_finite::keep || is_finite(points[i]);
  });
}

}  // namespace orbis::cloud::detail
