// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recognition of places that a new keyframe revisits, and the corresponding correction of the maps.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/slam/detail/loops/global_adjustment.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/loops/map_merging.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>

namespace orbis::slam::detail {

/// Closes a loop if a place in the same map is recognised; merges two maps if the place is in another map.
/// Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), sections III.D and E; R. Elvira et al.,
/// "ORBSLAM-Atlas", IROS 2019, for map merging.
template <camera::camera_model Camera, feature_descriptor D, place_recognizer<D> Places>
class loop_closer {
 public:
  explicit loop_closer(shared_state<Camera, D, Places>& shared) : shared_{shared} {}

  /// Searches for places that the keyframe revisits. Returns true if a map was corrected and should therefore be
  /// adjusted globally.
  bool close(map_keyframe k) {
    if (!shared_.settings.places.enabled) return false;
    for (map_keyframe& candidate : find_candidates(k)) {
      if (stopped_) return false;
      correction_timing timing;
      const auto taken = locked(timing, [&] { return take(k, candidate); });
      if (!taken || taken->connected) continue;
      const loop_check check = loop_verification::verify(*taken, shared_.rig, shared_.settings.places.loop);
      if (!check) continue;
      const bool closed = k.map == candidate.map ? correct(k, candidate, check.match, timing)
                                                 : merge(k, candidate, check.match, timing);
      if (closed) return true;
    }
    return false;
  }

  /// Adjusts a whole map. Stops without a result if a loop is closed in the meantime or `stop` is called.
  void adjust_globally(map_id id) {
    if (!shared_.settings.places.adjusts_globally) return;
    const global_adjustment_options& o = shared_.settings.places.adjustment;
    correction_timing timing;
    std::uint64_t before = 0;
    global_adjustment::snapshot s;
    {
      const auto edit = shared_.edit();
      before = corrections_;
      locked(timing, [&] {
        if (shared_.atlas.contains(id)) s = global_adjustment::take_keyframes(shared_.atlas.at(id), o);
      });
      while (s.has_more())
        locked(timing, [&] { global_adjustment::take_landmarks(s, shared_.atlas.at(id), shared_.rig, at_once); });
    }
    if (s.empty()) return;
    const auto go_on = [&](std::size_t, std::size_t) { return !stopped_ && corrections_ == before; };
    bundle_solver<Camera> solver{shared_.rig.model, global_adjustment::loss};
    const bundle_solution solved = solver.solve(s, global_adjustment::make_schedule(o), go_on);
    if (!solved.usable) return;
    {
      const auto edit = shared_.edit();
      if (!locked(timing, [&] {
            if (corrections_ != before || !shared_.atlas.contains(id)) return false;
            global_adjustment::apply_poses(shared_.atlas.at(id), s, solved);
            return true;
          }))
        return;
      erase_outliers(id, s, solved, timing);
      update(id, timing);
    }
    report({.kind = correction_kind::global_adjustment, .map = id}, timing);
  }

  /// Requests that interruptible work end soon. May be called from any thread.
  void stop() noexcept { stopped_ = true; }

 private:
  using clock = std::chrono::steady_clock;
  // Amount of work per acquisition of the lock, chosen so that tracking waits for about a millisecond:
  static constexpr std::uint32_t at_once = 4096;              ///< number of landmarks to copy or update
  static constexpr std::size_t pairs_at_once = 512;           ///< number of pairs to fuse
  static constexpr std::size_t observations_at_once = 65536;  ///< number of observations to check for outliers

  /// Start of a correction, and the longest time for which the lock was held.
  struct correction_timing {
    clock::time_point start = clock::now();
    double locked = 0.0;  ///< longest single time, milliseconds
  };
  /// Holds the lock and records for how long.
  struct timing_lock {
    std::unique_lock<std::mutex> held;
    correction_timing& timing;
    clock::time_point since = clock::now();
    ~timing_lock() { timing.locked = std::max(timing.locked, milliseconds_since(since)); }
  };
  [[nodiscard]] static double milliseconds_since(clock::time_point start) {
    return std::chrono::duration<double, std::milli>(clock::now() - start).count();
  }
  /// Calls `f` with the lock held, and records the duration.
  template <std::invocable F>
  decltype(auto) locked(correction_timing& timing, F&& f) const {
    const timing_lock lock{shared_.lock(), timing};
    return std::forward<F>(f)();
  }

