// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The map: keyframes, landmarks, which keyframe sees which landmark, and the graphs that follow.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
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

/// Both sides of every observation are kept in step: `keyframe.landmarks[f] == l` if and only if
/// `landmark.observations` has `{keyframe, f}`. The covisibility graph counts exactly these, and the spanning tree
/// holds all keyframes (`validate` checks it). References to keyframes and landmarks stay valid until these are erased.
///
/// Let n be the observations of a landmark: a change to one costs O(n), whatever the size of the map.
class map {
 public:
  map() = default;
  map(int levels, double scale_factor, std::uint32_t min_shared = 15) : covisibility_{min_shared} {
    all_.levels = levels;
    all_.scale_factor = scale_factor;
    all_.min_shared = min_shared;
  }
  /// From its parts. `keyframe.landmarks` are set by the landmarks' observations.
  /// @pre the parts fit each other: numbers name what is there, and no keypoint shows two landmarks
  explicit map(detail::map_content parts) : all_{std::move(parts)}, covisibility_{all_.min_shared} {
    for (keyframe_id k = 0; k != keyframe_end(); ++k)
      if (has_keyframe(k)) all_.keyframes[k].landmarks.assign(all_.keyframes[k].size(), no_id);
    for (const landmark& l : all_.landmarks)
      for (const observation& o : l.observations) all_.keyframes[o.keyframe].landmarks[o.feature] = l.id;
    for (const keyframe& k : all_.keyframes) count_covisible(k, k.id);
  }

  /// Those there are, by ascending number: a range with `size()`, `front()` and `back()`.
  [[nodiscard]] const detail::slot_map<keyframe>& keyframes() const noexcept { return all_.keyframes; }
  [[nodiscard]] const detail::slot_map<landmark>& landmarks() const noexcept { return all_.landmarks; }
  [[nodiscard]] std::size_t landmark_count() const noexcept { return all_.landmarks.size(); }
  /// The numbers that the next ones will have.
  [[nodiscard]] keyframe_id keyframe_end() const noexcept { return all_.keyframes.end_id(); }
  [[nodiscard]] landmark_id landmark_end() const noexcept { return all_.landmarks.end_id(); }
  [[nodiscard]] bool has_keyframe(keyframe_id id) const noexcept { return all_.keyframes.contains(id); }
  [[nodiscard]] bool has_landmark(landmark_id id) const noexcept { return all_.landmarks.contains(id); }
  /// @pre has_keyframe(id)
  [[nodiscard]] const keyframe& at(keyframe_id id) const { return all_.keyframes[id]; }
  /// @pre has_landmark(id)
  [[nodiscard]] const landmark& landmark_at(landmark_id id) const { return all_.landmarks[id]; }

  /// What a landmark is now: itself while alive, else the one it was fused into; `no_id` if it is gone.
  [[nodiscard]] landmark_id became(landmark_id id) const noexcept { return all_.landmarks.became(id); }
  /// What a keyframe is now: itself while it is there, else the nearest one up the tree; `no_id` if none is left.
  [[nodiscard]] keyframe_id heir(keyframe_id id) const noexcept { return all_.keyframes.became(id); }
  /// `T_world_camera` of a keyframe; of one that was erased, as its heirs have moved since. @pre id < keyframe_end()
  [[nodiscard]] se3 pose_of(keyframe_id id) const {
    se3 T_below_camera;
    while (!has_keyframe(id)) {
      const detail::erased_keyframe& e = all_.erased.at(id);
      T_below_camera = e.T_heir_camera * T_below_camera;
      if (e.heir == no_id) return T_below_camera;
      id = e.heir;
    }
    return at(id).T_world_camera * T_below_camera;
  }

  [[nodiscard]] const covisibility_graph& covisibility() const noexcept { return covisibility_; }
  [[nodiscard]] const spanning_tree& tree() const noexcept { return all_.tree; }
  [[nodiscard]] const detail::map_content& content() const noexcept { return all_; }

