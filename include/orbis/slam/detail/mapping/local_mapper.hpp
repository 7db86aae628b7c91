// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Local mapping: what is done with each new keyframe.
#pragma once

#include <algorithm>
#include <cstddef>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/slam/detail/mapping/culling.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/detail/mapping/landmark_triangulation.hpp>
#include <orbis/slam/detail/mapping/local_adjustment.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>

namespace orbis::slam::detail {

/// Improves the map around a keyframe: removes unreliable landmarks, triangulates new ones, fuses duplicates, adjusts
/// keyframes and landmarks, and erases redundant keyframes.
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section VI.
template <camera::camera_model Camera, feature_descriptor D, place_recognizer<D> Places>
class local_mapper {
 public:
  explicit local_mapper(shared_state<Camera, D, Places>& shared) : shared_{shared}, solver_{shared.rig.model} {}

  /// Adds the keyframe to the places, and improves the map around it. Does nothing if it is gone. `hurry()` is called
  /// before each step of the adjustment: true ends it early.
  void process(map_keyframe k, const std::function<bool()>& hurry) {
    std::vector<keyframe_event> culled;
    {
      const auto edit = shared_.edit();
      if (!prepare(k)) return;
      const options& settings = shared_.settings;
      basic_map<D>& m = shared_.locked([&]() -> basic_map<D>& { return shared_.atlas.at(k.map); });
      shared_.locked([&] { cull_landmarks(m, k.keyframe, settings.culling); });
      shared_.locked([&] { triangulate_landmarks(m, k.keyframe, shared_.rig, settings.triangulation); });
      shared_.locked([&] { fuse_with_neighbors(m, k.keyframe, shared_.rig, settings.fusion); });
      adjust(m, k.keyframe, hurry);
      culled = cull(m, k);
    }
    if (const auto& callback = shared_.callbacks.keyframe_culled)
      for (const keyframe_event& e : culled) callback(e);
  }

 private:
  /// Adds the keyframe, which gets its present id, to the places. False if it is gone.
  bool prepare(map_keyframe& k) {
    const auto* frame = shared_.locked([&]() -> const basic_keyframe<D>* {
      k = shared_.atlas.current(k);
      return shared_.atlas.has(k) ? &shared_.atlas.at(k) : nullptr;
    });
    if (frame == nullptr) return false;
    const auto bow_vector = shared_.places.describe(frame->features);
    shared_.locked([&] { shared_.places.add(k, bow_vector); });
    return true;
  }
  void adjust(basic_map<D>& m, keyframe_id k, const std::function<bool()>& hurry) {
    const adjustment_options& o = shared_.settings.adjustment;
    snapshot_ = shared_.locked([&] { return local_adjustment::take(m, k, shared_.rig, o, std::move(snapshot_)); });
    if (snapshot_.empty()) return;
    const auto go_on = [&](std::size_t, std::size_t) { return !hurry(); };
    solution_ = solver_.solve(snapshot_, local_adjustment::schedule_of(o), go_on, std::move(solution_));
    shared_.locked([&] { local_adjustment::apply(m, snapshot_, solution_); });
  }
  std::vector<keyframe_event> cull(basic_map<D>& m, map_keyframe newest) {
    return shared_.locked([&] {
      // The events are made while the keyframes are there. Newer keyframes have not been mapped yet and stay.
      std::vector<keyframe_event> judged;
      const auto keep = [&](keyframe_id k) {
        if (k > newest.keyframe) return true;
        judged.push_back(shared_.event_of({newest.map, k}));
        return false;
      };
      const double close =
          shared_.rig.scale_is_known ? shared_.settings.close_depth : std::numeric_limits<double>::infinity();
      const std::vector<keyframe_id> erased = cull_keyframes(m, newest.keyframe, close, shared_.settings.culling, keep);
      std::erase_if(judged, [&](const keyframe_event& e) {
        return std::find(erased.begin(), erased.end(), e.id.keyframe) == erased.end();
      });
      for (const keyframe_event& e : judged) shared_.places.erase(e.id);
      shared_.keyframes_culled += judged.size();
      return judged;
    });
  }

  shared_state<Camera, D, Places>& shared_;
  bundle_solver<Camera> solver_;
  local_adjustment::snapshot snapshot_;  ///< its memory is used again
  bundle_solution solution_;             ///< its memory is used again
};

}  // namespace orbis::slam::detail
