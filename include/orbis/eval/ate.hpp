// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Absolute trajectory error: the error of the estimated positions after alignment.
///
/// Source: J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.
#pragma once

#include <utility>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/eval/alignment.hpp>
#include <orbis/eval/statistics.hpp>

namespace orbis::eval {

struct absolute_trajectory_error {
  error_statistics translation;  ///< metres
  alignment aligned;             ///< alignment of the estimate with the reference
};

/// Aligns `estimate` to `reference` and compares the positions of paired poses. Errors: no_data (fewer than 3 pairs),
/// degenerate (all positions are on one line). O(n log n).
/// @pre both trajectories are sorted by time
[[nodiscard]] inline result<absolute_trajectory_error> ate(const trajectory& estimate, const trajectory& reference,
                                                           const alignment_options& options = {}) {
  const auto pairs = pair_poses(estimate, reference, options.max_time_difference);
  const auto aligned = align(pairs, options.with_scale);
  if (!aligned) return fail(aligned.error());
  std::vector<double> errors;
  errors.reserve(pairs.size());
  for (const pose_pair& p : pairs)
    errors.push_back(norm(*aligned * p.estimate.translation() - p.reference.translation()));
  return absolute_trajectory_error{summarize(std::move(errors)), *aligned};
}

}  // namespace orbis::eval
