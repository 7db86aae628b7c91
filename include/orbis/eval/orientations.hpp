// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Detection of reference trajectories without orientations: GPS and laser trackers measure positions only, and their
/// files have the same quaternion on every line.
#pragma once

#include <algorithm>
#include <cstddef>
#include <numbers>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/eval/alignment.hpp>

namespace orbis::eval {

/// Minimum number of poses, all equally oriented, for treating a trajectory as one without orientations.
inline constexpr std::size_t min_poses_without_orientation = 5;
/// Maximum angle between orientations that count as equal, radians.
inline constexpr double equal_orientations = 1e-9;

/// Returns true if there are at least `min_poses_without_orientation` pairs and all their reference poses have the same
/// orientation, while the estimates rotate by more than a degree: the reference then has positions only. (If the camera
/// is on rails, the estimates do not rotate either.) O(n).
[[nodiscard]] inline bool lacks_orientations(const std::vector<pose_pair>& pairs) {
  constexpr double degree = std::numbers::pi / 180.0;
  if (pairs.size() < min_poses_without_orientation) return false;
  double reference = 0.0, estimate = 0.0;  // largest angles from the first pose
  for (const pose_pair& p : pairs) {
    const pose_pair& first = pairs.front();
    reference = std::max(reference, (first.reference.rotation().inverse() * p.reference.rotation()).angle());
    estimate = std::max(estimate, (first.estimate.rotation().inverse() * p.estimate.rotation()).angle());
  }
  return reference <= equal_orientations && estimate > degree;
}

/// Returns true if all poses (at least `min_poses_without_orientation`) have the same orientation, but different
/// positions: the reference has positions only, or the camera is on rails. If an estimate is available,
/// `lacks_orientations` distinguishes the two cases. O(n).
[[nodiscard]] inline bool has_equal_orientations(const trajectory& reference) {
  constexpr double least_motion = 1e-3;  // metres
  if (reference.size() < min_poses_without_orientation) return false;
  const se3& first = reference.front().T_world_camera;
  double motion = 0.0;
  for (const stamped_pose& p : reference) {
    if ((first.rotation().inverse() * p.T_world_camera.rotation()).angle() > equal_orientations) return false;
    motion = std::max(motion, norm(p.T_world_camera.translation() - first.translation()));
  }
  return motion > least_motion;
}

/// Returns true if all poses have the identity orientation, but different positions; see `has_equal_orientations`.
/// O(n).
[[nodiscard]] inline bool has_positions_only(const trajectory& reference) {
  return has_equal_orientations(reference) && reference.front().T_world_camera.rotation().angle() <= equal_orientations;
}

}  // namespace orbis::eval
