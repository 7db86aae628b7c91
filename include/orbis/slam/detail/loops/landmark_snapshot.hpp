// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A copy of the landmarks around a keyframe, and the search for these landmarks in frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// The data needed to search for a landmark, except its descriptor.
struct snapshot_landmark {
  landmark_id id;
  vec3 position = zeros<vec3>();  ///< in the world frame of its map, metres
  vec3 normal = zeros<vec3>();
  double min_distance = 0.0;
  double max_distance = 0.0;
};

/// A keyframe with the landmarks that it and its neighbours observe. Independent of the map.
template <feature_descriptor D>
struct landmark_snapshot {
  keyframe_id keyframe;
  se3 T_world_camera;
  std::vector<snapshot_landmark> landmarks;  ///< in ascending order of id
  std::vector<D> descriptors;                ///< descriptor of each landmark
};

/// Copies the landmarks of a keyframe and of its `neighbors` strongest neighbours. O(their observations).
/// @pre m.has_keyframe(k)
template <feature_descriptor D>
[[nodiscard]] landmark_snapshot<D> snapshot_around(const basic_map<D>& m, keyframe_id k, std::size_t neighbors) {
  std::vector<keyframe_id> around{k};
  for (const covisible& n : m.covisibility().neighbors(k, neighbors)) around.push_back(n.keyframe);
  landmark_snapshot<D> taken{k, m.at(k).T_world_camera, {}, {}};
  for (const landmark_id id : observed_landmarks(m, around)) {
    const auto& l = m.landmark_at(id);
    taken.landmarks.push_back({id, l.position, l.normal, l.min_distance, l.max_distance});
    taken.descriptors.push_back(l.descriptor);
  }
  return taken;
}

/// Searches for landmarks in a frame at `T_world_camera`: within `radius` pixels (at the predicted pyramid level) of
/// their projections, with a descriptor distance of at most `distance`. In the matches, `query` is the index of a
/// landmark and `train` that of a keypoint; no keypoint is matched twice. O(landmarks).
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] std::vector<features::match> find_landmarks(const landmark_snapshot<D>& known, const basic_frame<D>& f,
                                                          const se3& T_world_camera, const camera_rig<Camera>& rig,
                                                          double radius, std::uint32_t distance) {
  const features::camera_projection project{rig.camera(), T_world_camera};
  const features::projection_rule rule = make_rule(rig.scales, radius);
  std::vector<features::window> windows;
  windows.reserve(known.landmarks.size());
  for (const snapshot_landmark& l : known.landmarks) {
    const auto appears = project(l);
    windows.push_back(appears ? features::search_window(*appears, rule) : features::window{});
  }
  const auto matcher = features::windowed(distance_of_t<D>{}) | features::max_distance{distance} | features::unique{};
  return matcher(known.descriptors, f.features, std::span<const features::window>(windows), f.grid);
}

}  // namespace orbis::slam::detail
