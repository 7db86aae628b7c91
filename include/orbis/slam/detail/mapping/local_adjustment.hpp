// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Local bundle adjustment: a keyframe, its neighbours, and the landmarks they observe.
///
/// Callers that share the map lock it only for `take` and `apply`:
///
/// @code
///   snapshot s = take(map, newest, rig, options);                       // reads the map
///   const bundle_solution solved = solver.solve(s, make_schedule(options), go_on);  // takes a long time
///   apply(map, s, solved);                                              // changes the map
/// @endcode
///
/// Keyframes, landmarks and observations may be added to the map or erased between `take` and `apply`. No other thread
/// may move the copied keyframes and landmarks.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section VI.D.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/covisibility_graph.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/mapping/map_bundle.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail::local_adjustment {

/// The keyframes and landmarks of an adjustment.
struct snapshot : bundle_snapshot {
  std::vector<keyframe_id> moving;  ///< the keyframes whose landmarks are adjusted, the newest first

  /// Returns the index of a keyframe in the arrays; the number of keyframes if it is not found.
  [[nodiscard]] std::uint32_t index_of(keyframe_id k) const {
    const auto at = std::lower_bound(keyframes.begin(), keyframes.end(), k);
    return static_cast<std::uint32_t>((at != keyframes.end() && *at == k ? at : keyframes.end()) - keyframes.begin());
  }
};

[[nodiscard]] inline bundle_schedule make_schedule(const adjustment_options& o) {
  return {.robust_iterations = o.robust_iterations, .iterations = o.iterations, .keep_partial = true};
}

/// Copies keyframe `newest`, the keyframes that share the most landmarks with it, and their landmarks. Other keyframes
/// that observe these landmarks are included but held fixed, as are the root keyframe of the map and the keyframes
/// localised by depth. Empty if there is nothing to adjust. `memory`: a previous snapshot, whose memory is reused.
/// O(observations of the landmarks).
/// @pre m.has_keyframe(newest)
template <feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] snapshot take(const basic_map<D>& m, keyframe_id newest, const camera_rig<Camera>& rig,
                            const adjustment_options& o, snapshot memory = {}) {
  assert(m.has_keyframe(newest));
  snapshot s = std::move(memory);
  s.clear();
  if (m.keyframes().size() < 2 || o.keyframes == 0) return s;
  s.end_keyframe = m.keyframe_end();
  s.end_landmark = m.landmark_end();

  s.moving.assign(1, newest);
  for (const covisible& n : m.covisibility().at_least(newest, static_cast<std::uint32_t>(o.min_shared)))
    if (s.moving.size() < o.keyframes) s.moving.push_back(n.keyframe);
  s.keyframes = s.moving;
  for (const keyframe_id k : s.moving)
    for (const covisible& n : m.covisibility().sharing(k)) s.keyframes.push_back(n.keyframe);
  std::sort(s.keyframes.begin(), s.keyframes.end());
  s.keyframes.erase(std::unique(s.keyframes.begin(), s.keyframes.end()), s.keyframes.end());
  bool any_fixed = false;
  for (const keyframe_id k : s.keyframes) {
    const bool moves = k != m.tree().root() && !m.at(k).held_by_depth &&
                       std::find(s.moving.begin(), s.moving.end(), k) != s.moving.end();
    any_fixed = any_fixed || !moves;
    s.is_fixed.push_back(moves ? 0 : 1);
    s.poses.push_back(m.at(k).T_world_camera);
  }
  if (!any_fixed) s.is_fixed.front() = 1;
  if (std::find(s.is_fixed.begin(), s.is_fixed.end(), 0) == s.is_fixed.end()) return s;

  for (const landmark_id l : observed_landmarks(m, s.moving))
    s.add_landmark(m, m.landmark_at(l), rig, [&](keyframe_id k) { return s.index_of(k); });
  return s;
}

/// Returns the motion of a keyframe in the world frame; for a keyframe added since `take`, the motion of its nearest
/// ancestor in the snapshot. Empty if it did not move.
template <feature_descriptor D>
[[nodiscard]] std::optional<se3> find_motion(const basic_map<D>& m, keyframe_id k, const snapshot& s,
                                             const bundle_solution& solved) {
  k = m.replacement(k);
  while (k != no_id && k >= s.end_keyframe) k = m.tree().parent(k);
  if (k == no_id) return std::nullopt;
  const std::size_t i = s.index_of(k);
  if (i == s.keyframes.size() || s.is_fixed[i] != 0) return std::nullopt;
  return solved.poses[i] * s.poses[i].inverse();
}

/// Writes a solution to the map if it is usable. Keyframes added since `take` move with their ancestor in the spanning
/// tree, and landmarks added since then with the keyframe that created them. Outliers are erased, as are landmarks
/// whose position is no longer determined.
template <feature_descriptor D>
void apply(basic_map<D>& m, const snapshot& s, const bundle_solution& solved) {
  if (!solved.usable) return;
  for (std::size_t i = 0; i != s.keyframes.size(); ++i)
    if (s.is_fixed[i] == 0 && m.has_keyframe(s.keyframes[i])) m.set_pose(s.keyframes[i], solved.poses[i]);
  for (keyframe_id k = s.end_keyframe; k < m.keyframe_end(); ++k)
    if (m.has_keyframe(k))
      if (const auto T_new_old = find_motion(m, k, s, solved)) m.set_pose(k, *T_new_old * m.at(k).T_world_camera);
  for (landmark_id l = m.next_landmark(s.end_landmark); l != m.landmark_end(); l = m.next_landmark(l + 1)) {
    if (const auto T_new_old = find_motion(m, m.landmark_at(l).created, s, solved)) {
      m.move_landmark(l, sim3(*T_new_old));
      m.update_landmark(l);
    }
  }
  for (std::size_t p = 0; p != s.landmarks.size(); ++p)
    if (m.has_landmark(s.landmarks[p])) m.set_position(s.landmarks[p], solved.points[p]);
  for (std::size_t i = 0; i != s.observations.size(); ++i)
    if (solved.outliers[i] != 0) erase_outlier(m, s.landmarks[s.observations[i].point], s.sources[i]);
  for (const landmark_id l : s.landmarks)
    if (m.has_landmark(l)) m.update_landmark(l);
}

}  // namespace orbis::slam::detail::local_adjustment
