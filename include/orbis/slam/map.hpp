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
#include <orbis/slam/detail/map/typical_descriptor.hpp>
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
  void transform(const se3& T_new_old) { transform(sim3(T_new_old)); }

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
  id_offsets append(basic_map&& other, const se3& T_this_other, const map_link& link) {
    return append(std::move(other), sim3(T_this_other), link);
  }

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

template <feature_descriptor D>
basic_map<D>::basic_map(detail::map_content<D> content)
    : content_{std::move(content)}, covisibility_{content_.min_shared} {
  for (keyframe_id k = content_.keyframes.next_id(0); k != keyframe_end(); k = content_.keyframes.next_id(k + 1))
    content_.keyframes[k].landmarks.assign(content_.keyframes[k].size(), no_id);
  for (const landmark_type& l : content_.landmarks)
    for (const observation& o : l.observations) content_.keyframes[o.keyframe].landmarks[o.feature] = l.id;
  for (const keyframe_type& k : content_.keyframes) count_covisible(k, k.id);
}

template <feature_descriptor D>
se3 basic_map<D>::pose_of(keyframe_id id) const {
  se3 T_below_camera;
  while (!has_keyframe(id)) {
    const detail::erased_keyframe& e = content_.erased.at(id);
    T_below_camera = e.T_replacement_camera * detail::scaled(T_below_camera, e.scale);
    if (e.replacement == no_id) return T_below_camera;
    id = e.replacement;
  }
  return at(id).T_world_camera * detail::scaled(T_below_camera, at(id).scale);
}

template <feature_descriptor D>
double basic_map<D>::scale_of(keyframe_id id) const {
  double scale = 1.0;
  while (!has_keyframe(id)) {
    const detail::erased_keyframe& e = content_.erased.at(id);
    scale *= e.scale;
    if (e.replacement == no_id) return scale;
    id = e.replacement;
  }
  return scale * at(id).scale;
}

template <feature_descriptor D>
keyframe_id basic_map<D>::next_remembered(keyframe_id id) const {
  const auto gone = content_.erased.lower_bound(id);
  if (gone != content_.erased.end() && gone->first == id) return id;
  const keyframe_id there = content_.keyframes.next_id(id);
  return gone == content_.erased.end() ? there : std::min(there, gone->first);
}

template <feature_descriptor D>
void basic_map<D>::forget_erased(std::span<const keyframe_id> keep, std::size_t latest) {
  std::map<keyframe_id, detail::erased_keyframe> kept;
  const auto take = [&](keyframe_id id) {  // with all that it leads to
    for (auto e = content_.erased.find(id); e != content_.erased.end();) {
      const keyframe_id next = e->second.replacement;
      kept.insert(content_.erased.extract(e));
      e = next == no_id ? content_.erased.end() : content_.erased.find(next);
    }
  };
  for (const keyframe_id id : keep) take(id);
  std::vector<keyframe_id> young;
  for (const auto& [id, e] : content_.erased)
    if (content_.erasures - e.number <= latest) young.push_back(id);
  for (const keyframe_id id : young) take(id);
  content_.forgotten += content_.erased.size();
  content_.erased = std::move(kept);
}

template <feature_descriptor D>
void basic_map<D>::transform(const sim3& T_new_old) {
  for (keyframe_id k = content_.keyframes.next_id(0); k != keyframe_end(); k = content_.keyframes.next_id(k + 1))
    move_keyframe(k, T_new_old);
  for (const landmark_type& l : content_.landmarks) move_landmark(l.id, T_new_old);
  for (auto& [id, e] : content_.erased)
    if (e.replacement == no_id) {
      e.T_replacement_camera = moved(T_new_old, e.T_replacement_camera);
      e.scale *= T_new_old.scale();
    }
}

template <feature_descriptor D>
keyframe_id basic_map<D>::add_keyframe(frame_type f) {
  ++pose_changes_;
  if (content_.keyframes.end_id() == keyframe_id{0}) {
    content_.sensor = f.sensor;
    content_.scale_is_known = f.scale_is_known;
  }
  const keyframe_id before = content_.keyframes.empty() ? no_id : content_.keyframes.back().id;
  const std::vector<landmark_id> seen = std::exchange(f.landmarks, std::vector<landmark_id>(f.features.size(), no_id));
  const keyframe_id id = content_.keyframes.add({std::move(f), keyframe_end()});
  for (std::uint32_t i = 0; i < seen.size(); ++i)
    if (const landmark_id l = replacement_of(seen[i]); l != no_id) attach(l, id, i);
  count_covisible(at(id), no_id);
  const keyframe_id strongest = covisibility_.strongest(id).keyframe;
  content_.tree.add(id, strongest != no_id ? strongest : before);
  return id;
}

