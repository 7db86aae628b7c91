// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment of a whole map.
///
/// `take_...`, `apply_poses` and `erase_outliers` access the map; the solver works on the snapshot. Keyframes,
/// landmarks and observations may be added between these calls: new keyframes follow their parent in the spanning tree;
/// new landmarks, and landmarks with a single observation, are not adjusted and follow the keyframe that created them.
/// The root of the map is held fixed. If lengths are not measured, the adjustment may change them: all data relative to
/// a keyframe are then scaled by the same factor as the lengths in its view.
///
/// Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.E.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/mapping/map_bundle.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail::global_adjustment {

/// The result of adjusting a map.
struct report {
  std::size_t keyframes = 0;     ///< number of adjusted keyframes
  std::size_t landmarks = 0;     ///< number of adjusted landmarks
  std::size_t observations = 0;  ///< number of observations used
  std::size_t outliers = 0;      ///< number of observations that disagreed and were erased
  int iterations = 0;
  double initial_cost = 0.0;  ///< half the sum of the robust loss over the observations
  double final_cost = 0.0;    ///< half the sum of the robust loss at the end, excluding outliers
};

struct snapshot : bundle_snapshot {
  std::unordered_map<std::uint32_t, std::uint32_t> index;  ///< from keyframe id to index in the arrays
  landmark_id next_landmark = 0;                           ///< the next landmark to copy

  [[nodiscard]] std::uint32_t index_of(keyframe_id k) const {
    const auto i = index.find(k.value());
    return i != index.end() ? i->second : no_id;
  }
  /// Returns true if `take_landmarks` has more landmarks to copy.
  [[nodiscard]] bool has_more() const noexcept { return next_landmark != end_landmark; }
};

[[nodiscard]] inline bundle_schedule make_schedule(const global_adjustment_options& o) {
  return {
      .robust_iterations = o.robust_iterations, .iterations = o.iterations, .relative_tolerance = o.relative_tolerance};
}
/// The loss of the solver: Huber, with the 95 % chi-square limit for two coordinates.
inline constexpr optimize::huber loss{2.447};

/// Copies the keyframes of a map that observe enough shared landmarks, and the root. O(keypoints).
template <feature_descriptor D>
[[nodiscard]] snapshot take_keyframes(const basic_map<D>& m, const global_adjustment_options& o = {}) {
  snapshot s;
  if (m.keyframes().size() < 2) return s;
  s.end_keyframe = m.keyframe_end();
  s.end_landmark = m.landmark_end();
  std::size_t keypoints = 0;
  for (const auto& k : m.keyframes()) {
    keypoints += k.size();
    std::size_t shared = 0;
    for (auto l = k.landmarks.begin(); l != k.landmarks.end() && shared < o.min_observations; ++l)
      shared += *l != no_id && m.landmark_at(*l).observations.size() > 1;
    const bool is_root = k.id == m.tree().root();
    if (shared < o.min_observations && !is_root) continue;
    s.index.emplace(k.id.value(), static_cast<std::uint32_t>(s.keyframes.size()));
    s.add_keyframe(k.id, k.T_world_camera, is_root);
  }
  // Without `reserve`, growing arrays would be copied, and the lock would be held longer while one part of the
  // landmarks is copied.
  s.landmarks.reserve(m.landmark_count());
  s.points.reserve(m.landmark_count());
  s.observations.reserve(keypoints);
  s.sources.reserve(keypoints);
  return s;
}

/// Copies the next `count` landmarks with their observations. Callers that share the map can copy them in parts.
/// Keyframes, landmarks and observations added in the meantime are not adjusted. O(observations).
template <feature_descriptor D, camera::camera_model Camera>
void take_landmarks(snapshot& s, const basic_map<D>& m, const camera_rig<Camera>& rig, std::size_t count) {
  const auto next = [&](landmark_id from) { return std::min(m.next_landmark(from), s.end_landmark); };
  const auto index_of = [&](keyframe_id k) { return s.index_of(k); };
  for (s.next_landmark = next(s.next_landmark); s.has_more() && count != 0; --count) {
    const auto& l = m.landmark_at(s.next_landmark);
    if (is_shared(l, index_of)) s.add_landmark(m, l, rig, index_of);
    s.next_landmark = next(s.next_landmark + 1);
  }
}

/// Returns the factor by which a solution scales the lengths in the view of each keyframe: the median over its
/// landmarks, or 1 if lengths are measured. O(observations).
[[nodiscard]] inline std::vector<double> length_scales(const snapshot& s, const bundle_solution& solved,
                                                       bool is_measured) {
  std::vector<double> growth(s.keyframes.size(), 1.0);
  if (is_measured) return growth;
  std::vector<std::vector<double>> ratios(s.keyframes.size());
  for (std::size_t i = 0; i != s.observations.size(); ++i) {
    const std::uint32_t pose = s.observations[i].pose, point = s.observations[i].point;
    const double before = norm(s.points[point] - s.poses[pose].translation());
    const double after = norm(solved.points[point] - solved.poses[pose].translation());
    if (solved.outliers[i] == 0 && before > 0.0 && after > 0.0) ratios[pose].push_back(after / before);
  }
  for (std::size_t k = 0; k != growth.size(); ++k)
    if (!ratios[k].empty()) growth[k] = median(ratios[k]);
  return growth;
}

/// Writes the poses and positions of a solution to the map of the snapshot. The caller must then call `erase_outliers`
/// and `update_landmarks`. @pre solved.usable
template <feature_descriptor D>
report apply_poses(basic_map<D>& m, const snapshot& s, const bundle_solution& solved) {
  std::vector<sim3> poses;
  poses.reserve(solved.poses.size());
  const std::vector<double> growth = length_scales(s, solved, m.scale_is_known());
  for (std::size_t k = 0; k != solved.poses.size(); ++k)
    poses.emplace_back(solved.poses[k].rotation(), solved.poses[k].translation(), growth[k]);
  const keyframe_motions motion = propagate_motion<D>(m, s.keyframes, poses);
  // Landmarks that are not adjusted move with a keyframe; the others then get their adjusted position.
  std::size_t next = 0;
  for (const auto& l : m.landmarks()) {
    while (next != s.landmarks.size() && s.landmarks[next] < l.id) ++next;
    const bool adjusted = next != s.landmarks.size() && s.landmarks[next] == l.id;
    const keyframe_id by = m.has_keyframe(l.created) ? l.created : l.observations.front().keyframe;
    m.move_landmark(l.id, motion.at(by.value()));
    if (adjusted) m.set_position(l.id, solved.points[next]);
  }
  for (const auto& k : m.keyframes()) m.move_keyframe(k.id, motion.at(k.id.value()));
  return {s.keyframes.size(), s.landmarks.size(),  s.observations.size(), 0,
          solved.iterations,  solved.initial_cost, solved.final_cost};
}

/// Erases the outliers among the `count` observations starting at `first`, and the landmarks whose position is then no
/// longer determined. Callers that share the map can erase them in parts. Returns the number of erased outliers.
/// O(count).
/// @pre solved.usable
template <feature_descriptor D>
std::size_t erase_outliers(basic_map<D>& m, const snapshot& s, const bundle_solution& solved, std::size_t first,
                           std::size_t count) {
  std::size_t erased = 0;
  for (std::size_t i = first; i != s.observations.size() && i - first != count; ++i)
    erased += solved.outliers[i] != 0 && erase_outlier(m, s.landmarks[s.observations[i].point], s.sources[i]);
  return erased;
}

}  // namespace orbis::slam::detail::global_adjustment
