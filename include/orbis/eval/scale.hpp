// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Scale of a trajectory relative to its reference, and its uncertainty.
#pragma once

#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/eval/alignment.hpp>

namespace orbis::eval {

struct trajectory_scale {
  double scale = 1.0;      ///< ratio of lengths in the reference to lengths in the estimate
  double deviation = 0.0;  ///< one standard deviation; infinite if it cannot be estimated
  std::size_t pairs = 0;   ///< number of pose pairs used
};

/// The scale of the similarity that best aligns `estimate` with `reference`. Its standard deviation is estimated by
/// omitting each tenth of the poses in turn (jackknife), because the errors of successive poses are correlated. For a
/// depth camera whose depth is `stored / depth_scale`, the true depth scale is `depth_scale / scale`. Errors: those of
/// `align`. O(n log n). Source: B. Efron, "The jackknife, the bootstrap and other resampling plans", SIAM 1982.
/// @pre both trajectories are sorted by time
[[nodiscard]] inline result<trajectory_scale> estimate_scale(const trajectory& estimate, const trajectory& reference,
                                                             double max_time_difference = 0.02) {
  constexpr std::size_t parts = 10;
  const auto pairs = pair_poses(estimate, reference, max_time_difference);
  const auto whole = align(pairs, true);
  if (!whole) return fail(whole.error());
  trajectory_scale found{whole->scale, std::numeric_limits<double>::infinity(), pairs.size()};
  if (pairs.size() < 3 * parts) return found;
  std::vector<double> scales;
  for (std::size_t part = 0; part != parts; ++part) {
    std::vector<pose_pair> rest;
    for (std::size_t i = 0; i != pairs.size(); ++i)
      if (i * parts / pairs.size() != part) rest.push_back(pairs[i]);
    const auto without = align(rest, true);
    if (!without) return found;
    scales.push_back(without->scale);
  }
  double mean = 0.0, squares = 0.0;
  for (const double s : scales) mean += s / static_cast<double>(parts);
  for (const double s : scales) squares += (s - mean) * (s - mean);
  found.deviation = std::sqrt(squares * static_cast<double>(parts - 1) / static_cast<double>(parts));
  return found;
}

}  // namespace orbis::eval
