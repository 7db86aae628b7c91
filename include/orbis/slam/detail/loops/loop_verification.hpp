// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Verification that two keyframes with similar appearance observe the same place, and their relative pose.
///
/// `take` copies the necessary data from the maps; `verify` works on the copy. Steps: match the keypoints of both
/// keyframes by descriptors; estimate the rigid motion between their points; search for the landmarks around the
/// candidate in the keyframe at that pose, and refine the pose on them; search for the same landmarks in neighbours of
/// the keyframe; and, within one map, check that the motion differs from the poses in the map by no more than plausible
/// drift.
///
/// Source: C. Campos, R. Elvira, J. J. Gomez Rodriguez, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM3: an accurate
/// open-source library for visual, visual-inertial and multi-map SLAM", T-RO 37 (2021), section VI. If the scale is not
/// measured, it is estimated as well: first from the points of the matches, then from the landmarks common to both
/// sides.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/optimize/alignment.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/ransac.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/loops/landmark_snapshot.hpp>
#include <orbis/slam/detail/loops/scaled_alignment.hpp>
#include <orbis/slam/detail/map/local_map.hpp>
#include <orbis/slam/detail/map/map_content.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Keypoint `feature` of the keyframe, and the `landmark` of the candidate's map that it observes.
struct loop_pair {
  std::uint32_t feature = 0;
  landmark_id landmark;
  friend bool operator==(const loop_pair&, const loop_pair&) = default;
};

/// Two keyframes that observe the same place.
struct loop_match {
  keyframe_id keyframe;
  keyframe_id candidate;     ///< in the same map or another one
  se3 T_candidate_keyframe;  ///< camera to camera, from the matches; in the unit of length at the candidate
  double scale = 1.0;        ///< ratio of lengths at the candidate to those at the keyframe; 1 if depth is measured
  std::vector<loop_pair> matches;  ///< the inliers, in ascending order of landmark
  std::size_t inliers = 0;         ///< number of inliers
  std::size_t supporters = 0;      ///< number of neighbours of the keyframe that agree

  /// The similarity that transforms points from the keyframe's camera to the candidate's.
  [[nodiscard]] sim3 scaled_motion() const {
    return {T_candidate_keyframe.rotation(), T_candidate_keyframe.translation(), scale};
  }
};

enum class loop_verdict {
  accepted,
  connected,      ///< both keyframes already observe the same landmarks
  few_matches,    ///< too few features match
  not_aligned,    ///< no rigid motion explains enough of the matches
  few_inliers,    ///< the keyframe observes too few of the landmarks around the candidate
  not_supported,  ///< too few neighbours of the keyframe observe the landmarks around the candidate
  unsure_scale,   ///< the scale is not determined
  too_far         ///< the drift would be implausible: probably a different place with the same appearance
};

[[nodiscard]] constexpr std::string_view to_string(loop_verdict verdict) noexcept {
  switch (verdict) {
    case loop_verdict::accepted: return "accepted";
    case loop_verdict::connected: return "connected";
    case loop_verdict::few_matches: return "few matches";
    case loop_verdict::not_aligned: return "not aligned";
    case loop_verdict::few_inliers: return "few inliers";
    case loop_verdict::not_supported: return "not supported";
    case loop_verdict::unsure_scale: return "uncertain scale";
    case loop_verdict::too_far: return "too far";
  }
  return "unknown";
}

struct loop_check {
  loop_verdict verdict = loop_verdict::few_matches;
  loop_match match;  ///< the match, as far as it was determined
  [[nodiscard]] explicit operator bool() const noexcept { return verdict == loop_verdict::accepted; }
};

namespace loop_verification {

/// A keyframe and its features with known 3D points.
template <feature_descriptor D>
struct view {
  basic_frame<D> image;
  orbis::features::basic_features<D> features;
  std::vector<vec3> points;          ///< point of each feature, in the camera frame, metres
  std::vector<std::uint32_t> index;  ///< keypoint of each feature
  std::vector<double> deviations;    ///< standard deviation of each feature's depth, metres
  double median_depth = 0.0;         ///< median depth of the points
};

template <feature_descriptor D>
struct neighbor {
  basic_frame<D> image;
  se3 T_keyframe_camera;  ///< relative to the keyframe
};

template <feature_descriptor D>
struct snapshot {
  keyframe_id keyframe;
  bool same_map = false;
  bool connected = false;          ///< true if the keyframes have a covisibility edge; the other members are then empty
  view<D> seen, known;             ///< the keyframe and the candidate
  landmark_snapshot<D> landmarks;  ///< landmarks around the candidate
  std::vector<neighbor<D>> supporters;
  double path_length = 0.0;  ///< length of the path along the keyframes from `seen` to `known`, metres
};

/// Returns the standard deviation of a landmark's depth in keyframe `k` if no depth is measured, in the map's unit: the
/// effect of a one-pixel error of its rays, given the largest angle between them. Infinite with one observation.
template <feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] double deviation_by_parallax(const basic_map<D>& m, const basic_keyframe<D>& k, std::uint32_t feature,
                                           const camera_rig<Camera>& rig) {
  const auto& l = m.landmark_at(k.landmarks[feature]);
  const vec3 ray = l.position - k.T_world_camera.translation();
  double sine = 0.0;
  for (const observation& o : l.observations) {
    const vec3 other = l.position - m.at(o.keyframe).T_world_camera.translation();
    sine = std::max(sine, norm(cross(ray, other)) / (norm(ray) * norm(other)));
  }
  const double angle = rig.scales.scale(k.features.keypoints[feature].octave) / focal_length(rig.camera());
  return norm(ray) * angle / sine;
}