  void count_visible(landmark_id id) { ++all_.landmarks[id].visible; }
  void count_found(landmark_id id) { ++all_.landmarks[id].found; }
  void set_pose(keyframe_id id, const se3& T_world_camera) { all_.keyframes[id].T_world_camera = T_world_camera; }
  void set_position(landmark_id id, const vec3& position) { all_.landmarks[id].position = position; }
  /// Moves a landmark rigidly, as when the keyframes that see it move by `T_new_old`, a motion in the world.
  void move_landmark(landmark_id id, const se3& T_new_old) {
    landmark& l = all_.landmarks[id];
    l.position = T_new_old * l.position;
    l.normal = T_new_old.rotation() * l.normal;
  }
  /// Another frame of reference for the whole map. O(map).
  void transform(const se3& T_new_old) {
    for (keyframe_id k = 0; k != keyframe_end(); ++k)
      if (has_keyframe(k)) set_pose(k, T_new_old * at(k).T_world_camera);
    for (landmark_id l = 0; l != landmark_end(); ++l)
      if (has_landmark(l)) move_landmark(l, T_new_old);
    for (auto& [id, e] : all_.erased)
      if (e.heir == no_id) e.T_heir_camera = T_new_old * e.T_heir_camera;
  }

  /// Adds a frame with the landmarks it shows (those that were fused meanwhile as what they became). Its parent in the
  /// tree is the keyframe that it shares most with; the newest one, if it shares nothing with any.
  keyframe_id add_keyframe(frame f) {
    const keyframe_id before = all_.keyframes.empty() ? no_id : all_.keyframes.back().id;
    const std::vector<landmark_id> seen =
        std::exchange(f.landmarks, std::vector<landmark_id>(f.features.size(), no_id));
    const keyframe_id id = all_.keyframes.add({std::move(f), keyframe_end()});
    for (std::uint32_t i = 0; i < seen.size(); ++i)
      if (const landmark_id l = became(seen[i]); l != no_id) attach(l, id, i);
    count_covisible(at(id), no_id);
    const keyframe_id strongest = covisibility_.strongest(id).keyframe;
    all_.tree.add(id, strongest != no_id ? strongest : before);
    return id;
  }

  /// Takes a keyframe out: its observations go, and landmarks that nobody else sees; its children in the tree get
  /// other parents. Its pose can still be asked for. @pre has_keyframe(id)
  void erase_keyframe(keyframe_id id) {
    assert(has_keyframe(id));
    for (const landmark_id l : at(id).landmarks)
      if (l != no_id) detach(l, id);
    const keyframe_id heir =
        all_.tree.erase(id, [&](keyframe_id a, keyframe_id b) { return covisibility_.shared(a, b); });
    covisibility_.erase(id);
    const se3& T_world_camera = at(id).T_world_camera;
    all_.erased[id] = {heir, heir == no_id ? T_world_camera : at(heir).T_world_camera.inverse() * T_world_camera};
    all_.keyframes.erase(id, heir);
  }

  /// Notes that a loop was closed between two keyframes. @pre a != b, and both are there
  void add_loop_edge(keyframe_id a, keyframe_id b) { all_.tree.add_loop_edge(a, b); }

  /// A new landmark at keypoint `feature` of a keyframe, where its depth says.
  /// @pre the keypoint has depth and shows no landmark yet
  landmark_id add_landmark(keyframe_id id, std::uint32_t feature) {
    return add_landmark(id, feature, at(id).point_world(feature));
  }
  /// ... or at `position`, in the world.
  landmark_id add_landmark(keyframe_id id, std::uint32_t feature, const vec3& position) {
    assert(at(id).landmarks[feature] == no_id);
    landmark l;
    l.id = landmark_end();
    l.position = position;
    l.created = id;
    l.visible = l.found = 1;
    const landmark_id created = all_.landmarks.add(std::move(l));
    attach(created, id, feature);
    update(created);
    return created;
  }

