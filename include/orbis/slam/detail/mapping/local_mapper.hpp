// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Local mapping: the processing of each new keyframe.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>
#include <orbis/slam/detail/mapping/landmark_triangulation.hpp>
#include <orbis/slam/detail/mapping/local_adjustment.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Returns the number of observations of a landmark; those with depth count twice. O(observations).
template <feature_descriptor D>
[[nodiscard]] std::uint32_t support(const basic_map<D>& m, const basic_landmark<D>& l) {
  std::uint32_t sum = 0;
  for (const observation& o : l.observations) sum += m.at(o.keyframe).has_depth(o.feature) ? 2 : 1;
  return sum;
}

/// Returns true if a landmark is unreliable at the time of keyframe `newest`: rarely found where it is expected, or
/// with too few observations (`support`) for its age. Always false for landmarks of the newest keyframe. Source:
/// R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section VI.B.
template <feature_descriptor D>
[[nodiscard]] bool is_unreliable(const basic_map<D>& m, const basic_landmark<D>& l, keyframe_id newest,
                                 const culling_options& o) {
  if (l.created >= newest) return false;
  if (l.visible >= o.min_visible && static_cast<double>(l.found) < o.found_ratio * static_cast<double>(l.visible))
    return true;
  const std::uint32_t age = newest - l.created;
  if (age >= o.age && o.least_support != 0 && support(m, l) < o.least_support) return true;
  return age >= o.age && age <= o.age + 1 && support(m, l) < o.min_support;
}

/// Removes the unreliable landmarks among those observed by the latest keyframes and the neighbours of the newest one.
/// Call after each keyframe. Returns the number of removed landmarks. O(observations of these keyframes).
template <feature_descriptor D>
std::size_t cull_landmarks(basic_map<D>& m, keyframe_id newest, const culling_options& o) {
  std::vector<keyframe_id> around;
  for (keyframe_id k = newest - std::min(newest, keyframe_id{o.age + 1}).value(); k <= newest; ++k)
    if (m.has_keyframe(k)) around.push_back(k);
  for (const covisible& n : m.covisibility().neighbors(newest, o.neighborhood))
    if (n.keyframe + (o.age + 1) < newest) around.push_back(n.keyframe);
  std::size_t removed = 0;
  for (const landmark_id l : observed_landmarks(m, around)) {
    if (!is_unreliable(m, m.landmark_at(l), newest, o)) continue;
    m.remove_landmark(l);
    ++removed;
  }
  return removed;
}

/// Returns true if enough of a keyframe's close landmarks are observed by enough other keyframes, at about the same or
/// a finer pyramid level. A landmark is close up to a depth of `close_depth` (metres; infinite if no depth is measured,
/// so that all landmarks count). False for a keyframe without close landmarks. O(observations of its landmarks).
/// Source: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.C, after ORB-SLAM (2015), VI.E.
template <feature_descriptor D>
[[nodiscard]] bool is_redundant(const basic_map<D>& m, keyframe_id id, double close_depth, const culling_options& o) {
  const auto& k = m.at(id);
  const bool needs_depth = std::isfinite(close_depth);
  std::size_t close = 0, seen_by_others = 0;
  for (std::uint32_t i = 0; i < k.size(); ++i) {
    if (k.landmarks[i] == no_id) continue;
    if (needs_depth && (!k.has_depth(i) || static_cast<double>(k.depth[i]) > close_depth)) continue;
    ++close;
    const int coarsest = k.features.keypoints[i].octave + o.coarser_levels;
    std::size_t others = 0;
    for (const observation& seen : m.landmark_at(k.landmarks[i]).observations)
      others += seen.keyframe != id && m.at(seen.keyframe).features.keypoints[seen.feature].octave <= coarsest;
    seen_by_others += others >= o.redundant_observers;
  }
  return close != 0 && static_cast<double>(seen_by_others) >= o.redundant * static_cast<double>(close);
}

