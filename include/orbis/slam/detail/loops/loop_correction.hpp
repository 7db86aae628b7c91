// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Closing a loop: what drifted apart is brought together, and the way between bends to it.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), sections VII.C and VII.D, for cameras with depth: poses have no scale.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/progress.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/detail/loops/essential_graph.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/motion_propagation.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// What closing a loop came to.
struct loop_report {
  bool corrected = false;
  fusion_counts fusion;       ///< of landmarks
  double moved = 0.0;         ///< how far the keyframe went, metres, ...
  double turned = 0.0;        ///< ... and how it turned, radians
  std::size_t keyframes = 0;  ///< that were corrected
  int iterations = 0;         ///< of the pose graph
};

/// Closes a loop in three parts: `gather` and `apply` touch the map, `solve` works on what was copied out of it.
///
/// The essential graph with the new edge is optimised as a pose graph, the root of the map fixed; the other edges keep
/// what they measure before. Landmarks follow the keyframes; those of the two sides that are the same are made one.
/// Between `gather` and `apply` keyframes, landmarks and observations may have been added: keyframes follow their
/// parent.
template <camera::camera_model Camera>
class loop_correction {
 public:
  /// False if a keyframe of the match is gone by now. O(keyframes, pairs that share, features of the neighbourhood).
  /// @pre the match is one within the map
  bool gather(const map& m, const loop_match& match, const optimize::reprojection<Camera>& model,
              const pyramid_scales& scales, const loop_correction_options& o = {}) {
    if (!m.has_keyframe(match.keyframe) || !m.has_keyframe(match.candidate) || match.keyframe == match.candidate)
      return false;
    match_ = match;
    options_ = o;
    model_.emplace(model);
    scales_ = scales;
    fusion_.gather(m, m, match, o.fusion);
    poses_ = poses_of(m);
    edges_ = essential_graph(m, o.strong);
    fixed_.assign(poses_.size(), 0);
    fixed_[m.tree().root()] = 1;
    keyframes_.clear();
    for (const keyframe& k : m.keyframes()) keyframes_.push_back(k.id);
    std::erase_if(edges_, [&](const essential_edge& e) {
      return e.kind == edge_kind::loop && std::min(e.from, e.to) == std::min(match.keyframe, match.candidate) &&
             std::max(e.from, e.to) == std::max(match.keyframe, match.candidate);
    });
    for (essential_edge& e : edges_)  // the more they share, the better it is known how they lie
      e.information *= static_cast<double>(std::clamp(e.shared, 1U, o.strong)) / o.strong;
    edges_.push_back({match.candidate, match.keyframe, edge_kind::loop, static_cast<std::uint32_t>(match.inliers),
                      match.T_candidate_keyframe, o.loop_weight * matrix<6, 6>::Identity()});
    return true;
  }

  /// False if it was stopped (`callback(iteration, iterations)` returned false), or the graph cannot be solved: there
  /// is nothing to apply then. @pre `gather` was true
  [[nodiscard]] bool solve(progress callback = {}) {
    fusion_.solve(*model_, scales_);
    const auto summary = solver_.solve(seq, std::span<se3>(poses_), edges_,
                                       {.max_iterations = options_.iterations, .fixed = fixed_}, callback);
    iterations_ = summary.iterations;
    return !optimize::is_failure(summary.status) && summary.status != optimize::pose_graph_status::cancelled;
  }

  /// @pre `solve` was true, and the map is that of `gather`, with what was added since
  loop_report apply(map& m) {
    const loop_report report = move(m);
    if (report.corrected) update_landmarks(m, 0, m.landmark_end());
    return report;
  }
  /// The same, but for `update_landmarks`, which is left to the caller where the report says that it was corrected.
  loop_report move(map& m) {
    loop_report report;
    report.iterations = iterations_;
    std::vector<se3> solved;
    for (const keyframe_id k : keyframes_) solved.push_back(poses_[k]);
    const std::vector<se3> motion = carried_motion(m, keyframes_, solved);
    const keyframe_id a = m.heir(match_.keyframe), b = m.heir(match_.candidate);
    if (a == no_id || b == no_id) return report;
    const se3 before = m.at(a).T_world_camera;
    move_all(m, motion);
    if (a != b) m.add_loop_edge(a, b);
    report.fusion = fusion_.fuse(m);
    report.corrected = true;
    report.keyframes = m.keyframes().size();
    report.moved = (m.at(a).T_world_camera.translation() - before.translation()).norm();
    report.turned = (before.rotation().inverse() * m.at(a).T_world_camera.rotation()).log().norm();
    return report;
  }

 private:
  loop_match match_;
  loop_correction_options options_;
  std::optional<optimize::reprojection<Camera>> model_;
  pyramid_scales scales_;
  loop_fusion fusion_;
  std::vector<keyframe_id> keyframes_;
  std::vector<se3> poses_;  // by keyframe
  std::vector<essential_edge> edges_;
  std::vector<std::uint8_t> fixed_;
  optimize::pose_graph_solver<se3> solver_;
  int iterations_ = 0;
};

/// Closes a loop at once; see `loop_correction`. Nothing is changed where the report says that nothing was corrected.
template <camera::camera_model Camera>
loop_report close_loop(map& m, const loop_match& match, const optimize::reprojection<Camera>& model,
                       const pyramid_scales& scales, const loop_correction_options& o = {}) {
  loop_correction<Camera> correction;
  if (!correction.gather(m, match, model, scales, o) || !correction.solve()) return {};
  return correction.apply(m);
}

}  // namespace orbis::slam::detail
