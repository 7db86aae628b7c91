// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Projected source: searches for known points near their projections into the image.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <limits>
#include <optional>
#include <ranges>
#include <vector>

#include <orbis/features/grid.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/windowed.hpp>

namespace orbis::features {

/// Predicted position and appearance of a known point in an image.
struct projection {
  float x = 0.0F, y = 0.0F;   ///< pixels
  float distance = 1.0F;      ///< distance from the camera, metres
  float cosine = 1.0F;        ///< cosine of the angle between the line of sight and the earlier viewing direction
  float min_distance = 0.0F;  ///< minimum distance at which the descriptor is detectable, metres
  float max_distance = std::numeric_limits<float>::infinity();  ///< maximum distance (seen at the finest level), metres
};

/// Search radius around a projection, and pyramid levels to search.
struct projection_rule {
  float radius = 4.0F;            ///< radius of the window for points predicted at the finest level, pixels
  float slanted = 1.6F;           ///< factor applied to the radius if the viewing direction has changed
  float frontal_cosine = 0.998F;  ///< the viewing direction counts as changed if the cosine is below this
  float min_cosine = 0.5F;        ///< points with a smaller cosine are not searched for; -1: no limit
  float range_tolerance = 0.2F;   ///< fraction by which the distance may exceed the point's range at either end
  int levels = 8;                 ///< number of levels of the extractor's pyramid
  float scale_factor = 1.2F;      ///< ratio of the image sizes of successive levels
  int finer = 1, coarser = 1;     ///< number of levels to search on either side of the predicted one
};

/// The predicted pyramid level of a point that appears at the finest level at `max_distance`: log(max_distance /
/// distance) / log(scale_factor), rounded up, which gives better tracking on real recordings than rounding to the
/// nearest level.
[[nodiscard]] inline int predicted_octave(float distance, float max_distance, int levels, float scale_factor) noexcept {
  assert(levels > 0 && scale_factor > 1.0F);
  const double octave = std::ceil(std::log(static_cast<double>(max_distance) / static_cast<double>(distance)) /
                                  std::log(static_cast<double>(scale_factor)));
  return static_cast<int>(std::clamp(octave, 0.0, static_cast<double>(levels - 1)));
}

/// The search window of a point; its radius is negative if the point should not be visible: outside its range of
/// distances, viewed from too different a direction, or with non-finite values. The radius grows with the predicted
/// level. A point with unknown range (`max_distance` infinite) is searched for at all levels.
[[nodiscard]] inline window search_window(const projection& p, const projection_rule& rule) noexcept {
  const float most = p.max_distance * (1.0F + rule.range_tolerance);
  const float least = p.min_distance * (1.0F - rule.range_tolerance);
  if (!std::isfinite(p.x) || !std::isfinite(p.y) || !(p.distance > 0.0F && p.distance >= least && p.distance <= most) ||
      !std::isfinite(p.distance) || !(p.cosine >= rule.min_cosine))
    return {};
  const float radius = rule.radius * (p.cosine < rule.frontal_cosine ? rule.slanted : 1.0F);
  if (std::isinf(p.max_distance)) return {p.x, p.y, radius, 0, rule.levels - 1};
  const int octave = predicted_octave(p.distance, p.max_distance, rule.levels, rule.scale_factor);
  return {p.x, p.y, radius * std::pow(rule.scale_factor, static_cast<float>(octave)), std::max(0, octave - rule.finer),
          std::min(rule.levels - 1, octave + rule.coarser)};
}
[[deprecated("use search_window")]] [[nodiscard]] inline window window_of(const projection& p,
                                                                          const projection_rule& rule) noexcept {
  return search_window(p, rule);
}

/// Predicts the projection of a point; empty if it is not visible. See `project_points.hpp` for an implementation with
/// a camera and its pose.
template <class F, class Points>
concept projects = std::ranges::random_access_range<const Points> && std::ranges::sized_range<const Points> &&
    requires(const F& project, std::ranges::range_reference_t<const Points> point) {
  { project(point) } -> std::convertible_to<std::optional<projection>>;
};

namespace detail {
template <class Points, class Project>
void predict_windows(std::vector<window>& windows, const Points& points, const Project& project,
                     const projection_rule& rule) {
  windows.clear();
  windows.reserve(std::ranges::size(points));
  for (auto&& point : points) {
    const std::optional<projection> p = project(point);
    windows.push_back(p ? search_window(*p, rule) : window{});
  }
}
}  // namespace detail

/// Finds, for each query (the descriptor of a known point), the nearest and second-nearest train descriptors near the
/// point's projection. Created by `projected(distance, rule)`; a chain that begins with this source is called with the
/// points (one per query), the projection function, and optionally a grid of the train keypoints:
///
/// @code
///   constexpr auto matcher = projected(hamming{}, {.radius = 3.0F}) | max_distance{100} | unique{};
///   std::vector<match> found = matcher(descriptors, frame, landmarks, camera_projection{camera, T_world_camera});
/// @endcode
///
/// Source of the rules: Mur-Artal, Montiel, Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// IEEE T-RO 2015, section V.D.
template <class Distance>
struct projected_source {
  using match_source_tag = void;
  Distance distance{};
  projection_rule rule{};

  struct workspace {
    std::vector<window> windows;
    typename windowed_source<Distance>::workspace search;
  };

  /// Finds one candidate for each query with a train keypoint in its window.
  /// @pre one point per query; one keypoint per train descriptor; `grid` was built from these keypoints
  template <class Descriptor, class Points, class Project>
  requires descriptor_distance<Distance, Descriptor> && projects<Project, Points>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs, const Points& points, const Project& project,
              const keypoint_grid& grid) const {
    detail::predict_windows(memory.windows, points, project, rule);
    windowed(distance).search(candidates, memory.search, queries, trains, needs, memory.windows, grid);
  }

  /// Finds one candidate for each query with a train keypoint in its window; builds the grid in its workspace.
  template <class Descriptor, class Points, class Project>
  requires descriptor_distance<Distance, Descriptor> && projects<Project, Points>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs, const Points& points,
              const Project& project) const {
    detail::predict_windows(memory.windows, points, project, rule);
    windowed(distance).search(candidates, memory.search, queries, trains, needs, memory.windows);
  }
};

/// Creates a projected source: `projected(hamming{})`.
template <class Distance>
[[nodiscard]] constexpr projected_source<Distance> projected(Distance distance, projection_rule rule = {}) {
  return {distance, rule};
}

}  // namespace orbis::features