/// Erases the redundant neighbours of keyframe `newest`, the strongest first; each is tested after the previous ones
/// have been erased. Keeps the root and the keyframes for which `keep(id)` is true. Keyframes with loop edges are
/// erased like others, and their edges are moved to the replacement. (ORB-SLAM keeps these keyframes, but a map that
/// closes loops for days would then grow by two keyframes per loop.) Returns the erased keyframes.
template <feature_descriptor D, std::predicate<keyframe_id> Keep>
std::vector<keyframe_id> cull_keyframes(basic_map<D>& m, keyframe_id newest, double close_depth,
                                        const culling_options& o, Keep&& keep) {
  std::vector<keyframe_id> erased;
  for (const covisible& n : m.covisibility().neighbors(newest, o.neighborhood)) {
    const keyframe_id k = n.keyframe;
    if (k == m.tree().root() || keep(k)) continue;
    if (!is_redundant(m, k, close_depth, o)) continue;
    m.erase_keyframe(k);
    erased.push_back(k);
  }
  return erased;
}

/// Improves the map around a keyframe: removes unreliable landmarks, triangulates new ones, fuses duplicates, adjusts
/// keyframes and landmarks, and erases redundant keyframes.
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), section VI.
template <camera::camera_model Camera, feature_descriptor D, place_recognizer<D> Places>
class local_mapper {
 public:
  explicit local_mapper(shared_state<Camera, D, Places>& shared) : shared_{shared}, solver_{shared.rig.model} {}

  /// Adds the keyframe to place recognition, and improves the map around it. Does nothing if the keyframe no longer
  /// exists. Calls `stop_requested()` before each step of the adjustment, which ends early if the result is true.
  void process(map_keyframe k, const std::function<bool()>& stop_requested) {
    std::vector<keyframe_event> culled;
    {
      const auto edit = shared_.edit();
      if (!prepare(k)) return;
      const options& settings = shared_.settings;
      basic_map<D>& m = shared_.locked([&]() -> basic_map<D>& { return shared_.atlas.at(k.map); });
      shared_.locked([&] { cull_landmarks(m, k.keyframe, settings.culling); });
      shared_.locked([&] { triangulate_landmarks(m, k.keyframe, shared_.rig, settings.triangulation); });
      shared_.locked([&] { fuse_with_neighbors(m, k.keyframe, shared_.rig, settings.fusion); });
      adjust(m, k.keyframe, stop_requested);
      culled = cull(m, k);
    }
    if (const auto& callback = shared_.callbacks.keyframe_culled)
      for (const keyframe_event& e : culled) callback(e);
  }

 private:
  /// Updates `k` to its current id and adds it to place recognition. Returns false if it no longer exists.
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
  void adjust(basic_map<D>& m, keyframe_id k, const std::function<bool()>& stop_requested) {
    const adjustment_options& o = shared_.settings.adjustment;
    snapshot_ = shared_.locked([&] { return local_adjustment::take(m, k, shared_.rig, o, std::move(snapshot_)); });
    if (snapshot_.empty()) return;
    const auto go_on = [&](std::size_t, std::size_t) { return !stop_requested(); };
    solution_ = solver_.solve(snapshot_, local_adjustment::make_schedule(o), go_on, std::move(solution_));
    shared_.locked([&] { local_adjustment::apply(m, snapshot_, solution_); });
  }
  std::vector<keyframe_event> cull(basic_map<D>& m, map_keyframe newest) {
    return shared_.locked([&] {
      // Create the events while the keyframes exist. Newer keyframes have not been mapped yet and are kept.
      std::vector<keyframe_event> judged;
      const auto keep = [&](keyframe_id k) {
        if (k > newest.keyframe) return true;
        judged.push_back(shared_.make_event({newest.map, k}));
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
  local_adjustment::snapshot snapshot_;  ///< reused memory
  bundle_solution solution_;             ///< reused memory
};

}  // namespace orbis::slam::detail
