// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What is done with each new keyframe.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/slam/detail/mapping/keyframe_culling.hpp>
#include <orbis/slam/detail/mapping/landmark_culling.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/detail/mapping/landmark_triangulation.hpp>
#include <orbis/slam/detail/mapping/local_adjustment.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>

namespace orbis::slam::detail {

/// Works the map over around a keyframe: drops landmarks that proved useless, makes new ones of what two keyframes see
/// without depth, makes one of those that are the same, adjusts all of it, and drops keyframes that tell nothing new.
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section VI.
template <camera::camera_model Camera, place_recognizer Places>
class local_mapper {
 public:
  explicit local_mapper(shared_state<Camera, Places>& shared) : shared_{shared} {}

  /// `hurry()` is asked now and then: true ends the adjustment early, as the next keyframe waits.
  template <std::predicate Hurry>
  void process(map_keyframe k, Hurry&& hurry) {
    std::vector<keyframe_event> culled;
    {
      const auto edit = shared_.edit();
      if (!prepare(k)) return;
      slam::map& m = shared_.locked([&]() -> slam::map& { return shared_.atlas.at(k.map); });
      shared_.locked([&] { cull_landmarks(m, k.keyframe, shared_.settings.culling); });
      shared_.locked(
          [&] { triangulate_landmarks(m, k.keyframe, shared_.model, shared_.scales, shared_.settings.triangulation); });
      shared_.locked([&] { fuse_with_neighbors(m, k.keyframe, shared_.model, shared_.scales); });
      adjust(m, k.keyframe, hurry);
      culled = cull(m, k);
    }
    if (const auto& tell = shared_.listening.keyframe_culled)
      for (const keyframe_event& e : culled) tell(e);
  }

 private:
  /// Enters the keyframe among the places. False if it is no more.
  bool prepare(map_keyframe& k) {
    const keyframe* frame = shared_.locked([&]() -> const keyframe* {
      k = shared_.atlas.current(k);
      return shared_.has(k) ? &shared_.atlas.at(k.map).at(k.keyframe) : nullptr;
    });
    if (frame == nullptr) return false;
    const auto bow_vector = shared_.places.describe(frame->features);
    shared_.locked([&] { shared_.places.add(k, bow_vector); });
    return true;
  }

  template <class Hurry>
  void adjust(slam::map& m, keyframe_id k, Hurry&& hurry) {
    if (!shared_.locked(
            [&] { return adjustment_.gather(m, k, shared_.model, shared_.scales, shared_.settings.adjustment); }))
      return;
    const auto go_on = [&](std::size_t, std::size_t) { return !hurry(); };
    adjustment_.solve(go_on);
    shared_.locked([&] { adjustment_.apply(m); });
  }

  std::vector<keyframe_event> cull(slam::map& m, map_keyframe newest) {
    return shared_.locked([&] {
      // What an event says of a keyframe has to be asked while it is there. Newer ones have not been mapped yet.
      std::vector<keyframe_event> judged;
      const auto keep = [&](keyframe_id k) {
        if (k > newest.keyframe) return true;
        judged.push_back(shared_.event_of({newest.map, k}));
        return false;
      };
      const std::vector<keyframe_id> erased =
          cull_keyframes(m, newest.keyframe, shared_.settings.close_depth, shared_.settings.culling, keep);
      std::erase_if(judged, [&](const keyframe_event& e) {
        return std::find(erased.begin(), erased.end(), e.id.keyframe) == erased.end();
      });
      for (const keyframe_event& e : judged) shared_.places.erase(e.id);
      shared_.keyframes_culled += judged.size();
      return judged;
    });
  }

  shared_state<Camera, Places>& shared_;
  local_adjustment<Camera> adjustment_;
};

}  // namespace orbis::slam::detail