  /// Notes that a keypoint of a keyframe shows a landmark; nothing if either is taken already.
  bool observe(landmark_id l, keyframe_id k, std::uint32_t feature) {
    if (!attach(l, k, feature)) return false;
    for (const observation& o : landmark_at(l).observations)
      if (o.keyframe != k) covisibility_.share(k, o.keyframe);
    return true;
  }

  /// Takes one observation back; a landmark that nobody sees any more dies.
  void forget(landmark_id l, keyframe_id k) {
    if (!has_landmark(l) || landmark_at(l).seen_by(k) == nullptr) return;
    for (const observation& o : landmark_at(l).observations)
      if (o.keyframe != k) covisibility_.unshare(k, o.keyframe);
    detach(l, k);
  }

  /// The same of an observation that was noted earlier; false if it is not there any more.
  bool forget(landmark_id l, const observation& noted) {
    const observation* const now = has_landmark(l) ? landmark_at(l).seen_by(noted.keyframe) : nullptr;
    if (now == nullptr || !(*now == noted)) return false;
    forget(l, noted.keyframe);
    return true;
  }

  /// O(n^2).
  void remove_landmark(landmark_id id) { remove(id, no_id); }

  /// The observations of `from` become those of `into`, as far as no keyframe sees both; `from` dies, and what asks
  /// for it is led to `into`. O(n^2). @pre from != into, and both are alive
  void fuse(landmark_id from, landmark_id into) {
    assert(from != into && has_landmark(into));
    const landmark l = remove(from, into);
    for (const observation& o : l.observations) observe(into, o.keyframe, o.feature);
    all_.landmarks[into].found += l.found;
    all_.landmarks[into].visible += l.visible;
  }

  /// Recomputes what follows from a landmark's observations: normal, range of distances, and, if these are not those
  /// for which it was chosen, the descriptor. O(n).
  void update(landmark_id id) {
    landmark& l = all_.landmarks[id];
    vec3 sum = vec3::Zero();
    for (const observation& o : l.observations)
      sum += (at(o.keyframe).T_world_camera.translation() - l.position).normalized();
    l.normal = sum.norm() > 0.0 ? vec3(sum.normalized()) : vec3::Zero();
    const observation& last = l.observations.back();
    const keyframe& k = at(last.keyframe);
    const double distance = (k.T_world_camera.translation() - l.position).norm();
    l.max_distance = distance * std::pow(all_.scale_factor, k.features.keypoints[last.feature].octave);
    l.min_distance = l.max_distance / std::pow(all_.scale_factor, all_.levels - 1);
    if (std::exchange(l.has_current_descriptor, true)) return;
    const auto of = [&](std::size_t i) -> const auto& {
      return at(l.observations[i].keyframe).features.descriptors[l.observations[i].feature];
    };
    l.descriptor = of(detail::most_typical(l.observations.size(), of));
  }

  /// Takes over another map, whose world is moved by `T_this_other`, and hangs it on this one at `link`. Nothing is
  /// fused. Returns what the numbers of its keyframes and landmarks have grown by. O(both maps).
  /// @pre both have the same pyramid; `link` names keyframes that are there, unless either map is empty
  id_offsets absorb(map&& other, const se3& T_this_other, const map_link& link) {
    assert(all_.levels == other.all_.levels && all_.scale_factor == other.all_.scale_factor);
    other.transform(T_this_other);
    const id_offsets offsets{keyframe_end(), landmark_end()};
    for (const auto& [id, e] : other.all_.erased)
      all_.erased[id + offsets.keyframes] = {e.heir == no_id ? no_id : e.heir + offsets.keyframes, e.T_heir_camera};
    all_.tree.append(std::move(other.all_.tree), offsets.keyframes, link.into, link.from);
    covisibility_.append(std::move(other.covisibility_), offsets.keyframes);
    all_.keyframes.append(std::move(other.all_.keyframes));
    all_.landmarks.append(std::move(other.all_.landmarks));
    for (keyframe_id id = offsets.keyframes; id != keyframe_end(); ++id) {
      if (!has_keyframe(id)) continue;
      keyframe& k = all_.keyframes[id];
      k.id = id;
      for (landmark_id& l : k.landmarks)
        if (l != no_id) l += offsets.landmarks;
    }
    for (landmark_id id = offsets.landmarks; id != landmark_end(); ++id) {
      if (!has_landmark(id)) continue;
      landmark& l = all_.landmarks[id];
      l.id = id;
      l.created += offsets.keyframes;
      for (observation& o : l.observations) o.keyframe += offsets.keyframes;
    }
    other = map{all_.levels, all_.scale_factor, other.all_.min_shared};
    return offsets;
  }

