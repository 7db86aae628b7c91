// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A part of a map as a bundle adjustment problem: copied from the map, solved, and solved again after exclusion of
/// outliers.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// Keyframes, landmarks and observations of a map, as arrays.
struct bundle_snapshot {
  std::vector<keyframe_id> keyframes;                      ///< in ascending order
  std::vector<std::uint8_t> is_fixed;                      ///< for each keyframe: 1 if its pose is held fixed
  std::vector<se3> poses;                                  ///< `T_world_camera` of each keyframe
  std::vector<landmark_id> landmarks;                      ///< in ascending order
  std::vector<vec3> points;                                ///< position of each landmark in the world frame, metres
  std::vector<optimize::bundle_observation> observations;  ///< `pose` and `point` are indices into the arrays above
  std::vector<observation> sources;                        ///< keyframe and keypoint of each observation
  keyframe_id end_keyframe = 0;                            ///< later keyframes have this id or a greater one
  landmark_id end_landmark = 0;

  /// Returns true if there is nothing to adjust.
  [[nodiscard]] bool empty() const noexcept { return observations.empty(); }

  /// Clears the arrays but keeps their memory.
  void clear() {
    keyframes.clear();
    is_fixed.clear();
    poses.clear();
    landmarks.clear();
    points.clear();
    observations.clear();
    sources.clear();
  }
  void add_keyframe(keyframe_id k, const se3& T_world_camera, bool fixed) {
    keyframes.push_back(k);
    poses.push_back(T_world_camera);
    is_fixed.push_back(fixed ? 1 : 0);
  }
  /// Adds a landmark with its observations by the keyframes for which `index_of(id)` is not `no_id`.
  template <feature_descriptor D, camera::camera_model Camera, class IndexOf>
  void add_landmark(const basic_map<D>& m, const basic_landmark<D>& l, const camera_rig<Camera>& rig,
                    IndexOf&& index_of) {
    const auto point = static_cast<std::uint32_t>(points.size());
    landmarks.push_back(l.id);
    points.push_back(l.position);
    for (const observation& seen : l.observations) {
      const std::uint32_t pose = index_of(seen.keyframe);
      if (pose == no_id) continue;
      const auto at = landmark_observation<Camera, D>(rig, m.at(seen.keyframe), seen.feature, l.position);
      observations.push_back({pose, point, at.pixel, at.right, at.information, at.depth_weight, at.smear});
      sources.push_back(seen);
    }
  }
};

/// Returns true if at least two keyframes for which `index_of(id)` is not `no_id` observe a landmark.
template <feature_descriptor D, class IndexOf>
[[nodiscard]] bool is_shared(const basic_landmark<D>& l, const IndexOf& index_of) {
  const auto takes_part = [&](const observation& by) { return index_of(by.keyframe) != no_id; };
  return std::count_if(l.observations.begin(), l.observations.end(), takes_part) >= 2;
}

/// Erases an observation if it still exists, and returns true if it did. A landmark whose position is no longer
/// determined (one observation, without depth) is removed.
template <feature_descriptor D>
bool erase_outlier(basic_map<D>& m, landmark_id l, const observation& source) {
  if (!m.erase_observation(l, source)) return false;
  if (!m.has_landmark(l) || m.landmark_at(l).observations.size() > 1) return true;
  const observation& last = m.landmark_at(l).observations.front();
  if (!m.at(last.keyframe).has_depth(last.feature)) m.remove_landmark(l);
  return true;
}

/// The result of an adjustment; its arrays are indexed like those of the snapshot.
struct bundle_solution {
  std::vector<se3> poses;
  std::vector<vec3> points;
  std::vector<std::uint8_t> outliers;  ///< for each observation: 1 if it disagrees with the result
  bool usable = false;                 ///< true if poses and points are valid and no worse than before
  bool complete = false;               ///< false if the adjustment was stopped or failed
  int iterations = 0;
  double initial_cost = 0.0;  ///< half the robust cost (sum of robustified squared errors)
  double final_cost = 0.0;    ///< half the robust cost at the end, excluding outliers
};

struct bundle_schedule {
  int robust_iterations = 5;  ///< maximum number of iterations with all observations
  int iterations = 5;         ///< maximum number of iterations after exclusion of the outliers
  double relative_tolerance = 1e-6;
  bool keep_partial = false;  ///< uses the partial result if the adjustment is stopped
};

