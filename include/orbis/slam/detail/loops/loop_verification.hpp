// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Whether two keyframes that look alike do show the same place, and how they lie to each other.
///
/// Source of the procedure: C. Campos, R. Elvira, J. J. Gomez Rodriguez, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM3: an
/// accurate open-source library for visual, visual-inertial and multi-map SLAM", T-RO 37 (2021), section VI, for
/// cameras with depth, whose transforms have no scale to find.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/optimize/alignment.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/detail/loops/landmark_snapshot.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Keypoint `feature` of the keyframe shows `landmark`, one of the candidate's map.
struct loop_pair {
  std::uint32_t feature = 0;
  landmark_id landmark = no_id;
  friend bool operator==(const loop_pair&, const loop_pair&) = default;
};

/// Two keyframes that show the same place.
struct loop_match {
  keyframe_id keyframe = no_id;
  keyframe_id candidate = no_id;   ///< of the same map, or of another one
  se3 T_candidate_keyframe;        ///< camera to camera, as the matches say
  std::vector<loop_pair> matches;  ///< the inliers, by ascending landmark
  std::size_t inliers = 0;         ///< how many these are
  std::size_t supporters = 0;      ///< neighbours of the keyframe that agree
};

enum class loop_verdict {
  accepted,
  connected,      ///< both see the same landmarks: there is nothing to close
  few_matches,    ///< their features do not look alike
  not_aligned,    ///< no rigid motion explains enough of the matches
  few_inliers,    ///< the keyframe does not show enough of the landmarks around the candidate
  not_supported,  ///< the neighbours of the keyframe do not show them
  too_far         ///< more drift than can have come about on the way: another place that looks the same
};

[[nodiscard]] constexpr std::string_view to_string(loop_verdict verdict) noexcept {
  switch (verdict) {
    case loop_verdict::accepted: return "accepted";
    case loop_verdict::connected: return "connected";
    case loop_verdict::few_matches: return "few matches";
    case loop_verdict::not_aligned: return "not aligned";
    case loop_verdict::few_inliers: return "few inliers";
    case loop_verdict::not_supported: return "not supported";
    case loop_verdict::too_far: return "too far";
  }
  return "unknown";
}

struct loop_check {
  loop_verdict verdict = loop_verdict::few_matches;
  loop_match match;  ///< as far as it was found
  [[nodiscard]] explicit operator bool() const noexcept { return verdict == loop_verdict::accepted; }
};

/// Judges whether a keyframe shows the place of a candidate, in two parts: `gather` copies what it takes out of the
/// maps, `solve` does the work on the copies.
///
/// Steps: matches by looks between the points of both keyframes; the rigid motion between these; the landmarks around
/// the candidate searched for in the keyframe from there, and its pose refined on them; the same landmarks searched for
/// in neighbours of the keyframe, from where these lie to it; and, within one map, that the motion found does not
/// contradict the poses by more than what drifts in on the way between the two.
template <camera::camera_model Camera>
class loop_verifier {
 public:
  /// False if both are connected in the covisibility graph of the one map that both belong to; `solve` says so too.
  /// O(features of some keyframes, and keyframes between the two).
  /// @pre the keyframes are there, and not the same
  bool gather(const map& current, keyframe_id k, const map& candidate_map, keyframe_id candidate,
              const optimize::reprojection<Camera>& model, const pyramid_scales& scales, const loop_options& o = {}) {
    assert(current.has_keyframe(k) && candidate_map.has_keyframe(candidate));
    same_map_ = &current == &candidate_map;
    assert(!same_map_ || k != candidate);
    options_ = o;
    scales_ = scales;
    model_.emplace(model);
    keyframe_ = k;
    connected_ = same_map_ && current.covisibility().connected(k, candidate);
    if (connected_) return false;
    copy(current, k, seen_);
    copy(candidate_map, candidate, known_);
    place_ = snapshot_around(candidate_map, candidate, o.neighbors);
    supporters_.clear();
    const se3 T_camera_world = current.at(k).T_world_camera.inverse();
    for (const covisible& n : current.covisibility().neighbors(k, o.supporters))
      supporters_.push_back({current.at(n.keyframe), T_camera_world * current.at(n.keyframe).T_world_camera});
    way_ = same_map_ ? way_between(current, k, candidate) : 0.0;
    return true;
  }

