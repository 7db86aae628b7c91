// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The steps of loops and adjustments in a row, for tests: the system takes them one by one, with locks in between.
#pragma once

#include <optional>

#include <orbis/camera/model.hpp>
#include <orbis/slam/detail/loops/global_adjustment.hpp>
#include <orbis/slam/detail/loops/loop_correction.hpp>
#include <orbis/slam/detail/loops/loop_fusion.hpp>
#include <orbis/slam/detail/loops/loop_verification.hpp>
#include <orbis/slam/detail/loops/map_merging.hpp>
#include <orbis/slam/detail/map/keyframe_motion.hpp>
#include <orbis/slam/detail/mapping/landmark_fusion.hpp>

namespace orbis::test {

using namespace slam::detail;

/// Whether keyframe `k` of `current` observes the place of `candidate` of `candidate_map`.
template <slam::feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] loop_check verify_loop(const slam::basic_map<D>& current, slam::keyframe_id k,
                                     const slam::basic_map<D>& candidate_map, slam::keyframe_id candidate,
                                     const slam::camera_rig<Camera>& rig, const slam::loop_options& o = {}) {
  return loop_verification::verify(loop_verification::take(current, k, candidate_map, candidate, rig, o), rig, o);
}

struct correction_report : loop_correction::report {
  fusion_counts fusion;  ///< of landmarks
};
template <slam::feature_descriptor D>
correction_report apply_correction(slam::basic_map<D>& m, const loop_correction::snapshot<D>& s,
                                   const loop_correction::solution& solved) {
  correction_report done{loop_correction::apply_poses(m, s, solved), {}};
  if (!done.corrected) return done;
  done.fusion = loop_fusion::fuse<D>(m, solved.pairs);
  update_landmarks(m, 0, m.landmark_count());
  return done;
}
/// Nothing is changed unless the report says so.
template <slam::feature_descriptor D, camera::camera_model Camera>
correction_report close_loop(slam::basic_map<D>& m, const loop_match& match, const slam::camera_rig<Camera>& rig) {
  const auto s = loop_correction::take(m, match);
  const auto solved = s ? loop_correction::solve(*s, rig) : std::nullopt;
  return solved ? apply_correction(m, *s, *solved) : correction_report{};
}

struct merging_report : map_merging::report {
  fusion_counts fusion;  ///< of landmarks
};
template <slam::feature_descriptor D, camera::camera_model Camera>
merging_report merge_maps(slam::basic_atlas<D>& maps, slam::map_id from, slam::map_id into, const loop_match& match,
                          const slam::camera_rig<Camera>& rig) {
  const auto s = map_merging::take(maps, from, into, match);
  if (!s) return {};
  const auto pairs = loop_fusion::find_pairs(s->fusion, rig, {});
  merging_report done{map_merging::join(maps, *s), {}};
  if (done.merged) done.fusion = loop_fusion::fuse<D>(maps.at(into), pairs, done.offsets);
  return done;
}

/// A whole map, to be adjusted.
template <slam::feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] global_adjustment::snapshot take_map(const slam::basic_map<D>& m, const slam::camera_rig<Camera>& rig,
                                                   const slam::global_adjustment_options& o = {}) {
  global_adjustment::snapshot s = global_adjustment::take_keyframes(m, o);
  global_adjustment::take_landmarks(s, m, rig, m.landmark_count());
  return s;
}
template <slam::feature_descriptor D>
global_adjustment::report apply_adjustment(slam::basic_map<D>& m, const global_adjustment::snapshot& s,
                                           const bundle_solution& solved) {
  global_adjustment::report done = global_adjustment::apply_poses(m, s, solved);
  done.outliers = global_adjustment::erase_outliers(m, s, solved, 0, s.observations.size());
  update_landmarks(m, 0, m.landmark_count());
  return done;
}
/// The report is empty if nothing was changed.
template <slam::feature_descriptor D, camera::camera_model Camera>
global_adjustment::report adjust_map(slam::basic_map<D>& m, const slam::camera_rig<Camera>& rig) {
  const global_adjustment::snapshot s = take_map(m, rig);
  if (s.empty()) return {};
  bundle_solver<Camera> solver{rig.model, global_adjustment::loss};
  const bundle_solution solved = solver.solve(s, global_adjustment::make_schedule({}));
  return solved.usable ? apply_adjustment(m, s, solved) : global_adjustment::report{};
}

}  // namespace orbis::test
