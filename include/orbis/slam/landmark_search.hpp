// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finding known points again in a frame: where each should appear, and which keypoint there looks
/// like it.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// A point that a frame may show.
struct candidate_point {
  vec3 position = vec3::Zero();  ///< in the world, metres
  landmark_id landmark = no_id;  ///< or none, for a point that only the last frame's depth gave
};

/// Candidates with their descriptors and windows, index by index.
struct search_list {
  std::vector<candidate_point> points;
  std::vector<features::binary_descriptor<256>> descriptors;
  std::vector<features::keypoint> keypoints;  ///< where they were seen before; only the angle is of use
  std::vector<features::window> windows;

  void add(const candidate_point& p, const features::binary_descriptor<256>& d, const features::keypoint& k,
           const features::window& w) {
    points.push_back(p);
    descriptors.push_back(d);
    keypoints.push_back(k);
    windows.push_back(w);
  }
  [[nodiscard]] std::size_t size() const noexcept { return points.size(); }
};

/// What the pyramid of the extractor looks like.
struct pyramid_scales {
  int levels = 8;
  double factor = 1.2;
  [[nodiscard]] double scale(int octave) const { return std::pow(factor, octave); }
  /// 1 / sigma^2 of a keypoint's position, sigma being one pixel of its level.
  [[nodiscard]] double information(int octave) const { return 1.0 / (scale(octave) * scale(octave)); }
  /// The level at which a landmark should appear from a distance.
  [[nodiscard]] int predicted_octave(const landmark& l, double distance) const {
    const double octave = std::ceil(std::log(l.max_distance / distance) / std::log(factor));
    return static_cast<int>(std::clamp(octave, 0.0, levels - 1.0));
  }
};

/// A window around the projection of what the last frame saw, if it projects into the image.
template <camera::camera_model Camera>
void add_seen_point(search_list& list, const Camera& camera, const pyramid_scales& scales, const se3& T_camera_world,
                    const candidate_point& point, const features::binary_descriptor<256>& descriptor,
                    const features::keypoint& seen, double radius) {
  const auto pixel = camera.project(T_camera_world * point.position);
  if (!pixel || pixel->x() < 0.0 || pixel->y() < 0.0 || pixel->x() >= camera.width() || pixel->y() >= camera.height())
    return;
  list.add(point, descriptor, seen,
           {static_cast<float>(pixel->x()), static_cast<float>(pixel->y()),
            static_cast<float>(radius * scales.scale(seen.octave)), seen.octave - 1, seen.octave + 1});
}

/// A window around the projection of a landmark, if the frame should show it: inside the image, at
/// a distance from which its size suits the pyramid, seen from less than 60 degrees off. Returns
/// whether it should.
template <camera::camera_model Camera>
bool add_landmark(search_list& list, const Camera& camera, const pyramid_scales& scales, const se3& T_world_camera,
                  const se3& T_camera_world, const landmark& l, landmark_id id, double radius) {
  const vec3 towards = T_world_camera.translation() - l.position;
  const double distance = towards.norm();
  if (!(distance > 0.8 * l.min_distance && distance < 1.2 * l.max_distance)) return false;
  const double cosine = towards.dot(l.normal) / distance;
  if (!(cosine > 0.5)) return false;
  const auto pixel = camera.project(T_camera_world * l.position);
  if (!pixel || pixel->x() < 0.0 || pixel->y() < 0.0 || pixel->x() >= camera.width() || pixel->y() >= camera.height())
    return false;
  const int octave = scales.predicted_octave(l, distance);
  const double sideways = cosine > 0.998 ? 1.0 : 1.6;  // the pose predicts a slanted view less well
  list.add({l.position, id}, l.descriptor, {},
           {static_cast<float>(pixel->x()), static_cast<float>(pixel->y()),
            static_cast<float>(radius * sideways * scales.scale(octave)), octave - 1, octave + 1});
  return true;
}

}  // namespace orbis::slam
