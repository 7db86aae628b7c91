// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The map: keyframes, landmarks, the observations between them, the covisibility graph and the spanning tree.
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
/// spanning tree contains all keyframes. References to keyframes and landmarks stay valid until they are erased. Const
/// members may be called concurrently from several threads.
///
/// Let n be the number of observations of a landmark: a change to one of them takes O(n), independent of the map's
/// size.
template <feature_descriptor D>
class basic_map {
 public:
  using descriptor_type = D;
  using frame_type = basic_frame<D>;
  using keyframe_type = basic_keyframe<D>;
  using landmark_type = basic_landmark<D>;

  basic_map() = default;
  /// Creates an empty map. `levels`, `scale_factor`: parameters of the extractor's image pyramid; `min_shared`: minimum
  /// number of shared landmarks for an edge in the covisibility graph.
  basic_map(int levels, double scale_factor, std::uint32_t min_shared = 15) : covisibility_{min_shared} {
    content_.levels = levels;
    content_.scale_factor = scale_factor;
    content_.min_shared = min_shared;
  }
  /// Creates a map from its content. `keyframe.landmarks` are set from the observations of the landmarks. O(map).
  /// @pre the content is consistent: ids refer to existing entries, and no keypoint observes two landmarks
  explicit basic_map(detail::map_content<D> content);

  /// The sensor of the map's first keyframe.
  [[nodiscard]] sensor_kind sensor() const noexcept { return content_.sensor; }
  /// Returns true if lengths are in metres; otherwise they are in a map-specific arbitrary unit.
  [[nodiscard]] bool scale_is_known() const noexcept { return content_.scale_is_known; }
  /// The keyframes in ascending order of id: a range with `size()`, `empty()`, `front()` and `back()`.
  [[nodiscard]] const auto& keyframes() const noexcept { return content_.keyframes; }
  /// The landmarks in ascending order of id: a range like `keyframes()`.
  [[nodiscard]] const auto& landmarks() const noexcept { return content_.landmarks; }
  [[nodiscard]] std::size_t landmark_count() const noexcept { return content_.landmarks.size(); }
  /// The id of the next keyframe: greater than all existing and erased ids.
  [[nodiscard]] keyframe_id keyframe_end() const noexcept { return content_.keyframes.end_id(); }
  /// The id of the next landmark.
  [[nodiscard]] landmark_id landmark_end() const noexcept { return content_.landmarks.end_id(); }
  /// Number of landmarks that can still be added, out of 2^31 - 1 in the lifetime of a map (12 days at 70 per frame and
  /// 30 Hz). A map read from a file has at least 7/8 of them left.
  [[nodiscard]] std::uint32_t landmark_ids_left() const noexcept {
    return decltype(content_.landmarks)::most_ids - landmark_end().value();
  }
  /// Number of keyframes that can still be added, out of 2^31 - 1 in the lifetime of a map.
  [[nodiscard]] std::uint32_t keyframe_ids_left() const noexcept {
    return decltype(content_.keyframes)::most_ids - keyframe_end().value();
  }
  /// Returns the first landmark with an id of at least `id`; `landmark_end()` if there is none. O(erased ids skipped).
  [[nodiscard]] landmark_id next_landmark(landmark_id id) const noexcept { return content_.landmarks.next_id(id); }
  [[nodiscard]] bool has_keyframe(keyframe_id id) const noexcept { return content_.keyframes.contains(id); }
  [[nodiscard]] bool has_landmark(landmark_id id) const noexcept { return content_.landmarks.contains(id); }
  /// @pre has_keyframe(id)
  [[nodiscard]] const keyframe_type& at(keyframe_id id) const { return content_.keyframes[id]; }
  /// @pre has_landmark(id)
  [[nodiscard]] const landmark_type& landmark_at(landmark_id id) const { return content_.landmarks[id]; }

