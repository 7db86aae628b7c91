// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The map: keyframes, landmarks, which keyframe observes which landmark, and the graphs that follow.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/slam/covisibility_graph.hpp>
#include <orbis/slam/detail/map/counter.hpp>
#include <orbis/slam/detail/map/map_content.hpp>
#include <orbis/slam/detail/map/slot_map.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/landmark.hpp>
#include <orbis/slam/spanning_tree.hpp>

namespace orbis::slam {

/// A map of keyframes and landmarks with descriptors of type `D`.
///
/// Invariants: an observation is stored on both sides, so `keyframe.landmarks[f] == l` if and only if
/// `landmark.observations` contains `{keyframe, f}`; the covisibility graph counts exactly these observations; the
/// spanning tree contains all keyframes. References to keyframes and landmarks stay valid until these are erased. Const
/// members may be called from several threads at once.
///
/// Let n be the number of observations of a landmark: a change to one of them costs O(n), independent of the map's
/// size.
template <feature_descriptor D>
class basic_map {
 public:
  using descriptor_type = D;
  using frame_type = basic_frame<D>;
  using keyframe_type = basic_keyframe<D>;
  using landmark_type = basic_landmark<D>;

  basic_map() = default;
  /// An empty map. `levels`, `scale_factor`: of the extractor's image pyramid; `min_shared`: the number of shared
  /// landmarks from which on two keyframes have an edge in the covisibility graph.
  basic_map(int levels, double scale_factor, std::uint32_t min_shared = 15) : covisibility_{min_shared} {
    content_.levels = levels;
    content_.scale_factor = scale_factor;
    content_.min_shared = min_shared;
  }
  /// A map from its content. `keyframe.landmarks` are set from the observations of the landmarks. O(map).
  /// @pre the content is consistent: ids refer to what is there, and no keypoint observes two landmarks
  explicit basic_map(detail::map_content<D> content);

  /// What took the map's first keyframe.
  [[nodiscard]] sensor_kind sensor() const noexcept { return content_.sensor; }
  /// Whether lengths are metres; otherwise they are in a unit of the map's own.
  [[nodiscard]] bool scale_is_known() const noexcept { return content_.scale_is_known; }
  /// The keyframes by ascending id: a range with `size()`, `empty()`, `front()` and `back()`.
  [[nodiscard]] const auto& keyframes() const noexcept { return content_.keyframes; }
  /// The landmarks by ascending id: a range as `keyframes()`.
  [[nodiscard]] const auto& landmarks() const noexcept { return content_.landmarks; }
  [[nodiscard]] std::size_t landmark_count() const noexcept { return content_.landmarks.size(); }
  /// The id that the next keyframe will get: all present and erased ones are less.
  [[nodiscard]] keyframe_id keyframe_end() const noexcept { return content_.keyframes.end_id(); }
  /// The id that the next landmark will get.
  [[nodiscard]] landmark_id landmark_end() const noexcept { return content_.landmarks.end_id(); }
  /// How many landmarks may still be added, of 2^31 - 1 in the life of a map: of 70 a frame at 30 Hz, for 12 days.
  /// A map that was written to a file and read has at least 7/8 of them.
  [[nodiscard]] std::uint32_t landmark_ids_left() const noexcept {
    return decltype(content_.landmarks)::most_ids - landmark_end().value();
  }
  /// How many keyframes may still be added, of 2^31 - 1 in the life of a map.
  [[nodiscard]] std::uint32_t keyframe_ids_left() const noexcept {
    return decltype(content_.keyframes)::most_ids - keyframe_end().value();
  }
  /// The first landmark from `id` on; `landmark_end()` if there is none. O(erased ids in between).
  [[nodiscard]] landmark_id next_landmark(landmark_id id) const noexcept { return content_.landmarks.next_id(id); }
  [[nodiscard]] bool has_keyframe(keyframe_id id) const noexcept { return content_.keyframes.contains(id); }
  [[nodiscard]] bool has_landmark(landmark_id id) const noexcept { return content_.landmarks.contains(id); }
  /// @pre has_keyframe(id)
  [[nodiscard]] const keyframe_type& at(keyframe_id id) const { return content_.keyframes[id]; }
  /// @pre has_landmark(id)
  [[nodiscard]] const landmark_type& landmark_at(landmark_id id) const { return content_.landmarks[id]; }

