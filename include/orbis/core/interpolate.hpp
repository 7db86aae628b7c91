// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where a trajectory is between its poses.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include <orbis/core/trajectory.hpp>

namespace orbis {

/// The pose at `timestamp` seconds: between two poses at most `max_gap` seconds apart, the position
/// linearly and the rotation along the shortest way; outside of those, the nearest pose if it is at
/// most `max_distance` seconds away; otherwise none. O(log n). @pre `poses` is sorted by time
[[nodiscard]] inline std::optional<se3> interpolate(const trajectory& poses, double timestamp, double max_gap,
                                                    double max_distance) {
  const auto after = std::lower_bound(poses.begin(), poses.end(), timestamp,
                                      [](const stamped_pose& p, double t) { return p.timestamp < t; });
  if (after != poses.end() && after->timestamp == timestamp) return after->T_world_camera;
  if (after != poses.end() && after != poses.begin()) {
    const stamped_pose& a = after[-1];
    const stamped_pose& b = *after;
    if (b.timestamp - a.timestamp <= max_gap) {
      const double s = (timestamp - a.timestamp) / (b.timestamp - a.timestamp);
      const se3& A = a.T_world_camera;
      const se3& B = b.T_world_camera;
      return se3(A.rotation() * so3::exp(s * (A.rotation().inverse() * B.rotation()).log()),
                 (1.0 - s) * A.translation() + s * B.translation());
    }
  }
  const stamped_pose* nearest = nullptr;
  if (after != poses.end()) nearest = &*after;
  if (after != poses.begin() &&
      (nearest == nullptr || timestamp - after[-1].timestamp <= nearest->timestamp - timestamp))
    nearest = &after[-1];
  if (nearest == nullptr || std::abs(nearest->timestamp - timestamp) > max_distance) return std::nullopt;
  return nearest->T_world_camera;
}

}  // namespace orbis
