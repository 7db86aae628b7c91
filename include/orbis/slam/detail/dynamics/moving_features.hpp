// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Features on moving objects, which are tracked from frame to frame and excluded from all other steps.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/windowed.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/dynamics/motion_split.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/options.hpp>

namespace orbis::slam::detail {

/// Removes features of a frame, keeping the order of the others. `leave_out`: one entry per feature, nonzero for those
/// to remove.
template <feature_descriptor D>
void remove_features(basic_frame<D>& f, std::span<const std::uint8_t> leave_out) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i != f.size(); ++i) {
    if (leave_out[i] != 0) continue;
    f.features.keypoints[kept] = f.features.keypoints[i];
    f.features.descriptors[kept] = f.features.descriptors[i];
    f.depth[kept] = f.depth[i];
    f.rays[kept] = f.rays[i];
    f.landmarks[kept] = f.landmarks[i];
    if (!f.spreads.empty()) f.spreads[kept] = f.spreads[i];
    if (!f.as_read.empty()) f.as_read[kept] = f.as_read[i];
    ++kept;
  }
  f.features.keypoints.resize(kept);
  f.features.descriptors.resize(kept);
  f.depth.resize(kept);
  f.rays.resize(kept);
  f.landmarks.resize(kept);
  if (!f.spreads.empty()) f.spreads.resize(kept);
  if (!f.as_read.empty()) f.as_read.resize(kept);
  f.grid = features::keypoint_grid(f.features.keypoints);
}

/// The features on moving objects in the last frame. Call for each frame: `find`, then `judge` on matches of static
/// features, `spread` when the pose is known, and `take_out` at the end. As long as nothing moves, each of these
/// functions returns immediately and changes nothing.
///
/// When a second motion is found, its features are excluded from that frame onwards. A feature is matched by its
/// appearance near the position predicted by its image motion, and its world position is compared with an earlier one.
/// Features of unknown motion around moving ones are excluded as well. An object that stops remains excluded for a
/// while (`moving_options::hold`), in case it moves again.
template <camera::camera_model Camera, feature_descriptor D, tracking_matchers<D> Matchers>
class moving_features {
 public:
  moving_features(const camera_rig<Camera>& rig, const options& settings) : rig_{rig}, options_{settings} {}

  /// Forgets all moving features.
  void clear() {
    tracks_.clear();
    next_.clear();
    is_left_out_.clear();
    trusts_old_only_ = false;
  }
  [[nodiscard]] bool is_enabled() const noexcept { return options_.moving.enabled; }
  /// The number of excluded features of the last frame.
  [[nodiscard]] std::size_t size() const noexcept { return tracks_.size(); }
  /// The positions of the excluded features, pixels.
  [[nodiscard]] std::vector<vec2> pixels() const {
    std::vector<vec2> all;
    for (const track& t : tracks_) all.emplace_back(static_cast<double>(t.at.x), static_cast<double>(t.at.y));
    return all;
  }

  /// Finds the moving features of the last frame in the next one.
  void find(const basic_frame<D>& f) {
    is_left_out_.clear();
    next_.clear();
    trusts_old_only_ = false;
    if (tracks_.empty()) return;
    is_left_out_.assign(f.size(), 0);
    agrees_.assign(f.size(), 0);
    std::vector<D> descriptors;
    std::vector<features::keypoint> keypoints;
    std::vector<features::window> windows;
    for (const track& t : tracks_) {
      descriptors.push_back(t.descriptor);
      keypoints.push_back(t.at);
      windows.push_back({t.at.x + t.flow_x, t.at.y + t.flow_y,
                         static_cast<float>(options_.motion_radius * rig_.scales.scale(t.at.octave)), t.at.octave - 1,
                         t.at.octave + 1});
    }
    for (const features::match& m :
         Matchers::motion(features::feature_view<D>{keypoints, descriptors}, f.features, windows, f.grid)) {
      track t = tracks_[m.query];
      const features::keypoint& k = f.features.keypoints[m.train];
      t.flow_x = k.x - t.at.x;
      t.flow_y = k.y - t.at.y;
      t.at = k;
      t.descriptor = f.features.descriptors[m.train];
      t.feature = m.train;
      is_left_out_[m.train] = 1;
      next_.push_back(std::move(t));
    }
  }

  /// Removes the matches of excluded features.
  void remove_excluded(std::vector<features::match>& matches) const {
    if (is_left_out_.empty()) return;
    std::erase_if(matches, [&](const features::match& m) { return is_left_out_[m.train] != 0; });
  }

