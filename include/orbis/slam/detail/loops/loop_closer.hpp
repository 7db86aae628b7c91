// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recognising places, and what follows from it.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/slam/detail/loops/global_adjustment.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/loops/map_merging.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>

namespace orbis::slam::detail {

/// Looks for places that a new keyframe shows again, and makes the map agree with what is found: within a map a loop is
/// closed, and maps that meet become one.
/// Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), sections III.D and E; R. Elvira et al.,
/// "ORBSLAM-Atlas", IROS 2019, for maps that meet.
template <camera::camera_model Camera, place_recognizer Places>
class loop_closer {
 public:
  explicit loop_closer(shared_state<Camera, Places>& shared) : shared_{shared} {}

  /// Whether a place was recognised, and the map should be adjusted as a whole.
  bool close(map_keyframe k) {
    if (!shared_.settings.places.enabled) return false;
    for (map_keyframe& candidate : candidates_of(k)) {
      const auto start = clock::now();
      if (!shared_.locked([&] { return gather(k, candidate); })) continue;
      const loop_check check = verifier_.solve();
      if (!check) continue;
      const bool closed =
          k.map == candidate.map ? correct(k, candidate, check.match, start) : merge(k, candidate, check.match, start);
      if (closed) return true;
    }
    return false;
  }

  /// Adjusts a whole map; gives up where a loop is closed meanwhile, or `stop` is called.
  void adjust_globally(map_id id) {
    if (!shared_.settings.places.adjusts_globally) return;
    const auto start = clock::now();
    std::uint64_t before = 0;
    {
      const auto edit = shared_.edit();
      before = corrections_;
      bool more = shared_.locked([&] {
        return shared_.atlas.contains(id) &&
               adjustment_.gather_keyframes(shared_.atlas.at(id), shared_.model, shared_.scales,
                                            shared_.settings.places.adjustment);
      });
      if (!more) return;
      while (more) more = shared_.locked([&] { return adjustment_.gather_landmarks(shared_.atlas.at(id), at_once); });
    }
    const auto go_on = [&](std::size_t, std::size_t) { return !stopped_ && corrections_ == before; };
    if (!adjustment_.has_gathered() || !adjustment_.solve(go_on)) return;
    {
      const auto edit = shared_.edit();
      if (!shared_.locked([&] {
            if (corrections_ != before || !shared_.atlas.contains(id)) return false;
            adjustment_.move(shared_.atlas.at(id));
            return true;
          }))
        return;
      update(id);
    }
    tell({.kind = correction_kind::global_adjustment, .map = id}, start);
  }

  /// Whatever can be interrupted ends soon. May be called from any thread.
  void stop() noexcept { stopped_ = true; }

 private:
  using clock = std::chrono::steady_clock;
  static constexpr landmark_id at_once = 4096;  ///< that are looked at while tracking waits: a millisecond or so

  /// The places that keyframe `k`, which is given its present name, may show again: in its own map those alone that it
  /// is not connected with, and that it has left for a while.
  std::vector<map_keyframe> candidates_of(map_keyframe& k) {
    typename Places::signature bow_vector;
    {
      // So that the keyframe stays while it is looked at.
      const auto edit = shared_.edit();
      const keyframe* seen = shared_.locked([&]() -> const keyframe* {
        k = shared_.atlas.current(k);
        return shared_.has(k) ? &shared_.atlas.at(k.map).at(k.keyframe) : nullptr;
      });
      if (seen == nullptr) return {};
      bow_vector = shared_.places.describe(seen->features);
    }
    return shared_.locked([&]() -> std::vector<map_keyframe> {
      if (!shared_.has(k)) return {};
      const slam::map& m = shared_.atlas.at(k.map);
      const bool closed_lately = last_closed_.map == k.map && k.keyframe >= last_closed_.keyframe &&
                                 k.keyframe - last_closed_.keyframe < shared_.settings.places.apart;
      const auto exclude = [&](map_keyframe other) {
        if (other.map != k.map) return false;
        if (closed_lately || other.keyframe >= k.keyframe) return true;
        return k.keyframe - other.keyframe < shared_.settings.places.apart ||
               m.covisibility().shared(k.keyframe, other.keyframe) != 0;
      };
      return shared_.similar(bow_vector, shared_.settings.places.candidates, exclude);
    });
  }