  /// The landmark that stands for `id` now: itself while it is there, otherwise the one it was fused into; `no_id` if
  /// it was removed, or erased so long ago that 2^18 landmarks or more were added since.
  [[nodiscard]] landmark_id replacement_of(landmark_id id) const noexcept {
    return content_.landmarks.replacement_of(id);
  }
  /// The keyframe that stands for `id` now: itself while it is there, otherwise its nearest ancestor in the spanning
  /// tree that is; `no_id` if no keyframe is left, or it was forgotten and the map comes from a file.
  [[nodiscard]] keyframe_id replacement_of(keyframe_id id) const noexcept {
    return content_.keyframes.replacement_of(id);
  }
  /// How often a pose was set or a keyframe added or erased: while it stays, the keyframes and their poses do.
  [[nodiscard]] std::uint64_t pose_changes() const noexcept { return pose_changes_; }
  /// Whether it is known where a keyframe is or, if it was erased, was (`forget_erased`).
  [[nodiscard]] bool remembers(keyframe_id id) const { return has_keyframe(id) || content_.erased.contains(id); }
  /// The first id from `id` on that the map remembers; `keyframe_end()` if there is none.
  [[nodiscard]] keyframe_id next_remembered(keyframe_id id) const;
  /// `T_world_camera` of a keyframe. An erased keyframe moves with the one that replaced it. @pre remembers(id)
  [[nodiscard]] se3 pose_of(keyframe_id id) const;
  /// `basic_keyframe::scale`, that of an erased keyframe as well. @pre remembers(id)
  [[nodiscard]] double scale_of(keyframe_id id) const;

  [[nodiscard]] const covisibility_graph& covisibility() const noexcept { return covisibility_; }
  [[nodiscard]] const spanning_tree& tree() const noexcept { return content_.tree; }
  [[nodiscard]] const detail::map_content<D>& content() const noexcept { return content_; }

  /// Counts a frame in which the landmark was expected. @pre has_landmark(id)
  void count_visible(landmark_id id) { ++content_.landmarks[id].visible; }
  /// Counts a frame in which the landmark was found. @pre has_landmark(id)
  void count_found(landmark_id id) { ++content_.landmarks[id].found; }
  /// @pre has_keyframe(id)
  void set_pose(keyframe_id id, const se3& T_world_camera) {
    content_.keyframes[id].T_world_camera = T_world_camera;
    ++pose_changes_;
  }
  /// @pre has_landmark(id)
  void set_position(landmark_id id, const vec3& position) { content_.landmarks[id].position = position; }
  /// Moves a keyframe by `T_new_old`, a motion in the world, whose scale counts in `scale_of`. @pre has_keyframe(id)
  void move_keyframe(keyframe_id id, const sim3& T_new_old) {
    set_pose(id, moved(T_new_old, at(id).T_world_camera));
    content_.keyframes[id].scale *= T_new_old.scale();
  }
  /// Moves a landmark and its normal by `T_new_old`, a motion in the world. @pre has_landmark(id)
  void move_landmark(landmark_id id, const sim3& T_new_old) {
    landmark_type& l = content_.landmarks[id];
    l.position = T_new_old * l.position;
    l.normal = T_new_old.rotation() * l.normal;
    l.min_distance *= T_new_old.scale();
    l.max_distance *= T_new_old.scale();
  }
  /// Changes the world frame of the whole map: poses and positions are multiplied by `T_new_old`. O(map).
  void transform(const sim3& T_new_old);