  /// Deterministic. About as expensive as tracking a few frames.
  [[nodiscard]] loop_check solve() const {
    loop_check check;
    const auto refused = [&](loop_verdict verdict) {
      check.verdict = verdict;
      return check;
    };
    loop_match& found = check.match;
    found.keyframe = keyframe_;
    found.candidate = place_.keyframe;
    if (connected_) return refused(loop_verdict::connected);
    const auto matches = match_by_appearance();
    found.inliers = matches.size();
    if (matches.size() < options_.min_matches) return refused(loop_verdict::few_matches);
    if (!align(matches, found)) return refused(loop_verdict::not_aligned);
    if (!refine(found)) return refused(loop_verdict::few_inliers);
    const std::size_t wanted = std::min(options_.min_supporters, supporters_.size());
    for (std::size_t i = 0; i != supporters_.size() && found.supporters < wanted; ++i)
      found.supporters += supports(supporters_[i], found.T_candidate_keyframe);
    if (found.supporters < wanted) return refused(loop_verdict::not_supported);
    if (same_map_ && !is_plausible(found.T_candidate_keyframe)) return refused(loop_verdict::too_far);
    return refused(loop_verdict::accepted);
  }

 private:
  /// A keyframe, with those of its features whose point is known.
  struct view {
    frame image;
    features::features features;
    std::vector<vec3> points;        ///< in the camera frame
    std::vector<double> deviations;  ///< metres
  };
  struct neighbor {
    frame image;
    se3 T_keyframe_camera;
  };

  void copy(const map& m, keyframe_id id, view& to) const {
    const keyframe& k = m.at(id);
    to.image = k;
    to.features.keypoints.clear();
    to.features.descriptors.clear();
    to.points.clear();
    to.deviations.clear();
    const se3 T_camera_world = k.T_world_camera.inverse();
    for (std::uint32_t i = 0; i < k.size(); ++i) {
      const landmark_id l = k.landmarks[i];
      if (l == no_id && !k.has_depth(i)) continue;
      // The depth measured rather than the landmark: that one may be mostly made of what others saw.
      const vec3 point = k.has_depth(i) ? k.point_camera(i) : T_camera_world * m.landmark_at(l).position;
      if (!point.allFinite() || !(point.z() > 0.0)) continue;
      to.features.keypoints.push_back(k.features.keypoints[i]);
      to.features.descriptors.push_back(k.features.descriptors[i]);
      to.points.push_back(point);
      to.deviations.push_back(point.z() * point.z() / model_->bf * scales_.scale(k.features.keypoints[i].octave));
    }
  }

  /// The length of the way along the keyframes between two.
  [[nodiscard]] static double way_between(const map& m, keyframe_id a, keyframe_id b) {
    double way = 0.0;
    keyframe_id last = std::min(a, b);
    for (keyframe_id k = last + 1; k <= std::max(a, b); ++k) {
      if (!m.has_keyframe(k)) continue;
      way += (m.at(k).T_world_camera.translation() - m.at(last).T_world_camera.translation()).norm();
      last = k;
    }
    return way;
  }

  [[nodiscard]] std::vector<features::match> match_by_appearance() const {
    if (seen_.points.empty() || known_.points.empty()) return {};
    const auto matcher = features::brute_force(features::hamming{}) | features::max_distance{options_.distance} |
                         features::ratio_test{options_.ratio} | features::cross_check{} |
                         features::rotation_consistency{};
    return matcher(seen_.features, known_.features);
  }

