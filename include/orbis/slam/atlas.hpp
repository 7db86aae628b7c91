// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// An atlas of several maps: a new map is started when tracking has been lost for a long time; maps are merged when a
/// place is recognised.
///
/// Source of the idea: R. Elvira, J. D. Tardos, J. M. M. Montiel, "ORBSLAM-Atlas: a robust and accurate multi-map
/// system", IROS 2019.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

#include <orbis/core/sim3.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// A set of maps, each with its own world frame. Frames are tracked in one of them, the active map. References to maps
/// stay valid until the map is merged into another one or removed.
template <feature_descriptor D>
class basic_atlas {
 public:
  using map_type = basic_map<D>;

  /// Creates an atlas with one empty map. The arguments are passed to the constructor of every new map.
  explicit basic_atlas(int levels = 8, double scale_factor = 1.2, std::uint32_t min_shared = 15)
      : levels_{levels}, scale_factor_{scale_factor}, min_shared_{min_shared} {
    create();
  }

  [[nodiscard]] map_type& active() { return maps_.at(active_); }
  [[nodiscard]] const map_type& active() const { return maps_.at(active_); }
  [[nodiscard]] map_id active_id() const noexcept { return active_; }
  [[nodiscard]] bool contains(map_id id) const { return maps_.contains(id); }
  /// @pre contains(id)
  [[nodiscard]] map_type& at(map_id id) { return maps_.at(id); }
  /// @pre contains(id)
  [[nodiscard]] const map_type& at(map_id id) const { return maps_.at(id); }
  /// All maps in ascending order of id.
  [[nodiscard]] const std::map<map_id, map_type>& maps() const noexcept { return maps_; }
  [[nodiscard]] std::size_t size() const noexcept { return maps_.size(); }

  /// Returns true if `k` is the current id of an existing keyframe.
  [[nodiscard]] bool has(map_keyframe k) const { return contains(k.map) && at(k.map).has_keyframe(k.keyframe); }
  /// @pre has(k)
  [[nodiscard]] const basic_keyframe<D>& at(map_keyframe k) const { return at(k.map).at(k.keyframe); }

  /// Adds an empty map, which becomes the active one. Returns its id.
  map_id create() {
    active_ = next_++;
    maps_.try_emplace(active_, levels_, scale_factor_, min_shared_);
    return active_;
  }
  /// Adds a map, which becomes the active one. Returns its id. @pre it has the same pyramid as the other maps
  map_id create(map_type m) {
    assert(m.content().levels == levels_ && m.content().scale_factor == scale_factor_);
    active_ = next_++;
    maps_.try_emplace(active_, std::move(m));
    return active_;
  }
  /// Activates a map. @pre contains(id)
  void activate(map_id id) {
    assert(contains(id));
    active_ = id;
  }
  /// Removes a map. @pre contains(id), id != active_id()
  void remove(map_id id) {
    assert(contains(id) && id != active_);
    maps_.erase(id);
  }

  /// Merges map `from` into map `into`: transforms `from` by `T_into_from` and attaches its spanning tree at `link`. If
  /// `from` was active, `into` becomes active. No landmarks are fused, and no loop edge is added. O(both maps).
  /// @pre from != into; `link` refers to existing keyframes, unless either map is empty
  id_offsets merge(map_id from, map_id into, const sim3& T_into_from, const map_link& link) {
    assert(from != into && contains(from) && contains(into));
    const id_offsets offsets = at(into).append(std::move(at(from)), T_into_from, link);
    maps_.erase(from);
    merged_[from] = {into, offsets};
    if (active_ == from) active_ = into;
    return offsets;
  }
  /// Returns the current id of a keyframe, which changes when its map is merged into another one. The keyframe may have
  /// been erased since (see `basic_map::replacement`). Ids in a removed map are returned unchanged. O(merges).
  [[nodiscard]] map_keyframe current(map_keyframe k) const {
    for (auto to = merged_.find(k.map); to != merged_.end(); to = merged_.find(k.map))
      k = {to->second.into, k.keyframe + to->second.offsets.keyframes};
    return k;
  }
  /// Returns the current id of a landmark, which changes when its map is merged into another one. @pre l != no_id
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
  std::map<map_id, map_type> maps_;
  std::map<map_id, merger> merged_;
  map_id active_ = 0;
  map_id next_ = 0;
};

/// An atlas with ORB descriptors.
using atlas = basic_atlas<features::binary_descriptor<256>>;

}  // namespace orbis::slam
