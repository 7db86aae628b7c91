// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ray evidence: removal of points that depth rays of other views pass through.
///
/// Points left by a moving object, a wrong pose or a stray measurement can be as dense and as smooth as any surface; a
/// filter that uses only the points cannot detect them. Depth images can: a measurement indicates a surface at the end
/// of its ray and free space before it. The same idea is used to carve free space in occupancy grids (A. Elfes, 1989)
/// and to check multi-view stereo for free-space violations (P. Merrell et al., "Real-time visibility-based fusion of
/// depth maps", ICCV 2007).
///
/// Users of orbis::compiled that call `ray_evidence_scores` or `ray_evidence_inliers` must include
/// ray_evidence-inl.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/inline.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// Counts for each point the views whose rays pass through it and the views that support it.
///
/// Let a point be at depth z in a view, m = margin + margin_growth z^2, and consider the depths in the window around
/// its pixel. The view passes *through* the point if every pixel of the window has a depth and the nearest exceeds z by
/// more than m + slant (farthest - nearest). It *supports* the point if the nearest, the farthest or the middle depth
/// is within m of z. Otherwise it provides no evidence. The view that measured the point, if among `views`, supports
/// it.
///
/// Since rays end at the first surface, this detects only the front one of two mutually exclusive surfaces. With
/// `resolve_ghosts` every view is therefore read a second time, part by part: if the rays of a part pass through points
/// with more support than the points at which they end, for example because the pose of the view is wrong, that part
/// does not count (`ray_evidence_counter::review`).
///
/// Non-finite points get no counts; views with a non-finite pose contribute none. The counts are the same under every
/// policy. `on_progress` is called after each view of each round; if it cancels, the counts so far are returned.
/// O(views (pixels + points in the frustum)). Memory: 28 bytes per point.
/// @pre views' images have the camera's size; fewer than 2^32 points
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] std::vector<ray_evidence> ray_evidence_scores(const Policy& policy, const Points& points,
                                                            const Views& views, const Camera& camera,
                                                            const ray_evidence_options& options = {},
                                                            progress on_progress = {});

/// Decision of the filter, and the counts on which it is based.
struct ray_evidence_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<ray_evidence> scores;    ///< counts for each point
  std::size_t seen = 0;                ///< number of points with evidence from at least one view
};

/// Returns true if enough views pass through the point for it to be an outlier.
[[nodiscard]] constexpr bool is_passed_through(const ray_evidence& e, const ray_evidence_options& options) noexcept {
  const int against = e.through + e.refuted;
  return against >= options.min_through && against > options.ratio * e.supported;
}

/// Classifies points by known counts. Points without counts are inliers. O(n).
ORBIS_LAZY [[nodiscard]] ray_evidence_result ray_evidence_decision(std::vector<ray_evidence> scores,
                                                                   const ray_evidence_options& options = {});

/// Returns the indices, ascending, of the finite points that rays do not pass through. See `ray_evidence_scores`, which
/// also describes `on_progress`.
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] std::vector<std::uint32_t> ray_evidence_inliers(const Policy& policy, const Points& points,
                                                              const Views& views, const Camera& camera,
                                                              const ray_evidence_options& options = {},
                                                              progress on_progress = {});

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/ray_evidence-inl.hpp>
#endif