  [[nodiscard]] bool align(const std::vector<features::match>& matches, loop_match& found) const {
    std::vector<vec3> from, to;
    std::vector<double> deviations;
    for (const features::match& m : matches) {
      from.push_back(seen_.points[m.query]);
      to.push_back(known_.points[m.train]);
      deviations.push_back(std::hypot(seen_.deviations[m.query], known_.deviations[m.train]));
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

  /// The landmarks of the place that a frame shows, and its pose by them, from `T_world_camera`.
  [[nodiscard]] optimize::pose_refinement locate(const frame& f, const se3& T_world_camera, double radius,
                                                 std::vector<loop_pair>* shown) const {
    const optimize::reprojection<Camera>& model = *model_;
    const auto matches =
        find_landmarks(place_, f, T_world_camera, model.camera, scales_, radius, options_.landmark_distance);
    std::vector<optimize::pose_observation> observations;
    for (const features::match& m : matches)
      observations.push_back(observation_of(model, scales_, f, m.train, place_.landmarks[m.query].position));
    std::vector<std::uint8_t> outliers(matches.size());
    const auto refined = optimize::refine_pose(std::span<const optimize::pose_observation>(observations), model,
                                               T_world_camera, std::span<std::uint8_t>(outliers));
    if (shown != nullptr) {
      shown->clear();
      for (std::size_t i = 0; i != matches.size(); ++i)
        if (outliers[i] == 0) shown->push_back({matches[i].train, place_.landmarks[matches[i].query].id});
    }
    return refined;
  }

  [[nodiscard]] bool refine(loop_match& found) const {
    const se3 start = place_.T_world_camera * found.T_candidate_keyframe;
    const auto first = locate(seen_.image, start, options_.wide_radius, nullptr);
    if (!first.ok()) return false;
    const auto second = locate(seen_.image, first.T_world_camera, options_.radius, &found.matches);
    if (!second.ok()) return false;
    found.inliers = second.inliers;
    found.T_candidate_keyframe = place_.T_world_camera.inverse() * second.T_world_camera;
    return second.inliers >= options_.min_inliers;
  }

  [[nodiscard]] bool supports(const neighbor& n, const se3& T_candidate_keyframe) const {
    const se3 T_world_camera = place_.T_world_camera * T_candidate_keyframe * n.T_keyframe_camera;
    const auto located = locate(n.image, T_world_camera, options_.radius, nullptr);
    return located.ok() && located.inliers >= options_.supporter_inliers;
  }

  [[nodiscard]] bool is_plausible(const se3& T_candidate_keyframe) const {
    const se3& was = seen_.image.T_world_camera;
    const se3 is = place_.T_world_camera * T_candidate_keyframe;
    const double moved = (is.translation() - was.translation()).norm();
    const double turned = (was.rotation().inverse() * is.rotation()).log().norm();
    return moved <= options_.max_translation + options_.translation_per_metre * way_ &&
           turned <= options_.max_rotation + options_.rotation_per_metre * way_;
  }

  loop_options options_;
  pyramid_scales scales_;
  std::optional<optimize::reprojection<Camera>> model_;
  keyframe_id keyframe_ = no_id;
  bool same_map_ = false, connected_ = false;
  view seen_, known_;        // the keyframe and the candidate
  landmark_snapshot place_;  // around the candidate
  std::vector<neighbor> supporters_;
  double way_ = 0.0;  // metres
};

/// Judges at once whether keyframe `k` of `current` shows the place of `candidate` of `candidate_map`, the same map or
/// another. Deterministic. See `loop_verifier`.
/// @pre the keyframes are there, and not the same
template <camera::camera_model Camera>
[[nodiscard]] loop_check verify_loop(const map& current, keyframe_id k, const map& candidate_map, keyframe_id candidate,
                                     const optimize::reprojection<Camera>& model, const pyramid_scales& scales,
                                     const loop_options& o = {}) {
  loop_verifier<Camera> verifier;
  verifier.gather(current, k, candidate_map, candidate, model, scales, o);
  return verifier.solve();
}

}  // namespace orbis::slam::detail