  /// Returns the keyframes with similar appearance; updates `k` to its current id. Keyframes of the same map must share
  /// no landmark with `k` and be at least a few keyframes older.
  std::vector<map_keyframe> find_candidates(map_keyframe& k) {
    typename Places::signature bow_vector;
    {
      const auto edit = shared_.edit();  // the keyframe must not be erased in the meantime
      const auto* seen = shared_.locked([&]() -> const basic_keyframe<D>* {
        k = shared_.atlas.current(k);
        return shared_.atlas.has(k) ? &shared_.atlas.at(k) : nullptr;
      });
      if (seen == nullptr) return {};
      bow_vector = shared_.places.describe(seen->features);
    }
    return shared_.locked([&]() -> std::vector<map_keyframe> {
      if (!shared_.atlas.has(k)) return {};
      const place_options& o = shared_.settings.places;
      const basic_map<D>& m = shared_.atlas.at(k.map);
      const bool closed_lately = last_closed_.map == k.map && k.keyframe >= last_closed_.keyframe &&
                                 k.keyframe - last_closed_.keyframe < o.apart;
      const auto exclude = [&](map_keyframe other) {
        if (other.map != k.map) return false;
        if (closed_lately || other.keyframe >= k.keyframe) return true;
        return k.keyframe - other.keyframe < o.apart || m.covisibility().shared(k.keyframe, other.keyframe) != 0;
      };
      return shared_.similar(bow_vector, o.candidates, exclude);
    });
  }
  std::optional<loop_verification::snapshot<D>> take(map_keyframe& k, map_keyframe& candidate) {
    k = shared_.atlas.current(k);
    candidate = shared_.atlas.current(candidate);
    if (!shared_.atlas.has(k) || !shared_.atlas.has(candidate) || k == candidate) return std::nullopt;
    return loop_verification::take(shared_.atlas.at(k.map), k.keyframe, shared_.atlas.at(candidate.map),
                                   candidate.keyframe, shared_.rig, shared_.settings.places.loop);
  }
  bool correct(map_keyframe k, map_keyframe candidate, const loop_match& match, correction_timing timing) {
    const loop_correction_options& o = shared_.settings.places.correction;
    correction_event event{.kind = correction_kind::loop, .map = k.map, .from = k, .to = candidate};
    {
      const auto edit = shared_.edit();
      se3 before;
      const auto taken = locked(timing, [&]() -> std::optional<loop_correction::snapshot<D>> {
        if (!shared_.atlas.has(k)) return std::nullopt;
        before = shared_.atlas.at(k).T_world_camera;
        return loop_correction::take(shared_.atlas.at(k.map), match, o);
      });
      if (!taken) return false;
      const auto go_on = [&](std::size_t, std::size_t) { return !stopped_.load(); };
      const auto solved = loop_correction::solve(*taken, shared_.rig, o, go_on);
      if (!solved) return false;
      if (!locked(timing, [&] {
            basic_map<D>& m = shared_.atlas.at(k.map);
            const loop_correction::report done = loop_correction::apply_poses(m, *taken, *solved);
            if (!done.corrected) return false;
            const se3& after = m.at(k.keyframe).T_world_camera;
            event.T_corrected_before = sim3(after.rotation(), after.translation(), done.scale) * sim3(before.inverse());
            ++shared_.loops_closed;
            ++corrections_;
            return true;
          }))
        return false;
      last_closed_ = k;
      fuse(k.map, solved->pairs, {}, timing);
      update(k.map, timing);
    }
    report(std::move(event), timing);
    return true;
  }
  /// Merges the map of `k` into the candidate's map.
  bool merge(map_keyframe k, map_keyframe candidate, const loop_match& match, correction_timing timing) {
    const loop_fusion_options& o = shared_.settings.places.correction.fusion;
    correction_event event{.kind = correction_kind::merge, .map = candidate.map, .to = candidate, .merged = k.map};
    {
      const auto edit = shared_.edit();
      const auto taken =
          locked(timing, [&] { return map_merging::take(shared_.atlas, k.map, candidate.map, match, o); });
      if (!taken) return false;
      const std::vector<loop_fusion::pair> pairs = loop_fusion::find_pairs(taken->fusion, shared_.rig, o);
      const bool merged = locked(timing, [&] {
        std::vector<keyframe_id> ids;
        for (const auto& each : shared_.atlas.at(k.map).keyframes()) ids.push_back(each.id);
        const map_merging::report done = map_merging::join(shared_.atlas, *taken);
        if (!done.merged) return false;
        for (const keyframe_id id : ids)
          shared_.places.rename({k.map, id}, {candidate.map, id + done.offsets.keyframes});
        event.offsets = done.offsets;
        event.from = {candidate.map, done.keyframe};
        event.T_corrected_before = done.T_into_from;
        if (k.map < candidate.map) {  // the world frame of the older map is kept
          event.T_map_before = done.T_into_from.inverse();
          shared_.atlas.at(candidate.map).transform(event.T_map_before);
          event.T_corrected_before = sim3{};
        }
        ++shared_.maps_merged;
        ++corrections_;
        return true;
      });
      if (!merged) return false;
      last_closed_ = event.from;
      fuse(candidate.map, pairs, event.offsets, timing);
    }
    report(std::move(event), timing);
    return true;
  }

  // These functions work in parts, so that tracking waits for at most one part. @pre edit() is held, and the map exists

  /// Updates all landmarks of a map.
  void update(map_id id, correction_timing& timing) {
    landmark_id at = 0;
    const auto has_more_after_some = [&] {
      auto& m = shared_.atlas.at(id);
      at = update_landmarks(m, at, at_once);
      return at != m.landmark_end();
    };
    while (locked(timing, has_more_after_some)) {
    }
  }
  void fuse(map_id id, std::span<const loop_fusion::pair> pairs, const id_offsets& offsets, correction_timing& timing) {
    for (; !pairs.empty(); pairs = pairs.subspan(std::min(pairs_at_once, pairs.size())))
      locked(timing, [&] {
        loop_fusion::fuse<D>(shared_.atlas.at(id), pairs.first(std::min(pairs_at_once, pairs.size())), offsets);
      });
  }
  void erase_outliers(map_id id, const global_adjustment::snapshot& s, const bundle_solution& solved,
                      correction_timing& timing) {
    for (std::size_t at = 0; at < s.observations.size(); at += observations_at_once)
      locked(timing,
             [&] { global_adjustment::erase_outliers(shared_.atlas.at(id), s, solved, at, observations_at_once); });
  }

  void report(correction_event event, const correction_timing& timing) const {
    event.milliseconds = milliseconds_since(timing.start);
    event.locked_milliseconds = timing.locked;
    if (shared_.callbacks.map_corrected) shared_.callbacks.map_corrected(event);
  }

  shared_state<Camera, D, Places>& shared_;
  map_keyframe last_closed_;
  std::atomic<std::uint64_t> corrections_{0};
  std::atomic<bool> stopped_{false};
};

}  // namespace orbis::slam::detail