  bool gather(map_keyframe& k, map_keyframe& candidate) {
    k = shared_.atlas.current(k);
    candidate = shared_.atlas.current(candidate);
    return shared_.has(k) && shared_.has(candidate) && !(k == candidate) &&
           verifier_.gather(shared_.atlas.at(k.map), k.keyframe, shared_.atlas.at(candidate.map), candidate.keyframe,
                            shared_.model, shared_.scales, shared_.settings.places.loop);
  }

  bool correct(map_keyframe k, map_keyframe candidate, const loop_match& match, clock::time_point start) {
    correction_event event{.kind = correction_kind::loop, .map = k.map, .from = k, .to = candidate};
    {
      const auto edit = shared_.edit();
      se3 before;
      if (!shared_.locked([&] {
            if (!shared_.has(k)) return false;
            before = shared_.atlas.at(k.map).at(k.keyframe).T_world_camera;
            return correction_.gather(shared_.atlas.at(k.map), match, shared_.model, shared_.scales,
                                      shared_.settings.places.correction);
          }))
        return false;
      if (!correction_.solve([&](std::size_t, std::size_t) { return !stopped_.load(); })) return false;
      if (!shared_.locked([&] {
            slam::map& m = shared_.atlas.at(k.map);
            if (!correction_.move(m).corrected) return false;
            event.T_corrected_before = m.at(k.keyframe).T_world_camera * before.inverse();
            ++shared_.loops_closed;
            ++corrections_;
            return true;
          }))
        return false;
      last_closed_ = k;
      update(k.map);
    }
    tell(std::move(event), start);
    return true;
  }

  /// The map of keyframe `k` becomes a part of the candidate's.
  bool merge(map_keyframe k, map_keyframe candidate, const loop_match& match, clock::time_point start) {
    correction_event event{.kind = correction_kind::merge, .map = candidate.map, .to = candidate, .merged = k.map};
    {
      const auto edit = shared_.edit();
      if (!shared_.locked([&] {
            return merging_.gather(shared_.atlas, k.map, candidate.map, match, shared_.model, shared_.scales,
                                   shared_.settings.places.correction.fusion);
          }))
        return false;
      merging_.solve();
      const auto lock = shared_.lock();
      std::vector<keyframe_id> names;
      for (const keyframe& each : shared_.atlas.at(k.map).keyframes()) names.push_back(each.id);
      const merge_report report = merging_.apply(shared_.atlas);
      if (!report.merged) return false;
      for (const keyframe_id name : names)
        shared_.places.rename({k.map, name}, {candidate.map, name + report.offsets.keyframes});
      event.offsets = report.offsets;
      event.from = {candidate.map, report.keyframe};
      event.T_corrected_before = report.T_into_from;
      if (k.map < candidate.map) {  // the world stays that of the older map
        shared_.atlas.at(candidate.map).transform(report.T_into_from.inverse());
        event.T_corrected_before = se3{};
      }
      ++shared_.maps_merged;
      ++corrections_;
      last_closed_ = event.from;
    }
    tell(std::move(event), start);
    return true;
  }

  /// What follows from where keyframes and landmarks are, part by part, so that tracking need not wait for all of it.
  /// @pre edit() is held, and the map is there
  void update(map_id id) {
    for (landmark_id at = 0; shared_.locked([&] { return update_landmarks(shared_.atlas.at(id), at, at_once); });)
      at += at_once;
  }

  void tell(correction_event event, clock::time_point start) const {
    event.milliseconds = std::chrono::duration<double, std::milli>(clock::now() - start).count();
    if (shared_.listening.map_corrected) shared_.listening.map_corrected(event);
  }

  shared_state<Camera, Places>& shared_;
  loop_verifier<Camera> verifier_;
  loop_correction<Camera> correction_;
  map_merging<Camera> merging_;
  global_adjustment<Camera> adjustment_;  // in its own thread, if there are any
  map_keyframe last_closed_;
  std::atomic<std::uint64_t> corrections_{0};
  std::atomic<bool> stopped_{false};
};

}  // namespace orbis::slam::detail