  /// The keyframes that share the most landmarks with the given ones, most first (older first where
  /// equal), with the number they share. Costs what these landmarks' observations are.
  [[nodiscard]] std::vector<std::pair<keyframe_id, std::size_t>> sharing(const std::vector<landmark_id>& seen) const {
    detail::counter shared;
    for (const landmark_id l : seen)
      if (has_landmark(l))
        for (const observation& o : landmark_at(l).observations) shared.add(o.keyframe);
    std::vector<std::pair<keyframe_id, std::size_t>> order;
    for (const detail::counter::entry& e : shared.entries()) order.emplace_back(e.number, e.count);
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) {
      return a.second != b.second ? a.second > b.second : a.first < b.first;
    });
    return order;
  }

 private:
  /// Both sides of a new observation, without the graph.
  bool attach(landmark_id id, keyframe_id k, std::uint32_t feature) {
    landmark_id& shown = all_.keyframes[k].landmarks[feature];
    landmark& l = all_.landmarks[id];
    if (shown != no_id || l.seen_by(k) != nullptr) return false;
    shown = id;
    const auto at = std::lower_bound(l.observations.begin(), l.observations.end(), k,
                                     [](const observation& o, keyframe_id key) { return o.keyframe < key; });
    l.observations.insert(at, {k, feature});
    l.has_current_descriptor = false;
    return true;
  }
  /// ... and of one that is taken back; the landmark dies with its last. @pre there is one
  void detach(landmark_id id, keyframe_id k) {
    landmark& l = all_.landmarks[id];
    const auto at = l.observations.begin() + (l.seen_by(k) - l.observations.data());
    all_.keyframes[k].landmarks[at->feature] = no_id;
    l.observations.erase(at);
    l.has_current_descriptor = false;
    if (l.observations.empty()) all_.landmarks.erase(id);
  }
  landmark remove(landmark_id id, landmark_id successor) {
    landmark l = std::move(all_.landmarks[id]);
    all_.landmarks.erase(id, successor);
    for (auto o = l.observations.begin(); o != l.observations.end(); ++o) {
      all_.keyframes[o->keyframe].landmarks[o->feature] = no_id;
      for (auto other = std::next(o); other != l.observations.end(); ++other)
        covisibility_.unshare(o->keyframe, other->keyframe);
    }
    return l;
  }
  /// Enters what a keyframe shares with others, all at once: with those of lower number than `below`.
  void count_covisible(const keyframe& k, keyframe_id below) {
    detail::counter shared;
    for (const landmark_id l : k.landmarks)
      if (l != no_id)
        for (const observation& o : landmark_at(l).observations)
          if (o.keyframe != k.id && o.keyframe < below) shared.add(o.keyframe);
    std::vector<detail::counter::entry> entries = std::move(shared).take();
    std::sort(entries.begin(), entries.end(), [](const auto& a, const auto& b) { return a.number < b.number; });
    for (const detail::counter::entry& e : entries) covisibility_.share(k.id, e.number, e.count);
  }

  detail::map_content all_;
  covisibility_graph covisibility_;
};

}  // namespace orbis::slam
