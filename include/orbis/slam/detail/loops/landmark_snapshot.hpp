// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The landmarks around a keyframe, copied out of the map, and looking for them in other keyframes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// What it takes to find a landmark in an image.
struct snapshot_landmark {
  landmark_id id = no_id;
  vec3 position = vec3::Zero();  ///< in the world of its map, metres
  vec3 normal = vec3::Zero();
  double min_distance = 0.0;
  double max_distance = 0.0;
};

/// A keyframe with the landmarks that it and its neighbours see. Nothing of it refers to the map any more.
struct landmark_snapshot {
  keyframe_id keyframe = no_id;
  se3 T_world_camera;
  std::vector<snapshot_landmark> landmarks;                   ///< by ascending number
  std::vector<features::binary_descriptor<256>> descriptors;  ///< one for each
};

/// The place around a keyframe and its `neighbors` strongest neighbours. O(landmarks seen). @pre m.has_keyframe(k)
[[nodiscard]] inline landmark_snapshot snapshot_around(const map& m, keyframe_id k, std::size_t neighbors) {
  std::vector<keyframe_id> around{k};
  for (const covisible& n : m.covisibility().neighbors(k, neighbors)) around.push_back(n.keyframe);
  landmark_snapshot place{k, m.at(k).T_world_camera, {}, {}};
  for (const landmark_id id : landmarks_of(m, around)) {
    const landmark& l = m.landmark_at(id);
    place.landmarks.push_back({id, l.position, l.normal, l.min_distance, l.max_distance});
    place.descriptors.push_back(l.descriptor);
  }
  return place;
}

/// Looks for the landmarks of a place in a frame whose pose in the world of these is `T_world_camera`: within `radius`
/// pixels (of the predicted level) of where they project, unlike by at most `distance` bits. The matches' queries index
/// the landmarks, their trains the keypoints; no keypoint is matched twice. O(landmarks).
template <camera::camera_model Camera>
[[nodiscard]] std::vector<features::match> find_landmarks(const landmark_snapshot& place, const frame& f,
                                                          const se3& T_world_camera, const Camera& camera,
                                                          const pyramid_scales& scales, double radius,
                                                          std::uint32_t distance) {
  const features::camera_projection project{camera, T_world_camera};
  const features::projection_rule rule = rule_of(scales, radius);
  std::vector<features::window> windows;
  windows.reserve(place.landmarks.size());
  for (const snapshot_landmark& l : place.landmarks) {
    const auto appears = project(l);
    windows.push_back(appears ? features::window_of(*appears, rule) : features::window{});
  }
  const auto matcher = features::windowed(features::hamming{}) | features::max_distance{distance} | features::unique{};
  return matcher(place.descriptors, f.features, std::span<const features::window>(windows), f.grid);
}

}  // namespace orbis::slam::detail
