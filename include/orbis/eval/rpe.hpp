// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Relative pose error: the error of the estimated motion over a short interval. Independent of the world frames of the
/// trajectories.
///
/// Source: J. Sturm et al., "A benchmark for the evaluation of RGB-D SLAM systems", IROS 2012.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/eval/alignment.hpp>
#include <orbis/eval/orientations.hpp>
#include <orbis/eval/statistics.hpp>

namespace orbis::eval {

struct rpe_options {
  std::size_t delta_frames = 1;           ///< interval, number of paired poses; used if `delta_seconds` is empty
  std::optional<double> delta_seconds{};  ///< interval, seconds; motions end at the pose nearest to the interval's end
  double max_time_difference = 0.02;      ///< maximum time difference between paired poses, seconds
};

struct relative_pose_error {
  error_statistics translation;  ///< metres
  error_statistics rotation;     ///< degrees
};

/// Compares the motions of `estimate` and `reference` over a delta of frames or seconds. With a delta in seconds,
/// motions whose duration differs from the delta by more than a quarter, e.g. across a gap in the trajectory, are
/// excluded. Errors: no_data (no motion to compare), invalid_argument (a delta of 0 or less), degenerate (the reference
/// has positions only, see `lacks_orientations`; relative motions require orientations). O(n log n).
/// @pre both trajectories are sorted by time
[[nodiscard]] inline result<relative_pose_error> rpe(const trajectory& estimate, const trajectory& reference,
                                                     const rpe_options& options = {}) {
  constexpr const char* where = "relative pose error";
  if (options.delta_seconds ? !(*options.delta_seconds > 0.0) : options.delta_frames == 0)
    return fail(errc::invalid_argument, where, "the delta must be positive");
  const auto pairs = pair_poses(estimate, reference, options.max_time_difference);
  if (lacks_orientations(pairs))
    return fail(errc::degenerate, where, "the reference has no orientations: all are equal, but the estimate rotates");

  const auto end_of_motion = [&](std::size_t i) -> std::optional<std::size_t> {
    if (!options.delta_seconds)
      return options.delta_frames < pairs.size() - i ? std::optional{i + options.delta_frames} : std::nullopt;
    const double wanted = pairs[i].timestamp + *options.delta_seconds;
    const auto after = std::lower_bound(pairs.begin(), pairs.end(), wanted,
                                        [](const pose_pair& p, double t) { return p.timestamp < t; });
    auto j = static_cast<std::size_t>(after - pairs.begin());
    if (j <= i) return std::nullopt;  // the delta is less than the resolution of the time stamps
    if (j == pairs.size() || (wanted - pairs[j - 1].timestamp < pairs[j].timestamp - wanted)) --j;
    const bool close = std::abs(pairs[j].timestamp - wanted) <= 0.25 * *options.delta_seconds;
    return j > i && close ? std::optional{j} : std::nullopt;
  };

  std::vector<double> metres, degrees;
  for (std::size_t i = 0; i != pairs.size(); ++i) {
    const auto j = end_of_motion(i);
    if (!j) continue;
    const se3 moved = pairs[i].estimate.inverse() * pairs[*j].estimate;
    const se3 truly = pairs[i].reference.inverse() * pairs[*j].reference;
    const se3 error = truly.inverse() * moved;
    metres.push_back(norm(error.translation()));
    degrees.push_back(error.rotation().angle() * 180.0 / std::numbers::pi);
  }
  if (metres.empty()) return fail(errc::no_data, where, "no two paired poses have this time difference");
  return relative_pose_error{summarize(std::move(metres)), summarize(std::move(degrees))};
}

}  // namespace orbis::eval
