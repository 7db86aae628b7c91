// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Triangulation of new landmarks from matching keypoints of two keyframes, for points without depth.
///
/// Sources: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section VI.C; R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), section III.A, for the
/// choice between depth and parallax.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/epipolar_geometry.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/optimize/triangulation.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/covisibility_graph.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// The keypoints of a keyframe that observe no landmark.
template <feature_descriptor D>
struct free_keypoints {
  orbis::features::basic_features<D> features;
  std::vector<vec3> rays;
  std::vector<std::uint32_t> index;  ///< index of each keypoint in the keyframe

  void assign(const basic_keyframe<D>& k) {
    features.keypoints.clear();
    features.descriptors.clear();
    rays.clear();
    index.clear();
    for (std::uint32_t i = 0; i != k.size(); ++i) {
      if (k.landmarks[i] != no_id) continue;
      features.keypoints.push_back(k.features.keypoints[i]);
      features.descriptors.push_back(k.features.descriptors[i]);
      rays.push_back(k.rays[i]);
      index.push_back(i);
    }
  }
};

/// Two keyframes whose keypoints are triangulated.
template <camera::camera_model Camera, feature_descriptor D>
struct view_pair {
  const camera_rig<Camera>& rig;
  const triangulation_options& options;
  const basic_keyframe<D>& a;
  const basic_keyframe<D>& b;
  double focal;
  se3 T_a_world = a.T_world_camera.inverse(), T_b_world = b.T_world_camera.inverse();

  /// Returns the point (world, metres) that keypoint `i` of `a` and keypoint `j` of `b` observe; empty unless it passes
  /// all checks.
  [[nodiscard]] std::optional<vec3> point(std::uint32_t i, std::uint32_t j) const {
    const auto p = place(i, j);
    if (!p) return std::nullopt;
    const vec3 in_a = T_a_world * *p, in_b = T_b_world * *p;
    if (!(in_a.z() > 0.0 && in_b.z() > 0.0)) return std::nullopt;
    if (!agrees<Camera, D>(rig, a, T_a_world, i, *p) || !agrees<Camera, D>(rig, b, T_b_world, j, *p))
      return std::nullopt;
    // A point at twice the distance appears half as large.
    const double factor = norm(in_b) * rig.scales.scale(b.features.keypoints[j].octave) /
                          (norm(in_a) * rig.scales.scale(a.features.keypoints[i].octave));
    const double limit = options.scale_tolerance * rig.scales.factor();
    return factor <= limit && factor * limit >= 1.0 ? p : std::nullopt;
  }

 private:
  /// Computes the point by triangulation or from depth, whichever has the larger parallax; for depth, that is the
  /// parallax of the virtual stereo camera.
  [[nodiscard]] std::optional<vec3> place(std::uint32_t i, std::uint32_t j) const {
    const double of_a = stereo_parallax(a, i), of_b = stereo_parallax(b, j);
    const auto met = optimize::triangulate(a.T_world_camera, a.rays[i], b.T_world_camera, b.rays[j],
                                           {.min_parallax = options.min_parallax});
    if (std::max(of_a, of_b) > met.parallax) return of_a >= of_b ? a.point_world(i) : b.point_world(j);
    return met.ok() ? std::optional{met.point} : std::nullopt;
  }
  [[nodiscard]] double stereo_parallax(const basic_keyframe<D>& k, std::uint32_t i) const {
    return k.has_depth(i) ? rig.model.bf / (focal * static_cast<double>(k.depth[i])) : 0.0;
  }
};

/// Matches keypoints without landmarks between a keyframe and its best neighbours, along epipolar lines, and creates
/// landmarks from the matches. The position is triangulated, or taken from the depth of either keypoint if that is more
/// precise. A match becomes a landmark with both observations if
/// - its point is in front of both cameras;
/// - the angle between the rays is large enough (not required if depth is used);
/// - the point agrees with both keypoints (chi-square, 95 %), and with their depth if available;
/// - the ratio of its distances from the two cameras agrees with the keypoints' pyramid levels.
/// Returns the number of new landmarks. Computes O(neighbours x keypoints^2) distances to epipolar lines.
/// @pre m.has_keyframe(newest)
template <feature_descriptor D, camera::camera_model Camera>
std::size_t triangulate_landmarks(basic_map<D>& m, keyframe_id newest, const camera_rig<Camera>& rig,
                                  const triangulation_options& o = {}) {
  assert(m.has_keyframe(newest));
  const double focal = focal_length(rig.camera());
  if (!(focal > 0.0)) return 0;
  const auto matcher = features::epipolar(distance_of_t<D>{}, {.distance = o.line_distance,
                                                               .scale_factor = static_cast<float>(rig.scales.factor()),
                                                               .epipole_radius = o.epipole_radius}) |
                       features::max_distance{o.distance} | features::ratio_test{o.ratio} | features::unique{} |
                       features::rotation_consistency{};
  typename decltype(matcher)::workspace memory;
  std::vector<features::match> matches;
  free_keypoints<D> own, others;
  std::size_t made = 0;
  const auto& k = m.at(newest);
  for (const covisible& n : m.covisibility().neighbors(newest, o.neighbors)) {
    const auto& other = m.at(n.keyframe);
    const se3 T_other_k = other.T_world_camera.inverse() * k.T_world_camera;
    const double unit = rig.scale_is_known ? 1.0 : median_depth(m, other);
    if (!(norm(T_other_k.translation()) >= o.min_baseline * unit)) continue;
    own.assign(k);
    others.assign(other);
    const view_pair<Camera, D> pair{rig, o, k, other, focal};
    matcher.match_into(matches, memory, own.features, others.features,
                       features::ray_geometry{own.rays, others.rays, T_other_k, focal});
    for (const features::match& found : matches) {
      const std::uint32_t i = own.index[found.query], j = others.index[found.train];
      const auto point = pair.point(i, j);
      if (!point || m.landmark_ids_left() == 0) continue;
      const landmark_id l = m.add_landmark(newest, i, *point);
      m.add_observation(l, n.keyframe, j);
      m.update_landmark(l);
      ++made;
    }
  }
  return made;
}

}  // namespace orbis::slam::detail
