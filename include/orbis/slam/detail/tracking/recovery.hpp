// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Recovery of a frame that cannot be localised by landmarks: by depth, by appearance, or by a search around the last
/// pose.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/se3.hpp>
#include <orbis/slam/detail/depth/alignment.hpp>
#include <orbis/slam/detail/depth/depth_tracker.hpp>
#include <orbis/slam/detail/tracking/frame_refinement.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/measure.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam::detail {

/// Localises frames when tracking is weak or lost. `Context` is a `tracking_context`. Unless stated otherwise, the
/// functions set the state and return the number of landmarks that agree with the pose, 0 on failure.
template <class Context>
class recovery {
  using frame_type = typename Context::frame_type;
  using task = typename Context::task;

 public:
  recovery(Context& context, frame_refinement<Context>& refinement) : c_{context}, refinement_{refinement} {}

  /// Aligns the depth of a frame, whose pose is near that of the last frame, with the surfaces of keyframes. Empty on
  /// failure.
  [[nodiscard]] std::optional<depth_alignment> align_depth(const task& t) {
    constexpr double longest = 2.0;  // seconds
    const double interval = t.frame.timestamp - c_.last.timestamp;
    if (!c_.settings.depth_term.recovers || !(interval > 0.0 && interval < longest) ||
        c_.last_map(t.maps) != t.maps.active_id())
      return std::nullopt;
    const se3 predicted = c_.predict(t.frame);
    if (!c_.depth.find_surfaces(t.maps, predicted)) return std::nullopt;
    return c_.depth.align(search_starts(c_.last.T_world_camera, predicted, interval), t.frame.shutter);
  }
  /// Tracks starting from a pose aligned by depth, and refines the pose on the local map.
  std::size_t track_from_depth(const task& t, const depth_alignment& aligned) {
    frame_type& f = t.frame;
    f.T_world_camera = aligned.at.T_world_camera;
    c_.moving.clear();
    refinement_.correct_rows(t);
    if (c_.search.by_motion(f, t.map(), c_.last, aligned.at.T_world_camera, c_.moving) == 0)
      f.T_world_camera = aligned.at.T_world_camera;
    const std::size_t inliers = refinement_.match_local_map(t, 3.0 * c_.settings.search_radius);
    const std::size_t few =
        c_.settings.depth_term.min_inliers * static_cast<std::size_t>(std::max(1, 6 - aligned.determined));
    const std::size_t needed =
        c_.is_tracking() ? std::min(few, c_.settings.min_inliers) : c_.settings.recovery.min_inliers;
    if (inliers < needed) return 0;
    refinement_.refine_motion(t, true);
    if (inliers < c_.settings.min_inliers) {
      const std::size_t confirmed = refinement_.drop_disagreeing(t);
      if (confirmed < few || !c_.depth.has_surfaces() ||
          !c_.depth.supports_pose(c_.depth.agreement({f.T_world_camera, f.twist}, f.shutter)))
        return 0;
      f.held_by_depth = true;
    }
    c_.state = c_.is_tracking() ? track_state::tracking : track_state::relocalized;
    return inliers;
  }
  /// Sets the pose from depth alone. Returns false if the alignment is uncertain or does not constrain all directions
  /// of the pose.
  bool localize_by_depth(const task& t, const depth_alignment& aligned) {
    if (!c_.depth.determines_pose(aligned)) return false;
    frame_type& f = t.frame;
    f.T_world_camera = aligned.at.T_world_camera;
    f.landmarks.assign(f.size(), no_id);
    f.spreads.clear();
    refinement_.move_keypoints(f);
    c_.state = track_state::tracking;
    f.held_by_depth = true;
    return true;
  }
  /// Checks a frame tracked by `inliers` landmarks against its depth. If the depth disagrees with the pose but agrees
  /// with a different one, tracks from that pose; returns 0 if only depth determines the pose.
  std::size_t recheck_with_depth(const task& t, std::size_t inliers) {
    frame_type& f = t.frame;
    const depth_term_options& by_depth = c_.settings.depth_term;
    // A moving object in view would cause the disagreement.
    if (!by_depth.recovers || c_.moving.size() != 0 || !c_.depth.has_surfaces()) return inliers;
    const association seen = c_.depth.agreement({f.T_world_camera, f.twist}, f.shutter);
    if (seen.visible < by_depth.min_points || seen.share() >= by_depth.min_share) return inliers;
    const auto aligned = align_depth(t);
    constexpr double better = 0.15;
    if (!aligned || aligned->seen.share() < seen.share() + better) return inliers;
    before_ = f;
    const auto quadratic_before = c_.depth_quadratic;
    if (const std::size_t there = track_from_depth(t, *aligned); there > 0) return there;
    if (localize_by_depth(t, *aligned)) return 0;
    std::swap(f, before_);
    c_.depth_quadratic = quadratic_before;
    return inliers;
  }

  /// Relocalises a frame from the reference keyframe and keyframes with similar appearance in any map.
  std::size_t relocalize(const task& t) {
    c_.moving.clear();
    std::vector<map_keyframe> candidates = t.find_similar(t.frame.features, c_.settings.recovery.candidates);
    const map_keyframe reference_before = c_.reference;
    if (reference_before.map == t.maps.active_id() && t.map().has_keyframe(reference_before.keyframe) &&
        std::find(candidates.begin(), candidates.end(), reference_before) == candidates.end())
      candidates.insert(candidates.begin(), reference_before);
    const map_id active_before = t.maps.active_id();
    for (const map_keyframe& k : candidates) {
      if (c_.search.by_appearance(t.frame, t.maps.at(k.map), k.keyframe) == 0) continue;
      t.maps.activate(k.map);
      c_.reference = k;
      if (const std::size_t inliers = track_found(t); inliers > 0) return inliers;
    }
    t.maps.activate(active_before);
    c_.reference = reference_before;
    return 0;
  }
  /// Searches around the pose of the last tracked frame, in case the camera has turned; requires a frame with enough
  /// points to start a map.
  std::size_t search_in_place(const task& t) {
    const bool is_here = c_.last.size() != 0 && c_.reference.map == t.maps.active_id() && t.maps.has(c_.reference);
    const bool is_recent = t.frame.timestamp - c_.last.timestamp < c_.settings.recovery.new_map_after;
    if (!is_here || (t.is_frozen && !is_recent) || start_points(t.frame, c_.settings) == 0) return 0;
    return c_.search.by_turning(t.frame, t.map(), c_.last) == 0 ? 0 : track_found(t);
  }

 private:
  /// Refines the pose that a search has found, using the local map around the reference in the active map.
  std::size_t track_found(const task& t) {
    const std::size_t inliers = refinement_.match_local_map(t, 3.0 * c_.settings.search_radius);
    if (inliers < c_.settings.recovery.min_inliers) return 0;
    refinement_.refine_motion(t, false);
    c_.state = track_state::relocalized;
    return inliers;
  }

  Context& c_;
  frame_refinement<Context>& refinement_;
  frame_type before_;  ///< reused working memory
};

}  // namespace orbis::slam::detail