template <feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] view<D> make_view(const basic_map<D>& m, keyframe_id id, const camera_rig<Camera>& rig) {
  const auto& k = m.at(id);
  view<D> v;
  v.image = k;
  const se3 T_camera_world = k.T_world_camera.inverse();
  for (std::uint32_t i = 0; i < k.size(); ++i) {
    const landmark_id l = k.landmarks[i];
    if (l == no_id && !k.has_depth(i)) continue;
    // The measured depth is preferred to the landmark, which may depend on other observations.
    const vec3 point = k.has_depth(i) ? k.point_camera(i) : T_camera_world * m.landmark_at(l).position;
    if (!all_finite(point) || !(point.z() > 0.0)) continue;
    v.features.keypoints.push_back(k.features.keypoints[i]);
    v.features.descriptors.push_back(k.features.descriptors[i]);
    v.points.push_back(point);
    v.index.push_back(i);
    v.deviations.push_back(rig.scale_is_known ? rig.depth_deviation(point.z(), k.features.keypoints[i].octave)
                                              : deviation_by_parallax(m, k, i, rig));
  }
  v.median_depth = rig.scale_is_known ? 0.0 : median_depth(m, k);
  return v;
}

/// Returns the length of the path along the keyframes between two keyframes, metres. O(ids between them).
template <feature_descriptor D>
[[nodiscard]] double path_between(const basic_map<D>& m, keyframe_id a, keyframe_id b) {
  double length = 0.0;
  keyframe_id last = std::min(a, b);
  for (keyframe_id k = last + 1; k <= std::max(a, b); ++k) {
    if (!m.has_keyframe(k)) continue;
    length += norm(m.at(k).T_world_camera.translation() - m.at(last).T_world_camera.translation());
    last = k;
  }
  return length;
}

/// Copies the data needed for the verification. O(features of a few keyframes + keyframes between the two).
/// @pre the keyframes exist and differ
template <feature_descriptor D, camera::camera_model Camera>
[[nodiscard]] snapshot<D> take(const basic_map<D>& current, keyframe_id k, const basic_map<D>& candidate_map,
                               keyframe_id candidate, const camera_rig<Camera>& rig, const loop_options& o = {}) {
  assert(current.has_keyframe(k) && candidate_map.has_keyframe(candidate));
  snapshot<D> s;
  s.keyframe = k;
  s.same_map = &current == &candidate_map;
  assert(!s.same_map || k != candidate);
  s.landmarks.keyframe = candidate;
  s.connected = s.same_map && current.covisibility().connected(k, candidate);
  if (s.connected) return s;
  s.seen = make_view(current, k, rig);
  s.known = make_view(candidate_map, candidate, rig);
  s.landmarks = snapshot_around(candidate_map, candidate, o.neighbors);
  const se3 T_camera_world = current.at(k).T_world_camera.inverse();
  for (const covisible& n : current.covisibility().neighbors(k, o.supporters))
    s.supporters.push_back({current.at(n.keyframe), T_camera_world * current.at(n.keyframe).T_world_camera});
  s.path_length = s.same_map ? path_between(current, k, candidate) : 0.0;
  return s;
}

/// The steps of the verification.
template <camera::camera_model Camera, feature_descriptor D>
class checker {
 public:
  checker(const snapshot<D>& s, const camera_rig<Camera>& rig, const loop_options& o) : s_{s}, rig_{rig}, options_{o} {}

  [[nodiscard]] loop_check run() const {
    loop_check check;
    loop_match& found = check.match;
    found.keyframe = s_.keyframe;
    found.candidate = s_.landmarks.keyframe;
    check.verdict = judge(found);
    return check;
  }