  /// Searches for a second motion after a frame's pose has been refined on the matches of `list`, if many of them
  /// disagree or a moving object may bias the pose. If one is found, replaces the pose and landmarks of the frame.
  /// Returns the number of matches that agree.
  std::size_t judge(basic_frame<D>& f, const basic_map<D>& m, const search_list<D>& list,
                    std::span<const features::match> matches, std::size_t inliers, const se3& predicted) {
    if (!is_enabled() || inliers == 0) return inliers;
    const std::size_t agreeing = split_motions(f, m, list, matches, inliers, predicted);
    if (next_.empty()) return agreeing;
    agrees_.assign(f.size(), 0);
    const se3 T_camera_world = f.T_world_camera.inverse();
    for (const features::match& found : matches)
      agrees_[found.train] = agrees(rig_, f, T_camera_world, found.train, list.points[found.query].position) ? 1 : 0;
    return agreeing;
  }

  /// Sets the pose of the last frame.
  void set_last(const se3& T_world_camera) { T_world_last_ = T_world_camera; }

  /// Returns true if a landmark must be excluded from the search in the current frame because it is new and may be
  /// moving.
  [[nodiscard]] bool is_excluded(const basic_map<D>& m, landmark_id id, double now) const {
    return trusts_old_only_ && landmark_trust(m, id, now) < enough_trust;
  }

  /// Excludes features that are nearer to moving features than to features that agree with the pose.
  void spread(const basic_frame<D>& f) {
    if (next_.empty()) return;
    struct labelled {
      vec3 point;
      float x, y;
      const track* moves;
    };
    std::vector<labelled> known;
    for (const track& t : next_)
      if (t.has_moved)
        known.push_back({f.has_depth(t.feature) ? f.point_camera(t.feature) : filled<vec3>(1e9), t.at.x, t.at.y, &t});
    if (known.size() < options_.moving.min_features / 2) return;
    for (std::size_t i = 0; i != f.size(); ++i)
      if (agrees_[i] != 0 && is_left_out_[i] == 0)
        known.push_back({f.has_depth(i) ? f.point_camera(i) : filled<vec3>(1e9), f.features.keypoints[i].x,
                         f.features.keypoints[i].y, nullptr});
    std::vector<track> more;
    for (std::size_t i = 0; i != f.size(); ++i) {
      if (is_left_out_[i] != 0 || agrees_[i] != 0) continue;
      const features::keypoint& k = f.features.keypoints[i];
      const bool deep = f.has_depth(i);
      const vec3 p = deep ? f.point_camera(i) : zeros<vec3>();
      constexpr double pixels = 25.0;
      double nearest = deep ? options_.moving.reach * options_.moving.reach : pixels * pixels;
      const track* by = nullptr;
      for (const labelled& l : known) {
        const auto dx = static_cast<double>(l.x - k.x), dy = static_cast<double>(l.y - k.y);
        const double d = deep ? squared_norm(l.point - p) : dx * dx + dy * dy;
        if (d < nearest) nearest = d, by = l.moves;
      }
      if (by == nullptr) continue;
      track t;
      t.feature = i;
      t.at = k;
      t.descriptor = f.features.descriptors[i];
      t.flow_x = by->flow_x;
      t.flow_y = by->flow_y;
      t.moved = f.timestamp;
      more.push_back(std::move(t));
    }
    for (track& t : more) {
      is_left_out_[t.feature] = 1;
      next_.push_back(std::move(t));
    }
  }

  /// Removes the moving features from a frame whose pose is known, and keeps them for the next frame.
  void take_out(basic_frame<D>& f) {
    std::swap(tracks_, next_);
    next_.clear();
    if (tracks_.empty()) return;
    const moving_options& o = options_.moving;
    const se3 T_camera_world = f.T_world_camera.inverse();
    std::size_t moved = 0, proved = 0;
    for (track& t : tracks_) {
      const bool deep = f.has_depth(t.feature);
      if (!t.has_anchor || f.timestamp - t.anchored > anchor_time) {
        t.has_anchor = deep;
        if (deep) t.anchor = f.point_world(t.feature);
        t.anchored = f.timestamp;
      } else if (away(f, T_camera_world, t)) {
        t.moved = f.timestamp;
        t.has_moved = true;
        t.has_anchor = false;
      }
      moved += t.has_moved && f.timestamp - t.moved <= 1.5 * anchor_time;
      proved += t.has_moved;
    }
    if (moved >= o.min_features / 2 && 4 * moved >= proved) moved_ = f.timestamp;
    const bool moves_now = moved_ == f.timestamp;
    std::erase_if(tracks_, [&](const track& t) {
      const bool rests = f.timestamp - t.moved > (t.has_moved ? 4.0 : 2.0) * anchor_time && moves_now;
      const bool stays = rests || f.timestamp - moved_ > o.hold;
      if (stays) is_left_out_[t.feature] = 0;
      return stays;
    });
    remove_features(f, std::span<const std::uint8_t>(is_left_out_));
    is_left_out_.clear();
  }