  /// Adds a frame as a keyframe. It observes `f.landmarks` (fused ones by their replacement). Its parent in the
  /// spanning tree is the keyframe that it shares most landmarks with, or the newest one if it shares none.
  /// O(observations of its landmarks).
  keyframe_id add_keyframe(frame_type f);
  /// Erases a keyframe with its observations, and landmarks that no other keyframe observes. Its children in the
  /// spanning tree get other parents. `pose_of` still gives its pose. @pre has_keyframe(id)
  void erase_keyframe(keyframe_id id);
  /// Forgets where erased keyframes were, but for those of `keep` and the `latest` ones, and those that they were
  /// replaced by. What is not forgotten takes some 130 bytes a keyframe. Let n be the number of those that were not
  /// forgotten before: O((n + keep) log n).
  void forget_erased(std::span<const keyframe_id> keep, std::size_t latest);
  /// Records that a loop was closed between two keyframes. @pre a != b, and both are there
  void add_loop_edge(keyframe_id a, keyframe_id b) { content_.tree.add_loop_edge(a, b); }

  /// Adds a landmark at the depth of a keypoint.
  /// @pre the keypoint has depth and observes no landmark; landmark_ids_left() != 0
  landmark_id add_landmark(keyframe_id id, std::uint32_t feature) {
    return add_landmark(id, feature, at(id).point_world(feature));
  }
  /// Adds a landmark at `position` (world, metres) that a keypoint observes.
  /// @pre the keypoint observes no landmark; landmark_ids_left() != 0
  landmark_id add_landmark(keyframe_id id, std::uint32_t feature, const vec3& position);
  /// Removes a landmark and its observations. O(n^2). @pre has_landmark(id)
  void remove_landmark(landmark_id id) { remove(id, no_id); }

  /// Adds an observation. False, and no change, if the keypoint observes a landmark already, or the keyframe observes
  /// this landmark already. @pre both are there
  bool add_observation(landmark_id l, keyframe_id k, std::uint32_t feature);
  /// Erases the observation of a landmark by a keyframe, if there is one. A landmark without observations is removed.
  void erase_observation(landmark_id l, keyframe_id k);
  /// Erases the observation `noted`, if it is still there, and returns whether it was.
  bool erase_observation(landmark_id l, const observation& noted);

  /// Replaces landmark `from` by `into`, which takes over its observations by keyframes that do not observe `into`.
  /// O(n^2). @pre from != into, and both are there
  void fuse(landmark_id from, landmark_id into);

  /// Recomputes what depends on a landmark's observations: normal, range of distances and, if the observations changed,
  /// the descriptor. O(n). @pre has_landmark(id)
  void update_landmark(landmark_id id);

  /// Makes another map a part of this one: its world is moved by `T_this_other`, its spanning tree attached at `link`.
  /// No landmarks are fused. Returns by how much its ids have grown. O(both maps).
  /// @pre both have the same pyramid; `link` refers to keyframes that are there, unless either map is empty;
  /// landmark_ids_left() >= other.landmark_end(), keyframe_ids_left() >= other.keyframe_end()
  id_offsets append(basic_map&& other, const sim3& T_this_other, const map_link& link);

  /// The keyframes that observe any of the given landmarks, with how many they observe: most first, older first where
  /// equal. O(observations of these landmarks).
  [[nodiscard]] std::vector<covisible> observers_of(const std::vector<landmark_id>& landmarks) const;

 private:
  /// A pose after a motion in the world.
  [[nodiscard]] static se3 moved(const sim3& T_new_old, const se3& T_old_camera) {
    return {T_new_old.rotation() * T_old_camera.rotation(), vec3(T_new_old * T_old_camera.translation())};
  }
  /// Adds both sides of an observation, without the covisibility graph.
  bool attach(landmark_id id, keyframe_id k, std::uint32_t feature);
  /// Removes both sides of an observation, without the covisibility graph. @pre there is one
  void detach(landmark_id id, keyframe_id k);
  landmark_type remove(landmark_id id, landmark_id replacement);
  /// Enters what a keyframe shares with those of lower id than `below` into the covisibility graph.
  void count_covisible(const keyframe_type& k, keyframe_id below);

  detail::map_content<D> content_;
  covisibility_graph covisibility_;
  std::uint64_t pose_changes_ = 0;
};

/// A map with the descriptors of ORB.
using map = basic_map<features::binary_descriptor<256>>;

}  // namespace orbis::slam

#ifndef ORBIS_COMPILED
#include <orbis/slam/map-inl.hpp>
#endif