 private:
  [[nodiscard]] loop_verdict judge(loop_match& found) const {
    if (s_.connected) return loop_verdict::connected;
    const auto matches = match_by_appearance();
    found.inliers = matches.size();
    if (matches.size() < options_.min_matches) return loop_verdict::few_matches;
    if (!align(matches, found)) return loop_verdict::not_aligned;
    if (!refine(found)) return loop_verdict::few_inliers;
    if (!rig_.scale_is_known && !measure_scale(found)) return loop_verdict::unsure_scale;
    const std::size_t wanted = std::min(options_.min_supporters, s_.supporters.size());
    for (std::size_t i = 0; i != s_.supporters.size() && found.supporters < wanted; ++i)
      found.supporters += supports(s_.supporters[i], found);
    if (found.supporters < wanted) return loop_verdict::not_supported;
    if (s_.same_map && !is_plausible(found.T_candidate_keyframe)) return loop_verdict::too_far;
    return loop_verdict::accepted;
  }

  [[nodiscard]] std::vector<features::match> match_by_appearance() const {
    if (s_.seen.points.empty() || s_.known.points.empty()) return {};
    const auto matcher = features::brute_force(distance_of_t<D>{}) | features::max_distance{options_.distance} |
                         features::ratio_test{options_.ratio} | features::cross_check{} |
                         features::rotation_consistency{};
    return matcher(s_.seen.features, s_.known.features);
  }
  /// Estimates the rigid motion between the points of the matches by RANSAC, including the scale if lengths are not
  /// measured.
  [[nodiscard]] bool align(const std::vector<features::match>& matches, loop_match& found) const {
    if (!rig_.scale_is_known) return align_scaled(matches, found);
    std::vector<vec3> from, to;
    std::vector<double> deviations;
    for (const features::match& m : matches) {
      from.push_back(s_.seen.points[m.query]);
      to.push_back(s_.known.points[m.train]);
      deviations.push_back(std::hypot(s_.seen.deviations[m.query], s_.known.deviations[m.train]));
    }
    const auto aligned = optimize::estimate_alignment<se3>(from, to,
                                                           {.threshold = options_.alignment_threshold,
                                                            .confidence = 0.999,
                                                            .max_iterations = 3000,
                                                            .min_inliers = options_.min_aligned,
                                                            .seed = options_.seed,
                                                            .deviations = deviations});
    found.inliers = aligned ? aligned->inliers.size() : 0;
    if (aligned) found.T_candidate_keyframe = aligned->T_to_from;
    return aligned.has_value();
  }
  [[nodiscard]] bool align_scaled(const std::vector<features::match>& matches, loop_match& found) const {
    using estimator = scaled_alignment<Camera>;
    if (matches.empty()) return false;
    std::vector<double> ratios;
    for (const features::match& m : matches)
      ratios.push_back(s_.known.points[m.train].z() / s_.seen.points[m.query].z());
    const double ratio = median(ratios);  // converts both sides to about the same unit before adding the deviations
    const auto known = [&](const view<D>& v, std::uint32_t i) {
      return known_point{v.points[i], v.image.pixel(v.index[i]),
                         rig_.scales.information(v.features.keypoints[i].octave)};
    };
    std::vector<typename estimator::pair> pairs;
    for (const features::match& m : matches) {
      const double deviation = std::hypot(ratio * s_.seen.deviations[m.query], s_.known.deviations[m.train]);
      if (deviation > 0.0 && std::isfinite(deviation))
        pairs.push_back({known(s_.seen, m.query), known(s_.known, m.train), 1.0 / (deviation * deviation)});
    }
    random_bits random(mix64(options_.seed));
    shuffle(pairs, random);
    const auto aligned =
        optimize::ransac(estimator(rig_.camera(), std::move(pairs)), {.threshold = options_.alignment_threshold,
                                                                      .confidence = 0.999,
                                                                      .max_iterations = 3000,
                                                                      .min_inliers = options_.min_aligned,
                                                                      .seed = options_.seed});
    found.inliers = aligned ? aligned->inliers.size() : 0;
    if (!aligned) return false;
    const sim3& T = aligned->model.T_to_from;
    found.T_candidate_keyframe = se3(T.rotation(), T.translation());
    found.scale = T.scale();
    return true;
  }
  /// Finds the landmarks around the candidate that a frame observes, and estimates its pose from them, starting from
  /// `T_world_camera`.
  [[nodiscard]] optimize::pose_refinement localize(const basic_frame<D>& f, const se3& T_world_camera, double radius,
                                                   std::vector<loop_pair>* observed) const {
    const auto matches = find_landmarks(s_.landmarks, f, T_world_camera, rig_, radius, options_.landmark_distance);
    std::vector<optimize::pose_observation> observations;
    for (const features::match& m : matches)
      observations.push_back(make_observation(rig_, f, m.train, s_.landmarks.landmarks[m.query].position));
    std::vector<std::uint8_t> outliers(matches.size());
    const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), rig_.model,
                                               T_world_camera, std::span<std::uint8_t>(outliers));
    if (observed != nullptr) {
      observed->clear();
      for (std::size_t i = 0; i != matches.size(); ++i)
        if (outliers[i] == 0) observed->push_back({matches[i].train, s_.landmarks.landmarks[matches[i].query].id});
    }
    return refined;
  }

  [[nodiscard]] bool refine(loop_match& found) const {
    const se3 start = s_.landmarks.T_world_camera * found.T_candidate_keyframe;
    const auto first = localize(s_.seen.image, start, options_.wide_radius, nullptr);
    if (!first.ok()) return false;
    const auto second = localize(s_.seen.image, first.T_world_camera, options_.radius, &found.matches);
    if (!second.ok()) return false;
    found.inliers = second.inliers;
    found.T_candidate_keyframe = s_.landmarks.T_world_camera.inverse() * second.T_world_camera;
    return second.inliers >= options_.min_inliers;
  }

  /// Estimates the scale as the median ratio of depths of the landmarks common to both sides. Returns false if it is
  /// uncertain.
  [[nodiscard]] bool measure_scale(loop_match& found) const {
    std::vector<vec3> at(s_.seen.image.size(), zeros<vec3>());
    for (std::size_t i = 0; i != s_.seen.points.size(); ++i) at[s_.seen.index[i]] = s_.seen.points[i];
    const se3 T_keyframe_world = (s_.landmarks.T_world_camera * found.T_candidate_keyframe).inverse();
    std::vector<double> ratios;
    for (const loop_pair& p : found.matches) {
      const auto l = std::lower_bound(s_.landmarks.landmarks.begin(), s_.landmarks.landmarks.end(), p.landmark,
                                      [](const snapshot_landmark& a, landmark_id id) { return a.id < id; });
      const double here = at[p.feature].z(), there = (T_keyframe_world * l->position).z();
      if (here > 0.0 && there > 0.0) ratios.push_back(there / here);
    }
    if (ratios.size() < options_.min_matches || ratios.empty()) return false;
    found.scale = median(ratios);
    std::vector<double> off;
    for (const double r : ratios) off.push_back(std::abs(std::log(r / found.scale)));
    constexpr double deviation_by_median = 1.4826;  // for a normal distribution
    const double deviation = deviation_by_median * median(off) / std::sqrt(static_cast<double>(off.size()));
    return deviation <= options_.max_scale_deviation;
  }

  [[nodiscard]] bool supports(const neighbor<D>& n, const loop_match& found) const {
    const se3 T_world_camera =
        s_.landmarks.T_world_camera * found.T_candidate_keyframe * scaled(n.T_keyframe_camera, found.scale);
    const auto localized = localize(n.image, T_world_camera, options_.radius, nullptr);
    if (!localized.ok() || localized.inliers < options_.supporter_inliers) return false;
    if (rig_.scale_is_known) return true;
    // If the neighbour is at a significant distance, that distance must agree with the scale.
    const se3 T_keyframe_neighbor =
        (s_.landmarks.T_world_camera * found.T_candidate_keyframe).inverse() * localized.T_world_camera;
    const double expected = found.scale * norm(n.T_keyframe_camera.translation());
    const double off = norm(T_keyframe_neighbor.translation() - found.scale * n.T_keyframe_camera.translation());
    return off <= 0.3 * expected || expected <= 0.02 * found.scale * s_.seen.median_depth;
  }

  /// Returns true if the drift is plausible. If the scale is unknown, only the rotation is limited, because scale drift
  /// has no known bound.
  [[nodiscard]] bool is_plausible(const se3& T_candidate_keyframe) const {
    const se3& was = s_.seen.image.T_world_camera;
    const se3 is = s_.landmarks.T_world_camera * T_candidate_keyframe;
    const double moved = norm(is.translation() - was.translation());
    const double turned = norm((was.rotation().inverse() * is.rotation()).log());
    if (!rig_.scale_is_known) return turned <= options_.max_rotation;
    return moved <= options_.max_translation + options_.translation_per_metre * s_.path_length &&
           turned <= options_.max_rotation + options_.rotation_per_metre * s_.path_length;
  }

  const snapshot<D>& s_;
  const camera_rig<Camera>& rig_;
  const loop_options& options_;
};

/// Verifies a loop. Deterministic. Takes as long as tracking a few frames.
template <camera::camera_model Camera, feature_descriptor D>
[[nodiscard]] loop_check verify(const snapshot<D>& s, const camera_rig<Camera>& rig, const loop_options& o = {}) {
  return checker<Camera, D>{s, rig, o}.run();
}

}  // namespace loop_verification

}  // namespace orbis::slam::detail
