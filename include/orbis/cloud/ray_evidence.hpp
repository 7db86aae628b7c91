// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ray evidence: a point that other views' depth rays pass through is not there.
///
/// What a moving object, a wrong pose or a stray measurement leaves behind can be as dense and as
/// smooth as any surface; no filter that looks at the points alone sees it. The depth images do: a
/// measurement says that there is a surface where it ends, and nothing before that. The same idea
/// carves space in occupancy grids (A. Elfes, 1989) and checks multi-view stereo for violations of
/// free space (P. Merrell et al., "Real-time visibility-based fusion of depth maps", ICCV 2007).
///
/// Users of orbis::compiled who call `ray_evidence_scores` or `ray_evidence_inliers` include ray_evidence-inl.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud {

/// How many views pass through each point, and how many support it.
///
/// For a point at depth z in a view, with m = margin + margin_growth z^2, and the depths measured in
/// the window around its pixel: the view passes *through* if every pixel of the window has a depth
/// and the nearest exceeds z by more than m + slant (farthest - nearest); it *supports* the point if
/// the nearest, the farthest or the middle one is within m of z. Otherwise it says nothing. A point's
/// own view, if among `views`, supports it.
///
/// Of two surfaces that exclude each other this finds the one before the other alone, since rays end
/// at the first. So with `resolve_ghosts` every view is looked at a second time, part by part: where
/// its rays pass through what more views support than what they end at, for example since its pose is
/// wrong, it is the part of the view that does not count (`ray_evidence_counter::review`).
///
/// Points that are not finite get no counts, views with a pose that is not finite give none. The same
/// counts under every policy. If `on_progress`, which is called after each view of each round, cancels,
/// the counts are those until then.
/// O(views (pixels + points in the frustum)); 28 bytes for each point.
/// @pre views' images have the camera's size; fewer than 2^32 points
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] std::vector<ray_evidence> ray_evidence_scores(const Policy& policy, const Points& points,
                                                            const Views& views, const Camera& camera,
                                                            const ray_evidence_options& options = {},
                                                            progress on_progress = {});

/// The filter's decision, and what it is based on.
struct ray_evidence_result {
  std::vector<std::uint32_t> inliers;  ///< indices, ascending
  std::vector<ray_evidence> scores;    ///< per point
  std::size_t seen = 0;                ///< points of which some view says something
};

/// Whether a point with these counts is not there.
[[nodiscard]] constexpr bool is_passed_through(const ray_evidence& e, const ray_evidence_options& options) noexcept {
  const int against = e.through + e.refuted;
  return against >= options.min_through && against > options.ratio * e.supported;
}

/// Decides on counts that are known already. Points without any are inliers. O(n).
[[nodiscard]] ray_evidence_result ray_evidence_decision(std::vector<ray_evidence> scores,
                                                        const ray_evidence_options& options = {});

/// The indices, ascending, of the finite points that rays do not pass through: see
/// `ray_evidence_scores`, also for `on_progress`.
template <execution_policy Policy, point_range Points, posed_depth_range Views, camera::camera_model Camera>
[[nodiscard]] std::vector<std::uint32_t> ray_evidence_inliers(const Policy& policy, const Points& points,
                                                              const Views& views, const Camera& camera,
                                                              const ray_evidence_options& options = {},
                                                              progress on_progress = {});

}  // namespace orbis::cloud

#ifndef ORBIS_COMPILED
#include <orbis/cloud/ray_evidence-inl.hpp>
#endif
