// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of select.hpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <orbis/cloud/detail/select/decision.hpp>
#include <orbis/cloud/detail/select/density_judge.hpp>
#include <orbis/cloud/detail/select/surroundings.hpp>
#include <orbis/cloud/select.hpp>

namespace orbis::cloud {
namespace detail {

[[nodiscard]] inline std::vector<char> finite_points(const point_view& points) {
  std::vector<char> out(points.size());
  for (std::size_t i = 0; i != out.size(); ++i) out[i] = is_finite(points[i]) ? 1 : 0;
  return out;
}

/// Indices of the remaining points and, with `non_finite::keep`, of the non-finite ones.
[[nodiscard]] inline std::vector<std::uint32_t> kept_points(const point_view& points, std::span<const char> left,
                                                            const select_options& options) {
  return indices_where(left.size(), [&](std::size_t i) {
    return left[i] != 0 || (options.non_finite == non_finite::keep && !is_finite(points[i]));
  });
}

inline void clear_removed(const surroundings& around, std::span<char> left) {
  for (std::size_t i = 0; i != around.size(); ++i) {
    if (around.gone()[i] != 0) left[around.index(i)] = 0;
  }
}

template <execution_policy Policy>
automatic_result choose_and_filter(const Policy& policy, const point_view& points, std::span<const float> ranges,
                                   const select_options& options, const view_judge& views) {
  constexpr std::size_t enough = 50;
  automatic_result out;
  filter_choice& choice = out.choice;
  choice.evidence.points = points.size();
  std::vector<char> left = finite_points(points);
  choice.evidence.finite = static_cast<std::size_t>(std::ranges::count(left, char{1}));
  if (views.run != nullptr && !views.run(views.context, left, choice)) {
    choice.chain.clear();
    choice.status = choice_status::cancelled;
    out.inliers = kept_points(points, left, options);
    return out;
  }
  surroundings around{policy, points, left, ranges, options.neighbors};
  bool ranged = false;
  for (std::size_t i = 0; i != around.size() && !ranged; ++i) ranged = around.has_range(i);
  for (std::size_t i = 0; i != around.size(); ++i) {
    const bool judged = std::isfinite(around.log_spacing()[i]) && (!ranged || around.has_range(i));
    choice.evidence.judged += judged ? 1 : 0;
  }
  if (choice.evidence.judged < enough) {
    choice.status = choice_status::too_few_points;
  } else {
    judge_points(policy, around, options, choice);
    clear_removed(around, left);
  }
  out.inliers = kept_points(points, left, options);
  return out;
}

}  // namespace detail
}  // namespace orbis::cloud
