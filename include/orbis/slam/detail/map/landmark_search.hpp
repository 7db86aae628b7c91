// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Lists of known points to search for in a frame: their descriptors, and the windows around their projections.
#pragma once

#include <cstddef>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/slam/landmark.hpp>
#include <orbis/slam/pyramid_scales.hpp>

namespace orbis::slam::detail {

/// A point to search for.
struct candidate_point {
  vec3 position = zeros<vec3>();  ///< in the world frame, metres
  landmark_id landmark;           ///< `no_id` for a point known only from the depth of the last frame
};

/// Points with their descriptors and search windows, as parallel arrays.
template <feature_descriptor D>
struct search_list {
  std::vector<candidate_point> points;
  std::vector<D> descriptors;
  std::vector<features::keypoint> keypoints;  ///< earlier keypoints of the points, if known; only the angle is used
  std::vector<features::window> windows;

  void add(const candidate_point& p, const D& d, const features::keypoint& k, const features::window& w) {
    points.push_back(p);
    descriptors.push_back(d);
    keypoints.push_back(k);
    windows.push_back(w);
  }
  void reserve(std::size_t n) {
    points.reserve(n);
    descriptors.reserve(n);
    keypoints.reserve(n);
    windows.reserve(n);
  }
  [[nodiscard]] std::size_t size() const noexcept { return points.size(); }
};

/// Returns the rule for search windows with a radius of `radius` pixels, measured at the keypoint's pyramid level.
[[nodiscard]] inline features::projection_rule make_rule(const pyramid_scales& scales, double radius) {
  return {.radius = static_cast<float>(radius),
          .levels = scales.levels(),
          .scale_factor = static_cast<float>(scales.factor())};
}

/// Adds a point observed by the last frame if it projects into the image. The window has a radius of `radius` pixels,
/// measured at the pyramid level of that observation.
template <camera::camera_model Camera, feature_descriptor D>
void add_seen_point(search_list<D>& list, const features::camera_projection<Camera>& project,
                    const pyramid_scales& scales, const candidate_point& point, const D& descriptor,
                    const features::keypoint& seen, double radius) {
  if (const auto at = project(point.position))
    list.add(point, descriptor, seen,
             {at->x, at->y, static_cast<float>(radius * scales.scale(seen.octave)), seen.octave - 1, seen.octave + 1});
}

/// Adds a landmark if the frame is expected to observe it: it projects into the image, and `rule` accepts its distance
/// and direction. Returns true if it was added.
template <camera::camera_model Camera, feature_descriptor D>
bool add_landmark(search_list<D>& list, const features::camera_projection<Camera>& project,
                  const features::projection_rule& rule, const basic_landmark<D>& l, landmark_id id) {
  const auto appears = project(l);
  if (!appears) return false;
  const features::window where = features::search_window(*appears, rule);
  if (where.radius < 0.0F) return false;
  list.add({l.position, id}, l.descriptor, {}, where);
  return true;
}

}  // namespace orbis::slam::detail