/// Solves snapshots. Memory is reused: a subsequent problem allocates almost nothing unless it is larger.
template <camera::camera_model Camera>
class bundle_solver {
 public:
  explicit bundle_solver(const optimize::reprojection<Camera>& model, optimize::huber loss = {})
      : model_{model}, adjuster_{model, loss} {}

  /// Calls `go_on(iteration, iterations)` before each step; if it returns false, the adjustment stops. No observation
  /// is marked as an outlier before the robust iterations are complete. `memory`: a previous solution, whose memory is
  /// reused.
  [[nodiscard]] bundle_solution solve(const bundle_snapshot& s, const bundle_schedule& schedule,
                                      const progress& go_on = {}, bundle_solution memory = {}) {
    bundle_solution result = std::move(memory);
    result.poses.assign(s.poses.begin(), s.poses.end());
    result.points.assign(s.points.begin(), s.points.end());
    result.outliers.assign(s.observations.size(), 0);
    result.usable = schedule.keep_partial;
    result.complete = false;
    const auto first_total = static_cast<std::size_t>(std::max(0, schedule.robust_iterations));
    const std::size_t total = first_total + static_cast<std::size_t>(std::max(0, schedule.iterations));
    if (schedule.keep_partial && !go_on(0, total)) return result;
    std::size_t before = 0;
    const auto step = [&](std::size_t done, std::size_t) { return go_on(before + done, total); };
    const auto accept = [&](const optimize::bundle_summary& summary) {
      const bool cancelled = summary.status == optimize::bundle_status::cancelled;
      result.usable = !optimize::is_failure(summary.status) && (!cancelled || schedule.keep_partial);
      return result.usable && !cancelled;
    };
    const auto robust = adjuster_.solve(seq, std::span<se3>(result.poses), std::span<vec3>(result.points),
                                        std::span<const optimize::bundle_observation>(s.observations),
                                        {.max_iterations = schedule.robust_iterations,
                                         .relative_tolerance = schedule.relative_tolerance,
                                         .fixed_poses = s.is_fixed},
                                        step);
    if (!accept(robust)) return result;
    find_outliers(s, result);
    before = first_total;
    const auto last = adjuster_.solve_again(seq, std::span<se3>(result.poses), std::span<vec3>(result.points),
                                            {.max_iterations = schedule.iterations,
                                             .relative_tolerance = schedule.relative_tolerance,
                                             .fixed_poses = s.is_fixed,
                                             .ignored = result.outliers},
                                            step);
    result.complete = accept(last);
    if (!result.usable) return result;
    find_outliers(s, result);
    keep_rough(s, result);
    result.iterations = robust.iterations + last.iterations;
    result.initial_cost = robust.initial_cost;
    result.final_cost = last.final_cost;
    return result;
  }

 private:
  /// Marks the observations that disagree with the current poses and points.
  void find_outliers(const bundle_snapshot& s, bundle_solution& to) {
    squared_.resize(s.observations.size());
    adjuster_.chi2(to.poses, to.points, s.observations, squared_);
    for (std::size_t i = 0; i != s.observations.size(); ++i)
      to.outliers[i] = squared_[i] > error_limit(s.observations[i].has_depth()) ? 1 : 0;
  }

  /// Unmarks patch observations that agree with the current poses and points if their standard deviation is assumed to
  /// be one pixel of their level, so that slightly misplaced patches remain observations.
  void keep_rough(const bundle_snapshot& s, bundle_solution& to) const {
    for (std::size_t i = 0; i != s.observations.size(); ++i) {
      const optimize::bundle_observation& o = s.observations[i];
      if (to.outliers[i] == 0 || o.depth_weight == 1.0) continue;
      optimize::bundle_observation rough = o;
      rough.information *= o.depth_weight * o.depth_weight;
      rough.smear *= o.depth_weight;
      rough.depth_weight = 1.0;
      const auto error = model_.residual(to.poses[o.pose].inverse() * to.points[o.point], rough);
      if (error && squared_norm(*error) * rough.information <= error_limit(rough.has_depth())) to.outliers[i] = 0;
    }
  }

  optimize::reprojection<Camera> model_;
  optimize::bundle_adjuster<optimize::reprojection<Camera>> adjuster_;
  std::vector<double> squared_;
};

}  // namespace orbis::slam::detail