  /// Returns the current landmark for `id`: `id` if it exists, otherwise the landmark it was fused into; `no_id` if it
  /// was removed, or if 2^18 or more landmarks have been added since it was erased.
  [[nodiscard]] landmark_id replacement(landmark_id id) const noexcept { return content_.landmarks.replacement(id); }
  /// Returns the current keyframe for `id`: `id` if it exists, otherwise its nearest existing ancestor in the spanning
  /// tree, or a former child if the root was erased; `no_id` if no keyframe is left, or if the keyframe was forgotten
  /// and the map was read from a file.
  [[nodiscard]] keyframe_id replacement(keyframe_id id) const noexcept { return content_.keyframes.replacement(id); }
  [[deprecated("use replacement")]] [[nodiscard]] landmark_id replacement_of(landmark_id id) const noexcept {
    return replacement(id);
  }
  [[deprecated("use replacement")]] [[nodiscard]] keyframe_id replacement_of(keyframe_id id) const noexcept {
    return replacement(id);
  }
  /// Number of pose changes, added keyframes and erased keyframes: if this number is unchanged, so are the keyframes
  /// and their poses.
  [[nodiscard]] std::uint64_t pose_changes() const noexcept { return pose_changes_; }
  /// Returns true if the pose of a keyframe, existing or erased, is known (see `forget_erased`).
  [[nodiscard]] bool remembers(keyframe_id id) const { return has_keyframe(id) || content_.erased.contains(id); }
  /// Returns the first id >= `id` for which `remembers` is true; `keyframe_end()` if there is none.
  [[nodiscard]] keyframe_id next_remembered(keyframe_id id) const;
  /// Returns `T_world_camera` of a keyframe. An erased keyframe moves with its replacement. @pre remembers(id)
  [[nodiscard]] se3 pose(keyframe_id id) const;
  /// Returns `basic_keyframe::scale`, also for an erased keyframe. @pre remembers(id)
  [[nodiscard]] double scale(keyframe_id id) const;
  [[deprecated("use pose")]] [[nodiscard]] se3 pose_of(keyframe_id id) const { return pose(id); }
  [[deprecated("use scale")]] [[nodiscard]] double scale_of(keyframe_id id) const { return scale(id); }

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
  /// @pre has_landmark(id)
  void set_patch(landmark_id id, landmark_patch patch) { content_.landmarks[id].patch = std::move(patch); }
  /// Sets the uncertainty of a keypoint (`basic_frame::spreads`). @pre has_keyframe(id)
  void set_spread(keyframe_id id, std::uint32_t feature, const pixel_spread& spread) {
    auto& of_keyframe = content_.keyframes[id].spreads;
    of_keyframe.resize(at(id).size());
    of_keyframe[feature] = spread;
  }
  /// Moves a keyframe by `T_new_old`, a motion in the world frame; multiplies `scale(id)` by the scale of the motion.
  /// @pre has_keyframe(id)
  void move_keyframe(keyframe_id id, const sim3& T_new_old) {
    set_pose(id, moved(T_new_old, at(id).T_world_camera));
    content_.keyframes[id].scale *= T_new_old.scale();
  }
  /// Moves a landmark and its normal by `T_new_old`, a motion in the world frame. @pre has_landmark(id)
  void move_landmark(landmark_id id, const sim3& T_new_old) {
    landmark_type& l = content_.landmarks[id];
    l.position = T_new_old * l.position;
    l.normal = T_new_old.rotation() * l.normal;
    l.patch.move(T_new_old);
    l.min_distance *= T_new_old.scale();
    l.max_distance *= T_new_old.scale();
  }
  /// Changes the world frame of the whole map: poses and positions are multiplied by `T_new_old`. O(map).
  void transform(const sim3& T_new_old);

  /// Adds a frame as a keyframe. The keyframe observes `f.landmarks` (fused landmarks are replaced by their
  /// successors). Its parent in the spanning tree is the keyframe that shares the most landmarks with it, or the newest
  /// one if none does. O(observations of its landmarks).
  keyframe_id add_keyframe(frame_type f);
  /// Erases a keyframe with its observations, and the landmarks that no other keyframe observes. Its children in the
  /// spanning tree get new parents. `pose(id)` still returns its pose. @pre has_keyframe(id)
  void erase_keyframe(keyframe_id id);
  /// Forgets the poses of erased keyframes, except those in `keep`, the `latest` most recently erased ones, and their
  /// replacements. Each remembered keyframe takes about 130 bytes. O((n + keep) log n), where n is the number of erased
  /// keyframes remembered before.
  void forget_erased(std::span<const keyframe_id> keep, std::size_t latest);
  /// Records a loop closure between two keyframes. @pre a != b, and both exist
  void add_loop_edge(keyframe_id a, keyframe_id b) { content_.tree.add_loop_edge(a, b); }