template <feature_descriptor D>
void basic_map<D>::erase_keyframe(keyframe_id id) {
  assert(has_keyframe(id));
  ++pose_changes_;
  for (const landmark_id l : at(id).landmarks)
    if (l != no_id) detach(l, id);
  const keyframe_id replacement =
      content_.tree.erase(id, [&](keyframe_id a, keyframe_id b) { return covisibility_.shared(a, b); });
  covisibility_.erase(id);
  const keyframe_type& gone = at(id);
  detail::erased_keyframe& kept =
      content_.erased[id] = {replacement, gone.T_world_camera, gone.scale, content_.erasures++};
  if (replacement != no_id) {
    const keyframe_type& by = at(replacement);
    kept.T_replacement_camera = detail::scaled(by.T_world_camera.inverse() * gone.T_world_camera, 1.0 / by.scale);
    kept.scale /= by.scale;
  }
  content_.keyframes.erase(id, replacement);
}

template <feature_descriptor D>
landmark_id basic_map<D>::add_landmark(keyframe_id id, std::uint32_t feature, const vec3& position) {
  assert(at(id).landmarks[feature] == no_id);
  landmark_type l;
  l.id = landmark_end();
  l.position = position;
  l.created = id;
  l.visible = l.found = 1;
  const landmark_id created = content_.landmarks.add(std::move(l));
  attach(created, id, feature);
  update_landmark(created);
  return created;
}

template <feature_descriptor D>
bool basic_map<D>::add_observation(landmark_id l, keyframe_id k, std::uint32_t feature) {
  if (!attach(l, k, feature)) return false;
  for (const observation& o : landmark_at(l).observations)
    if (o.keyframe != k) covisibility_.share(k, o.keyframe);
  return true;
}

template <feature_descriptor D>
void basic_map<D>::erase_observation(landmark_id l, keyframe_id k) {
  if (!has_landmark(l) || landmark_at(l).seen_by(k) == nullptr) return;
  for (const observation& o : landmark_at(l).observations)
    if (o.keyframe != k) covisibility_.unshare(k, o.keyframe);
  detach(l, k);
}

template <feature_descriptor D>
bool basic_map<D>::erase_observation(landmark_id l, const observation& noted) {
  const observation* const now = has_landmark(l) ? landmark_at(l).seen_by(noted.keyframe) : nullptr;
  if (now == nullptr || !(*now == noted)) return false;
  erase_observation(l, noted.keyframe);
  return true;
}

template <feature_descriptor D>
void basic_map<D>::fuse(landmark_id from, landmark_id into) {
  assert(from != into && has_landmark(into));
  const landmark_type l = remove(from, into);
  for (const observation& o : l.observations) add_observation(into, o.keyframe, o.feature);
  content_.landmarks[into].found += l.found;
  content_.landmarks[into].visible += l.visible;
}

template <feature_descriptor D>
void basic_map<D>::update_landmark(landmark_id id) {
  landmark_type& l = content_.landmarks[id];
  vec3 sum = zeros<vec3>();
  for (const observation& o : l.observations)
    sum += normalized(at(o.keyframe).T_world_camera.translation() - l.position);
  l.normal = norm(sum) > 0.0 ? vec3(normalized(sum)) : zeros<vec3>();
  const observation& last = l.observations.back();
  const keyframe_type& k = at(last.keyframe);
  const double distance = norm(k.T_world_camera.translation() - l.position);
  l.max_distance = distance * std::pow(content_.scale_factor, k.features.keypoints[last.feature].octave);
  l.min_distance = l.max_distance / std::pow(content_.scale_factor, content_.levels - 1);
  if (std::exchange(l.has_current_descriptor, true)) return;
  const auto of = [&](std::size_t i) -> const D& {
    return at(l.observations[i].keyframe).features.descriptors[l.observations[i].feature];
  };
  l.descriptor = of(detail::most_typical(l.observations.size(), of));
}

