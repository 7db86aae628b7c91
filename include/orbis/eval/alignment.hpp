// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Alignment of an estimated trajectory with a reference trajectory.
///
/// Source: S. Umeyama, "Least-squares estimation of transformation parameters between two point
/// patterns", PAMI 13(4), 1991.
#pragma once

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include <orbis/core/jacobi.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/trajectory.hpp>

namespace orbis::eval {

/// An estimated pose and the reference pose at the same time.
struct pose_pair {
  double timestamp = 0.0;  ///< time of the estimate, seconds
  se3 estimate;
  se3 reference;
};

/// Pairs the poses of two trajectories by time stamp (nearest pairs first; each pose is used at most once). @pre both
/// trajectories are sorted by time
[[nodiscard]] inline std::vector<pose_pair> pair_poses(const trajectory& estimate, const trajectory& reference,
                                                       double max_time_difference) {
  const auto stamps = [](const trajectory& poses) {
    std::vector<double> t;
    t.reserve(poses.size());
    for (const stamped_pose& p : poses) t.push_back(p.timestamp);
    return t;
  };
  std::vector<pose_pair> pairs;
  for (const auto& [e, r] : associate(stamps(estimate), stamps(reference), max_time_difference))
    pairs.push_back({estimate[e].timestamp, estimate[e].T_world_camera, reference[r].T_world_camera});
  return pairs;
}

struct alignment_options {
  bool with_scale = false;            ///< also estimate a scale, for trajectories of unknown scale
  double max_time_difference = 0.02;  ///< maximum time difference between paired poses, seconds
};

/// The transform `reference ~ scale * rotation * estimate + translation`.
struct alignment {
  double scale = 1.0;
  se3 T_reference_estimate;  ///< the rotation and the translation
  std::size_t pairs = 0;     ///< number of pose pairs used

  /// Transforms a position from the estimate's frame to the reference frame.
  [[nodiscard]] vec3 operator*(const vec3& p) const {
    return T_reference_estimate.rotation() * vec3(scale * p) + T_reference_estimate.translation();
  }
  /// Transforms a pose from the estimate's frame to the reference frame.
  [[nodiscard]] se3 operator*(const se3& pose) const {
    return {T_reference_estimate.rotation() * pose.rotation(), *this * pose.translation()};
  }
};

/// The least-squares alignment of the positions of pose pairs. Errors: no_data (fewer than 3 pairs), degenerate (all
/// positions are on one line, so the rotation about it is not determined; or a position is not finite). O(n).
[[nodiscard]] inline result<alignment> align(const std::vector<pose_pair>& pairs, bool with_scale = false) {
  constexpr const char* where = "trajectory alignment";
  if (pairs.size() < 3)
    return fail(errc::no_data, where,
                "only " + std::to_string(pairs.size()) + " poses have a reference pose; at least 3 are needed");
  const auto n = static_cast<double>(pairs.size());
  vec3 mean_e = zeros<vec3>(), mean_r = zeros<vec3>();
  for (const pose_pair& p : pairs) {
    mean_e += p.estimate.translation() / n;
    mean_r += p.reference.translation() / n;
  }
  mat3 covariance = zeros<mat3>();
  double variance_e = 0.0, variance_r = 0.0;
  for (const pose_pair& p : pairs) {
    const vec3 e = p.estimate.translation() - mean_e;
    const vec3 r = p.reference.translation() - mean_r;
    covariance += r * transposed(e) / n;
    variance_e += squared_norm(e) / n;
    variance_r += squared_norm(r) / n;
  }
  if (!all_finite(covariance) || !std::isfinite(variance_e) || !std::isfinite(variance_r))
    return fail(errc::degenerate, where, "a position is not finite");
  auto [u, s, v] = svd<3>(covariance);
  if (!(s[1] > 1e-9 * std::sqrt(variance_e * variance_r)) || !(s[1] > 0.0))
    return fail(errc::degenerate, where,
                "all positions are collinear: the rotation about their line is not determined");
  // If the best orthogonal matrix is a reflection, the best rotation flips the direction with the smallest singular
  // value.
  if (determinant(u) * determinant(v) < 0.0) {
    s[2] = -s[2];
    set_column(u, 2, vec3(-column_of(u, 2)));
  }
  const so3 rotation(u * transposed(v));
  const double scale = with_scale ? (s[0] + s[1] + s[2]) / variance_e : 1.0;
  return alignment{scale, se3(rotation, mean_r - rotation * vec3(scale * mean_e)), pairs.size()};
}

/// The rigid alignment that is optimal for the orientations (chordal mean) and, with that rotation, for the positions.
/// A single pair is sufficient, and the result is well determined even if the positions hardly differ or are collinear.
/// Use it to transform a map into the reference's world frame; use `align` for the ATE. Errors: no_data (no pairs),
/// degenerate (the orientations have no mean, or a value is not finite). O(n).
///
/// Source: R. Hartley, J. Trumpf, Y. Dai, H. Li, "Rotation averaging", IJCV 103, 2013, section 5.2.
[[nodiscard]] inline result<alignment> align_poses(const std::vector<pose_pair>& pairs) {
  if (pairs.empty()) return fail(errc::no_data, "pose alignment", "no estimated pose has a reference pose");
  const auto n = static_cast<double>(pairs.size());
  vec3 mean_e = zeros<vec3>(), mean_r = zeros<vec3>();
  mat3 mean_rotation = zeros<mat3>();
  for (const pose_pair& p : pairs) {
    mean_e += p.estimate.translation() / n;
    mean_r += p.reference.translation() / n;
    mean_rotation += (p.reference.rotation() * p.estimate.rotation().inverse()).rotation_matrix() / n;
  }
  const auto rotation = nearest_rotation(mean_rotation);
  if (!rotation) return fail(rotation.error());
  const vec3 translation = mean_r - *rotation * mean_e;
  if (!all_finite(translation)) return fail(errc::degenerate, "pose alignment", "a position is not finite");
  return alignment{1.0, se3(*rotation, translation), pairs.size()};
}

/// Aligns two trajectories: pairs poses by time, then aligns the pairs. Errors: those of `align` above.
/// @pre both trajectories are sorted by time
[[nodiscard]] inline result<alignment> align(const trajectory& estimate, const trajectory& reference,
                                             const alignment_options& options = {}) {
  return align(pair_poses(estimate, reference, options.max_time_difference), options.with_scale);
}

}  // namespace orbis::eval