  /// Adds a landmark at the depth of a keypoint.
  /// @pre the keypoint has depth and observes no landmark; landmark_ids_left() != 0
  landmark_id add_landmark(keyframe_id id, std::uint32_t feature) {
    return add_landmark(id, feature, at(id).point_world(feature));
  }
  /// Adds a landmark at `position` (world, metres) that a keypoint observes.
  /// @pre the keypoint observes no landmark; landmark_ids_left() != 0
  landmark_id add_landmark(keyframe_id id, std::uint32_t feature, const vec3& position);
  /// Removes a landmark and its n observations. O(n^2). @pre has_landmark(id)
  void remove_landmark(landmark_id id) { remove(id, no_id); }

  /// Adds an observation. Returns false, without a change, if the keypoint already observes a landmark, or the keyframe
  /// already observes this landmark. @pre both exist
  bool add_observation(landmark_id l, keyframe_id k, std::uint32_t feature);
  /// Erases the observation of a landmark by a keyframe, if any. Removes the landmark if it has no other observation.
  void erase_observation(landmark_id l, keyframe_id k);
  /// Erases the observation `noted` if it still exists; returns true if it existed.
  bool erase_observation(landmark_id l, const observation& noted);

  /// Merges landmark `from` into `into`, which takes over the observations of keyframes that do not observe it yet.
  /// O(n^2). @pre from != into, and both exist
  void fuse(landmark_id from, landmark_id into);

  /// Recomputes the data derived from a landmark's observations: normal, distance range and, if the observations have
  /// changed, the descriptor. O(n). @pre has_landmark(id)
  void update_landmark(landmark_id id);

  /// Merges another map into this one: transforms its world frame by `T_this_other` and attaches its spanning tree at
  /// `link`. No landmarks are fused. Returns the offsets added to its ids. O(both maps).
  /// @pre both have the same pyramid; `link` refers to existing keyframes, unless either map is empty;
  /// landmark_ids_left() >= other.landmark_end(), keyframe_ids_left() >= other.keyframe_end()
  id_offsets append(basic_map&& other, const sim3& T_this_other, const map_link& link);

  /// Returns the keyframes that observe any of the given landmarks, with the number of landmarks observed, in
  /// descending order of that number; if equal, the older keyframe comes first. O(observations of these landmarks).
  [[nodiscard]] std::vector<covisible> observers(const std::vector<landmark_id>& landmarks) const;
  [[deprecated("use observers")]] [[nodiscard]] std::vector<covisible> observers_of(
      const std::vector<landmark_id>& landmarks) const {
    return observers(landmarks);
  }

 private:
  /// Returns a camera pose moved by a motion in the world frame.
  [[nodiscard]] static se3 moved(const sim3& T_new_old, const se3& T_old_camera) {
    return {T_new_old.rotation() * T_old_camera.rotation(), vec3(T_new_old * T_old_camera.translation())};
  }
  /// Adds both sides of an observation, without updating the covisibility graph.
  bool attach(landmark_id id, keyframe_id k, std::uint32_t feature);
  /// Clears the landmark of a keypoint, and raises the keypoint's deviation to at least 1: a smaller one came from the
  /// alignment of the landmark's patch.
  void release(const landmark_type& l, const observation& o);
  /// Removes both sides of an observation, without updating the covisibility graph. @pre the observation exists
  void detach(landmark_id id, keyframe_id k);
  landmark_type remove(landmark_id id, landmark_id replacement);
  /// Adds to the covisibility graph the pairs of `k` and each keyframe that has an id less than `below` and shares
  /// landmarks with it.
  void count_covisible(const keyframe_type& k, keyframe_id below);

  detail::map_content<D> content_;
  covisibility_graph covisibility_;
  std::uint64_t pose_changes_ = 0;
};

/// A map with ORB descriptors.
using map = basic_map<features::binary_descriptor<256>>;

}  // namespace orbis::slam

#ifndef ORBIS_COMPILED
#include <orbis/slam/map-inl.hpp>
#endif
