// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframe-based SLAM from an RGB-D camera.
///
/// @code
///   orbis::slam::rgbd_system slam{camera, orbis::slam::options{}};
///   for (const auto& frame : recording) slam.track(frame);
///   auto trajectory = slam.trajectory();
/// @endcode
///
/// The scheme is that of R. Mur-Artal, J. D. Tardos, "ORB-SLAM2: an open-source SLAM system for
/// monocular, stereo and RGB-D cameras", T-RO 33 (2017): predict by constant motion, find the local
/// map's landmarks, refine the pose, and make a keyframe where the view has changed.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/rgbd_frame.hpp>
#include <orbis/core/trajectory.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/slam/keyframe_decision.hpp>
#include <orbis/slam/landmark_culling.hpp>
#include <orbis/slam/landmark_search.hpp>
#include <orbis/slam/local_adjustment.hpp>
#include <orbis/slam/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/mapping.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/pose_tracker.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {

/// Tracks the frames of one camera and builds a map of landmarks. Everything happens in `track`, in
/// the caller's thread: the same frames and options give the same bytes. Images are not kept; a
/// caller who needs those of keyframes keeps them when `track` says that a frame became one.
template <camera::camera_model Camera, feature_extractor Extractor = features::orb_extractor>
class rgbd_system {
 public:
  explicit rgbd_system(Camera camera, const options& settings = {}) requires
      std::constructible_from<Extractor, const features::orb_options&>
      : rgbd_system(std::move(camera), settings, Extractor(settings.features)) {}
  rgbd_system(Camera camera, const options& settings, Extractor extractor)
      : options_{settings},
        extract_{std::move(extractor)},
        model_{std::move(camera), settings.bf},
        scales_{settings.features.levels, static_cast<double>(settings.features.scale_factor)},
        map_{scales_.levels, scales_.factor},
        adjuster_{model_, optimize::huber{2.8}} {}

  /// The next frame. Frames of another size than the camera's are counted as lost.
  track_result track(const camera::rgbd_frame& f) { return track(f.timestamp, f.color, f.depth_metres()); }

  /// The next frame, in place. @pre time stamps ascend
  template <camera::depth_source Depth>
  track_result track(double timestamp, image_view<const rgb8> color, const Depth& depth) {
    track_result result;
    stopwatch clock;
    frame current = observe(timestamp, color, depth);
    clock.lap(result.timings.features_ms);
    const std::size_t inliers = state_ == track_state::not_started ? start(current) : locate(current);
    clock.lap(result.timings.tracking_ms);
    if (inliers > 0 && needs_keyframe(current, inliers)) result.keyframe = grow_map(current);
    clock.lap(result.timings.mapping_ms);
    remember(std::move(current));
    report(result, inliers);
    return result;
  }

  [[nodiscard]] track_state state() const noexcept { return state_; }

  /// Every tracked frame, where the keyframe it hangs on is now: later corrections of keyframes
  /// move it along.
  [[nodiscard]] orbis::trajectory trajectory() const {
    orbis::trajectory all;
    for (const tracked_frame& f : tracked_)
      all.push_back({f.timestamp, map_.pose_of(f.reference) * f.T_reference_camera});
    return all;
  }
  /// Time stamp, pose and frame index of each keyframe.
  [[nodiscard]] std::vector<keyframe_pose> keyframes() const {
    std::vector<keyframe_pose> all;
    for (const keyframe& k : map_.keyframes()) all.push_back({k.timestamp, k.T_world_camera, k.index});
    return all;
  }
  [[nodiscard]] orbis::trajectory keyframe_trajectory() const {
    orbis::trajectory all;
    for (const keyframe& k : map_.keyframes()) all.push_back({k.timestamp, k.T_world_camera});
    return all;
  }
  [[nodiscard]] std::size_t landmark_count() const noexcept { return map_.landmark_count(); }
  [[nodiscard]] const track_counters& counters() const noexcept { return counters_; }
  [[nodiscard]] const slam::map& map() const noexcept { return map_; }
  [[nodiscard]] const Camera& camera() const noexcept { return model_.camera; }

 private:
  struct tracked_frame {
    double timestamp;
    keyframe_id reference;
    se3 T_reference_camera;
  };

  template <class Depth>
  [[nodiscard]] frame observe(double timestamp, image_view<const rgb8> color, const Depth& depth) {
    frame f;
    const auto fits = [&](const auto& image) {
      return image.width() == model_.camera.width() && image.height() == model_.camera.height();
    };
    if (fits(color) && fits(depth)) f = make_frame(model_.camera, extract_, color, depth, options_);
    f.timestamp = timestamp;
    f.index = counters_.frames++;
    return f;
  }