 private:
  static constexpr double anchor_time = 0.25;  ///< age above which an anchor is replaced, seconds

  struct track {
    std::size_t feature = 0;  ///< index in the current frame
    features::keypoint at;
    D descriptor{};
    float flow_x = 0.0F, flow_y = 0.0F;  ///< displacement since the previous frame, pixels
    vec3 anchor = zeros<vec3>();         ///< an earlier position in the world frame
    double anchored = 0.0;               ///< time of the anchor, seconds
    double moved = 0.0;                  ///< time of the last motion, or of the first observation, seconds
    bool has_anchor = false;
    bool has_moved = false;  ///< true if it has moved; false if it is excluded because of its neighbours
  };

  std::size_t split_motions(basic_frame<D>& f, const basic_map<D>& m, const search_list<D>& list,
                            std::span<const features::match> matches, std::size_t inliers, const se3& predicted) {
    std::vector<optimize::pose_observation> observations;
    std::vector<double> trust;
    std::vector<std::uint8_t> outliers(matches.size(), 1);
    for (const auto& found : matches) {
      const candidate_point& p = list.points[found.query];
      observations.push_back(make_observation(rig_, f, found.train, p.position));
      trust.push_back(landmark_trust(m, p.landmark, f.timestamp));
    }
    if (!may_hold_two_motions(matches.size(), inliers, options_.moving) &&
        !motion_splitter<Camera>::is_biased_by_motion(observations, trust, rig_.model, f.T_world_camera,
                                                      options_.moving))
      return inliers;
    const se3 T_camera_world = f.T_world_camera.inverse();
    for (std::size_t i = 0; i != matches.size(); ++i)
      outliers[i] = agrees(rig_, f, T_camera_world, matches[i].train, observations[i].point) ? 0 : 1;
    const auto split = motion_splitter<Camera>::split(observations, trust, rig_.model, predicted, f.T_world_camera,
                                                      outliers, options_.moving, options_.seed);
    if (!split) return inliers;
    f.T_world_camera = split->T_world_camera;
    f.landmarks.assign(f.size(), no_id);
    trusts_old_only_ = split->by_trust;
    if (is_left_out_.empty()) is_left_out_.assign(f.size(), 0);
    for (std::size_t i = 0; i != matches.size(); ++i) {
      const candidate_point& p = list.points[matches[i].query];
      const std::size_t j = matches[i].train;
      if (split->outliers[i] == 0) f.landmarks[j] = p.landmark;
      if (split->moving[i] == 0 || is_left_out_[j] != 0) continue;
      is_left_out_[j] = 1;
      track t;
      t.feature = j;
      t.at = f.features.keypoints[j];
      t.descriptor = f.features.descriptors[j];
      if (const auto before = rig_.camera().project(T_world_last_.inverse() * p.position)) {
        t.flow_x = t.at.x - static_cast<float>(before->x());
        t.flow_y = t.at.y - static_cast<float>(before->y());
      }
      t.moved = f.timestamp;
      t.has_moved = true;
      next_.push_back(std::move(t));
    }
    return split->inliers;
  }

  /// Returns true if a feature is clearly not at its earlier position. Only pixels are compared: depth is discontinuous
  /// at the edge of an object.
  [[nodiscard]] bool away(const basic_frame<D>& f, const se3& T_camera_world, const track& t) const {
    const auto expected = rig_.camera().project(T_camera_world * t.anchor);
    if (!expected) return false;
    const double information = rig_.scales.information(t.at.octave);
    return squared_norm(*expected - f.pixel(t.feature)) * information > 2.0 * error_limit(false);
  }

  /// Returns the confidence that a landmark is static, based on its age.
  [[nodiscard]] double landmark_trust(const basic_map<D>& m, landmark_id id, double now) const {
    if (id == no_id) return 0.0;
    const keyframe_id by = m.landmark_at(id).created;
    if (!m.has_keyframe(by)) return 1.0;
    return std::clamp((now - m.at(by).timestamp) / options_.moving.seasoned, 0.0, 1.0);
  }

  const camera_rig<Camera>& rig_;
  const options& options_;
  std::vector<track> tracks_, next_;       ///< tracks of the last and of the current frame
  std::vector<std::uint8_t> is_left_out_;  ///< for each feature of the current frame; empty: none is excluded
  std::vector<std::uint8_t> agrees_;       ///< for each feature: 1 if it agrees with the pose of the static scene
  bool trusts_old_only_ = false;           ///< true if only old landmarks are trusted in the current frame
  double moved_ = 0.0;                     ///< time of the last motion, seconds
  se3 T_world_last_;
};

}  // namespace orbis::slam::detail
