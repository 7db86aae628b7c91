// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What tracking, mapping and loop closing have in common, and the locks that keep them apart.
#pragma once

#include <atomic>
#include <concepts>
#include <cstddef>
#include <mutex>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/events.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>

namespace orbis::slam::detail {

/// Two locks, always taken in this order:
///  - `edit()`: held by whoever changes maps in several steps (mapping of a keyframe, correction of a loop, global
///    adjustment), so that only tracking adds to a map in between;
///  - `lock()`: held by whoever reads or changes anything here, for a short time; never while solving, nor while
///    listeners are called.
///
/// Both are given in turn: who gives a lock back and wants it again at once, part by part, comes after who waits.
template <camera::camera_model Camera, place_recognizer Places>
struct shared_state {
  shared_state(optimize::reprojection<Camera> model_, pyramid_scales scales_, const options& settings_, Places places_)
      : model{std::move(model_)},
        scales{scales_},
        settings{settings_},
        atlas{scales.levels(), scales.factor()},
        places{std::move(places_)} {}

  const optimize::reprojection<Camera> model;
  const pyramid_scales scales;
  const options& settings;
  listeners listening;

  slam::atlas atlas;
  Places places;
  std::size_t loops_closed = 0;
  std::size_t maps_merged = 0;
  std::size_t keyframes_culled = 0;

  [[nodiscard]] std::unique_lock<std::mutex> lock() const { return lock_fairly(next_map_mutex_, map_mutex_); }
  [[nodiscard]] std::unique_lock<std::mutex> edit() const { return lock_fairly(next_edit_mutex_, edit_mutex_); }
  /// As `edit`, unless somebody has it.
  [[nodiscard]] std::unique_lock<std::mutex> try_edit() const {
    return std::unique_lock{edit_mutex_, std::try_to_lock};
  }
  template <std::invocable F>
  decltype(auto) locked(F&& f) const {
    const auto held = lock();
    return std::forward<F>(f)();
  }

  [[nodiscard]] bool has(map_keyframe k) const {
    return atlas.contains(k.map) && atlas.at(k.map).has_keyframe(k.keyframe);
  }
  /// @pre has(k)
  [[nodiscard]] keyframe_event event_of(map_keyframe k) const {
    const keyframe& frame = atlas.at(k.map).at(k.keyframe);
    return {k, frame.timestamp, frame.index, frame.T_world_camera};
  }

  /// The keyframes that look most like an image, one of each place.
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

  /// Drops a map with all that is known of it. @pre it is there, and not the active one
  void remove_map(map_id id) {
    for (const keyframe& k : atlas.at(id).keyframes()) places.erase({id, k.id});
    atlas.remove(id);
  }

 private:
  /// Whoever is next holds `next` while it waits: a plain mutex may be taken again before those that wait wake up.
  [[nodiscard]] static std::unique_lock<std::mutex> lock_fairly(std::mutex& next, std::mutex& mutex) {
    const std::lock_guard first{next};
    return std::unique_lock{mutex};
  }

  mutable std::mutex map_mutex_, edit_mutex_, next_map_mutex_, next_edit_mutex_;
};

}  // namespace orbis::slam::detail
