// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Several maps: a new one where tracking had to start afresh, one again where a place is recognised.
///
/// Source of the idea: R. Elvira, J. D. Tardos, J. M. M. Montiel, "ORBSLAM-Atlas: a robust and accurate multi-map
/// system", IROS 2019.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include <orbis/core/se3.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// Maps in frames of their own, one of them active. There is always an active one. References to maps stay valid until
/// the map is merged into another or removed.
class atlas {
 public:
  explicit atlas(int levels = 8, double scale_factor = 1.2, std::uint32_t min_shared = 15)
      : levels_{levels}, scale_factor_{scale_factor}, min_shared_{min_shared} {
    create();
  }

  [[nodiscard]] slam::map& active() { return maps_.at(active_); }
  [[nodiscard]] const slam::map& active() const { return maps_.at(active_); }
  [[nodiscard]] map_id active_id() const noexcept { return active_; }
  [[nodiscard]] bool contains(map_id id) const { return maps_.contains(id); }
  /// @pre contains(id)
  [[nodiscard]] slam::map& at(map_id id) { return maps_.at(id); }
  [[nodiscard]] const slam::map& at(map_id id) const { return maps_.at(id); }
  /// By ascending number.
  [[nodiscard]] const std::map<map_id, slam::map>& maps() const noexcept { return maps_; }
  [[nodiscard]] std::size_t size() const noexcept { return maps_.size(); }

  /// A new, empty map becomes the active one.
  map_id create() {
    active_ = next_++;
    maps_.try_emplace(active_, levels_, scale_factor_, min_shared_);
    return active_;
  }
  /// A map that was made elsewhere becomes the active one. @pre it has the pyramid of the others
  map_id create(slam::map m) {
    assert(m.content().levels == levels_ && m.content().scale_factor == scale_factor_);
    active_ = next_++;
    maps_.try_emplace(active_, std::move(m));
    return active_;
  }
  /// @pre contains(id)
  void activate(map_id id) {
    assert(contains(id));
    active_ = id;
  }
  /// Drops a map that is not the active one. @pre contains(id), id != active_id()
  void remove(map_id id) {
    assert(contains(id) && id != active_);
    maps_.erase(id);
  }

  /// Makes one map a part of another: `from` moves by `T_into_from` and hangs at `link`. If it was the active one, the
  /// other is now. Landmarks that both have are not fused, and no loop edge is added. O(both maps).
  /// @pre from != into; `link` names keyframes that are there, unless either map is empty
  id_offsets merge(map_id from, map_id into, const se3& T_into_from, const map_link& link) {
    assert(from != into && contains(from) && contains(into));
    const id_offsets offsets = at(into).absorb(std::move(at(from)), T_into_from, link);
    maps_.erase(from);
    merged_[from] = {into, offsets};
    if (active_ == from) active_ = into;
    return offsets;
  }
  /// The same where it is not known which keyframes belong together: the root of `from` hangs on the keyframe of
  /// `into` that is nearest to it.
  id_offsets merge(map_id from, map_id into, const se3& T_into_from) {
    map_link link{.from = at(from).tree().root()};
    double least = 0.0;
    for (const keyframe& k : at(into).keyframes()) {
      if (link.from == no_id) break;
      const vec3 root = T_into_from * at(from).at(link.from).T_world_camera.translation();
      const double squared = (k.T_world_camera.translation() - root).squaredNorm();
      if (link.into != no_id && !(squared < least)) continue;
      least = squared;
      link.into = k.id;
    }
    return merge(from, into, T_into_from, link);
  }

  /// What a keyframe is called now that maps have been merged; it may have been erased since. The number of a map that
  /// was removed stays.
  [[nodiscard]] map_keyframe current(map_keyframe k) const {
    for (auto to = merged_.find(k.map); to != merged_.end(); to = merged_.find(k.map))
      k = {to->second.into, k.keyframe + to->second.offsets.keyframes};
    return k;
  }
  /// The same for a landmark of a map. @pre l != no_id
  [[nodiscard]] landmark_id current(map_id map, landmark_id l) const {
    for (auto to = merged_.find(map); to != merged_.end(); to = merged_.find(map)) {
      map = to->second.into;
      l += to->second.offsets.landmarks;
    }
    return l;
  }

 private:
  struct merger {
    map_id into;
    id_offsets offsets;
  };

  int levels_;
  double scale_factor_;
  std::uint32_t min_shared_;
  std::map<map_id, slam::map> maps_;
  std::map<map_id, merger> merged_;
  map_id active_ = 0;
  map_id next_ = 0;
};

}  // namespace orbis::slam