  /// The first frame with enough depth defines the world.
  std::size_t start(frame& f) {
    std::size_t with_depth = 0;
    for (std::size_t i = 0; i < f.size(); ++i) with_depth += f.has_depth(i);
    if (with_depth == 0 || with_depth < options_.min_start_points) return 0;
    f.T_world_camera = options_.initial_pose.value_or(se3{});
    state_ = track_state::tracking;
    return with_depth;
  }

  /// The pose of a frame: by motion, else against the reference keyframe, else against any keyframe;
  /// refined on the local map. Returns the number of landmarks that agree, 0 if lost.
  std::size_t locate(frame& f) {
    if (is_tracking() && (track_by_motion(f) || track_against(f, reference_))) {
      if (const std::size_t inliers = track_local_map(f, options_.search_radius); inliers >= options_.min_inliers) {
        state_ = track_state::tracking;
        return inliers;
      }
    }
    const std::size_t inliers = relocalize(f);
    state_ = inliers > 0 ? track_state::relocalized : track_state::lost;
    return inliers;
  }

  [[nodiscard]] bool is_tracking() const {
    return state_ == track_state::tracking || state_ == track_state::relocalized;
  }

  /// Looks for what the last frame saw where constant motion takes it.
  bool track_by_motion(frame& f) {
    const se3 predicted = predict(f.timestamp);
    for (const double widening : {1.0, 2.0}) {
      f.T_world_camera = predicted;
      const features::camera_projection project{model_.camera, predicted};
      search_list list;
      for (std::size_t i = 0; i < last_.size(); ++i) {
        candidate_point p{.landmark = map_.became(last_.landmarks[i])};
        if (p.landmark != no_id)
          p.position = map_.landmark_at(p.landmark).position;
        else if (last_.has_depth(i))
          p = {last_.point_world(i), no_id};
        else
          continue;
        add_seen_point(list, project, scales_, p, last_.features.descriptors[i], last_.features.keypoints[i],
                       widening * options_.motion_radius);
      }
      const auto matches = motion_matcher(features::feature_view<descriptor>{list.keypoints, list.descriptors},
                                          f.features, list.windows, f.grid);
      if (matches.size() >= options_.min_inliers && refine_on_matches(f, list, matches, model_, scales_) >= 10)
        return true;
    }
    return false;
  }

  /// Matches a frame with a keyframe by appearance alone.
  bool track_against(frame& f, keyframe_id id) {
    const keyframe& k = map_.at(id);
    const auto matches = appearance_matcher(k.features, f.features);
    search_list list;
    std::vector<features::match> usable;
    std::vector<vec3> points;
    std::vector<vec2> pixels;
    for (const auto& m : matches) {
      candidate_point p{.landmark = k.landmarks[m.query]};
      if (p.landmark != no_id)
        p.position = map_.landmark_at(p.landmark).position;
      else if (k.has_depth(m.query))
        p.position = k.point_world(m.query);
      else
        continue;
      usable.push_back({static_cast<std::uint32_t>(list.size()), m.train, m.distance});
      list.points.push_back(p);
      points.push_back(p.position);
      pixels.push_back(f.pixel(m.train));
    }
    const auto pose =
        optimize::estimate_pose(std::span<const vec3>(points), std::span<const vec2>(pixels), model_.camera,
                                {.threshold = 5.0, .max_iterations = 500, .min_inliers = 12, .seed = options_.seed});
    if (!pose) return false;
    f.T_world_camera = pose->T_world_camera;
    return refine_on_matches(f, list, usable, model_, scales_) >= 12;
  }

  /// Finds the landmarks around in the frame and refines its pose on all of them.
  std::size_t track_local_map(frame& f, double radius) {
    const features::camera_projection project{model_.camera, f.T_world_camera};
    const features::projection_rule rule{.radius = static_cast<float>(radius),
                                         .levels = scales_.levels,
                                         .scale_factor = static_cast<float>(scales_.factor)};
    const std::vector<landmark_id> around = local_landmarks(map_, f, reference_, options_.local_keyframes);
    search_list list;
    for (const landmark_id id : around)
      if (add_landmark(list, project, rule, map_.landmark_at(id), id)) map_.count_visible(id);
    const auto matches = landmark_matcher(list.descriptors, f.features, list.windows, f.grid);
    const std::size_t inliers = refine_on_matches(f, list, matches, model_, scales_);
    for (const landmark_id l : f.landmarks)
      if (l != no_id) map_.count_found(l);
    return inliers;
  }

