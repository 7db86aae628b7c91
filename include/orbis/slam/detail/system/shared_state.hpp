// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The state shared by tracking, mapping and loop closing, with its locks.
#pragma once

#include <concepts>
#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/events.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>

namespace orbis::slam::detail {

/// Two locks, always locked in this order:
/// - `edit()`: held while maps are changed in several steps (mapping of a keyframe, correction of a loop, global
/// adjustment). Between these steps, only tracking changes the map: it adds data, and forgets keyframes erased long
/// ago;
/// - `lock()`: held for a few milliseconds while any of this state is read or changed; never during adjustments or
/// callbacks.
///
/// Both are fair: a thread that releases and relocks a lock repeatedly lets waiting threads go first.
template <camera::camera_model Camera, feature_descriptor D, place_recognizer<D> Places>
struct shared_state {
  shared_state(camera_rig<Camera> rig_, const options& settings_, Places places_)
      : rig{std::move(rig_)},
        settings{settings_},
        atlas{rig.scales.levels(), rig.scales.factor()},
        places{std::move(places_)} {}

  const camera_rig<Camera> rig;
  const options& settings;
  listeners callbacks;

  basic_atlas<D> atlas;
  Places places;
  std::size_t loops_closed = 0;
  std::size_t maps_merged = 0;
  std::size_t keyframes_culled = 0;

  [[nodiscard]] std::unique_lock<std::mutex> lock() const { return lock_fairly(next_map_mutex_, map_mutex_); }
  [[nodiscard]] std::unique_lock<std::mutex> edit() const { return lock_fairly(next_edit_mutex_, edit_mutex_); }
  /// Like `edit`, but without waiting: callers must check whether the lock is owned.
  [[nodiscard]] std::unique_lock<std::mutex> try_edit() const {
    return std::unique_lock{edit_mutex_, std::try_to_lock};
  }
  /// Calls `f` with `lock()` held.
  template <std::invocable F>
  decltype(auto) locked(F&& f) const {
    const auto held = lock();
    return std::forward<F>(f)();
  }

  /// @pre atlas.has(k)
  [[nodiscard]] keyframe_event make_event(map_keyframe k) const {
    const auto& frame = atlas.at(k);
    return {k, frame.timestamp, frame.index, frame.T_world_camera};
  }

  /// Returns the keyframes with the most similar appearance, one for each place.
  template <std::predicate<map_keyframe> Exclude>
  [[nodiscard]] std::vector<map_keyframe> similar(const typename Places::signature& bow_vector, std::size_t count,
                                                  Exclude&& exclude) {
    return places.similar(bow_vector, count, exclude, [&](map_keyframe k) {
      std::vector<map_keyframe> around;
      for (const covisible& n : atlas.at(k.map).covisibility().neighbors(k.keyframe, 10))
        around.push_back({k.map, n.keyframe});
      return around;
    });
  }

  /// Removes a map and its keyframes. @pre the map exists and is not active
  void remove_map(map_id id) {
    for (const auto& k : atlas.at(id).keyframes()) places.erase({id, k.id});
    atlas.remove(id);
  }

 private:
  /// The first waiting thread holds `next`, because a plain mutex could be relocked before waiting threads wake up.
  [[nodiscard]] static std::unique_lock<std::mutex> lock_fairly(std::mutex& next, std::mutex& mutex) {
    const std::lock_guard first{next};
    return std::unique_lock{mutex};
  }

  mutable std::mutex map_mutex_, edit_mutex_, next_map_mutex_, next_edit_mutex_;
};

}  // namespace orbis::slam::detail