template <feature_descriptor D>
id_offsets basic_map<D>::append(basic_map&& other, const sim3& T_this_other, const map_link& link) {
  ++pose_changes_;
  assert(content_.levels == other.content_.levels && content_.scale_factor == other.content_.scale_factor);
  other.transform(T_this_other);
  const id_offsets offsets{keyframe_end().value(), landmark_end().value()};
  for (const auto& [id, e] : other.content_.erased) {
    detail::erased_keyframe& here = content_.erased[id + offsets.keyframes] = e;
    if (e.replacement != no_id) here.replacement += offsets.keyframes;
    here.number += content_.erasures;  // as if all had been erased now, in their order
  }
  content_.erasures += other.content_.erasures;
  content_.forgotten += other.content_.forgotten;
  content_.tree.append(std::move(other.content_.tree), offsets.keyframes, link.into, link.from);
  covisibility_.append(std::move(other.covisibility_), offsets.keyframes);
  content_.keyframes.append(std::move(other.content_.keyframes));
  content_.landmarks.append(std::move(other.content_.landmarks));
  if (offsets.keyframes == 0) {
    content_.sensor = other.content_.sensor;
    content_.scale_is_known = other.content_.scale_is_known;
  }
  for (keyframe_id id = content_.keyframes.next_id(offsets.keyframes); id != keyframe_end();
       id = content_.keyframes.next_id(id + 1)) {
    keyframe_type& k = content_.keyframes[id];
    k.id = id;
    for (landmark_id& l : k.landmarks)
      if (l != no_id) l += offsets.landmarks;
  }
  for (landmark_id id = next_landmark(offsets.landmarks); id != landmark_end(); id = next_landmark(id + 1)) {
    landmark_type& l = content_.landmarks[id];
    l.id = id;
    l.created += offsets.keyframes;
    for (observation& o : l.observations) o.keyframe += offsets.keyframes;
  }
  other = basic_map{content_.levels, content_.scale_factor, other.content_.min_shared};
  return offsets;
}

template <feature_descriptor D>
std::vector<covisible> basic_map<D>::observers_of(const std::vector<landmark_id>& landmarks) const {
  detail::counter<keyframe_id> observed;
  for (const landmark_id l : landmarks)
    if (has_landmark(l))
      for (const observation& o : landmark_at(l).observations) observed.add(o.keyframe);
  std::vector<covisible> order;
  for (const auto& e : observed.entries()) order.push_back({e.id, e.count});
  std::sort(order.begin(), order.end(), stronger);
  return order;
}

template <feature_descriptor D>
bool basic_map<D>::attach(landmark_id id, keyframe_id k, std::uint32_t feature) {
  landmark_id& shown = content_.keyframes[k].landmarks[feature];
  landmark_type& l = content_.landmarks[id];
  if (shown != no_id || l.seen_by(k) != nullptr) return false;
  shown = id;
  const auto at = std::lower_bound(l.observations.begin(), l.observations.end(), k,
                                   [](const observation& o, keyframe_id key) { return o.keyframe < key; });
  l.observations.insert(at, {k, feature});
  l.has_current_descriptor = false;
  return true;
}

template <feature_descriptor D>
void basic_map<D>::detach(landmark_id id, keyframe_id k) {
  landmark_type& l = content_.landmarks[id];
  const auto at = l.observations.begin() + (l.seen_by(k) - l.observations.data());
  content_.keyframes[k].landmarks[at->feature] = no_id;
  l.observations.erase(at);
  l.has_current_descriptor = false;
  if (l.observations.empty()) content_.landmarks.erase(id);
}

template <feature_descriptor D>
auto basic_map<D>::remove(landmark_id id, landmark_id replacement) -> landmark_type {
  landmark_type l = std::move(content_.landmarks[id]);
  content_.landmarks.erase(id, replacement);
  for (auto o = l.observations.begin(); o != l.observations.end(); ++o) {
    content_.keyframes[o->keyframe].landmarks[o->feature] = no_id;
    for (auto other = std::next(o); other != l.observations.end(); ++other)
      covisibility_.unshare(o->keyframe, other->keyframe);
  }
  return l;
}

template <feature_descriptor D>
void basic_map<D>::count_covisible(const keyframe_type& k, keyframe_id below) {
  detail::counter<keyframe_id> shared;
  for (const landmark_id l : k.landmarks)
    if (l != no_id)
      for (const observation& o : landmark_at(l).observations)
        if (o.keyframe != k.id && o.keyframe < below) shared.add(o.keyframe);
  auto entries = std::move(shared).take();
  std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.id < b.id; });
  for (const auto& e : entries) covisibility_.share(k.id, e.id, e.count);
}

#ifdef ORBIS_COMPILED
extern template class basic_map<features::binary_descriptor<256>>;
#endif

}  // namespace orbis::slam