  /// Tries the keyframes that look most like the frame.
  std::size_t relocalize(frame& f) {
    for (const keyframe_id k : similar_keyframes(f)) {
      if (!track_against(f, k)) continue;
      reference_ = k;
      if (const std::size_t inliers = track_local_map(f, 3.0 * options_.search_radius);
          inliers >= options_.min_relocalized)
        return inliers;
    }
    return 0;
  }

  [[nodiscard]] std::vector<keyframe_id> similar_keyframes(const frame& f) const {
    std::vector<std::pair<std::size_t, keyframe_id>> order;
    for (const keyframe& k : map_.keyframes()) {
      const std::size_t alike = appearance_matcher(k.features, f.features).size();
      if (alike >= 15) order.emplace_back(alike, k.id);
    }
    std::sort(order.begin(), order.end(), std::greater<>{});
    if (order.size() > options_.relocalization_candidates) order.resize(options_.relocalization_candidates);
    std::vector<keyframe_id> best;
    for (const auto& [alike, id] : order) best.push_back(id);
    return best;
  }

  [[nodiscard]] bool needs_keyframe(const frame& f, std::size_t inliers) {
    if (map_.keyframes().empty()) return true;
    reference_ = most_shared(map_, f, reference_);
    return is_keyframe_due(gather_evidence(map_, f, reference_, inliers, options_), options_.keyframes);
  }

  keyframe_id grow_map(frame& f) {
    reference_ = insert_keyframe(map_, f, options_);
    cull_landmarks(map_, reference_, options_.culling);
    adjust_locally(map_, reference_, adjuster_, model_, scales_, options_.adjustment);
    f.T_world_camera = map_.at(reference_).T_world_camera;
    f.landmarks = map_.at(reference_).landmarks;
    return reference_;
  }

  /// Where the last tracked frame is, now that its keyframe may have moved.
  [[nodiscard]] se3 last_pose() const { return map_.pose_of(last_reference_) * T_reference_last_; }

  /// Where constant motion takes the camera.
  [[nodiscard]] se3 predict(double timestamp) const {
    const se3 last = last_pose();
    if (!velocity_) return last;
    const double ratio = last_interval_ > 0.0 ? (timestamp - last_.timestamp) / last_interval_ : 1.0;
    return last * se3::exp(std::clamp(ratio, 0.0, 3.0) * *velocity_);
  }

  /// Keeps the frame for the next prediction, and its place in the trajectory.
  void remember(frame f) {
    velocity_.reset();
    if (!is_tracking()) return;
    if (!tracked_.empty() && last_.index + 1 == f.index) {
      velocity_ = (last_pose().inverse() * f.T_world_camera).log();
      last_interval_ = f.timestamp - last_.timestamp;
    }
    last_reference_ = reference_;
    T_reference_last_ = map_.at(reference_).T_world_camera.inverse() * f.T_world_camera;
    tracked_.push_back({f.timestamp, last_reference_, T_reference_last_});
    last_ = std::move(f);
  }

  void report(track_result& result, std::size_t inliers) {
    result.state = state_;
    result.inliers = inliers;
    if (is_tracking()) result.T_world_camera = last_.T_world_camera;
    counters_.tracked += is_tracking();
    counters_.relocalized += state_ == track_state::relocalized;
    counters_.lost += state_ == track_state::lost;
  }

  using descriptor = features::binary_descriptor<256>;
  static constexpr auto motion_matcher = features::windowed(features::hamming{}) | features::max_distance{100} |
                                         features::unique{} | features::rotation_consistency{};
  static constexpr auto landmark_matcher =
      features::windowed(features::hamming{}) | features::max_distance{80} | features::unique{};
  static constexpr auto appearance_matcher = features::brute_force(features::hamming{}) | features::ratio_test{0.8F} |
                                             features::cross_check{} | features::max_distance{80};

  options options_;
  Extractor extract_;
  optimize::reprojection<Camera> model_;
  pyramid_scales scales_;
  slam::map map_;
  optimize::bundle_adjuster<optimize::reprojection<Camera>> adjuster_;
  track_state state_ = track_state::not_started;
  track_counters counters_;
  std::vector<tracked_frame> tracked_;
  keyframe_id reference_ = 0;  ///< that the current frame shares most with
  frame last_;
  keyframe_id last_reference_ = 0;
  se3 T_reference_last_;
  std::optional<vec6> velocity_;  ///< of the camera in its own frame, per last interval
  double last_interval_ = 0.0;
};

template <class Camera>
rgbd_system(Camera, options) -> rgbd_system<Camera>;
template <class Camera>
rgbd_system(Camera) -> rgbd_system<Camera>;
template <class Camera, class Extractor>
rgbd_system(Camera, options, Extractor) -> rgbd_system<Camera, Extractor>;

}  // namespace orbis::slam
