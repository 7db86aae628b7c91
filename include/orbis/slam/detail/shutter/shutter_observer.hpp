// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation of the shutter from tracked frames.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/shutter/motion_refinement.hpp>
#include <orbis/slam/detail/shutter/shutter_estimation.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/measure.hpp>
#include <orbis/slam/shutter_estimate.hpp>

namespace orbis::slam::detail {

/// Compares each tracked frame with the last keyframes once the next frame has been tracked, because the motion is
/// determined from both neighbouring frames. Periodically proposes the resulting shutter.
template <class = void>
class basic_shutter_observer {
 public:
  /// `earlier`: see `options::earlier_estimate`.
  explicit basic_shutter_observer(const shutter_estimate& earlier)
      : estimate_{earlier, earlier}, decided_{earlier.observed} {
    if (earlier.observed > 0.0) last_ = estimate_;
  }

  [[nodiscard]] shutter_estimate estimate() const {
    shutter_estimate e = estimate_.reported;
    e.observed = std::max(watched_, e.observed);
    return e;
  }

  /// Adds a tracked frame that follows `last` (as tracked, with its current pose) in the map `m` with the id `map`.
  /// `keyframe`: the keyframe created from the frame, if any; `read`: reads the frame's depth image, also after the
  /// call. Returns the shutter to assume for subsequent frames, if it changes.
  template <feature_descriptor D, camera::camera_model Camera>
  [[nodiscard]] std::optional<camera::shutter> add(const basic_frame<D>& last, const basic_frame<D>& f,
                                                   const std::optional<map_keyframe>& keyframe, row_reader read,
                                                   map_id map, const basic_map<D>& m, const camera_rig<Camera>& rig,
                                                   const camera::shutter& assumed) {
    if (map != map_) {  // ids of keyframes and landmarks are valid in one map only
      views_.clear();
      interrupt();
      map_ = map;
    }
    const vec6 motion = motion_between(last, f);
    if (before_ && before_that_) {
      // The velocity at the boundary of two intervals, from the mean velocities of three intervals: exact for motions
      // that are cubic in time.
      pending_.T_world_camera = last.T_world_camera;
      pending_.twist = (-*before_that_ + 5.0 * *before_ + 2.0 * motion) / 6.0;
      read_depths();
      compare(m, rig, assumed);
      if (pending_keyframe_) keep(*pending_keyframe_);
    }
    before_that_ = before_;
    before_ = motion;
    set_pending(f, keyframe, rig);
    read_ = std::move(read);
    watched_ += f.timestamp - last.timestamp;
    return decide(assumed);
  }

  /// Records that the next frame does not follow the last one.
  void interrupt() {
    read_ = nullptr;
    before_.reset();
    before_that_.reset();
    pending_keyframe_.reset();
  }

 private:
  static constexpr std::size_t kept = 4;  ///< number of keyframes with which a frame is compared

  template <feature_descriptor D, camera::camera_model Camera>
  void set_pending(const basic_frame<D>& f, const std::optional<map_keyframe>& keyframe,
                   const camera_rig<Camera>& rig) {
    pending_.shutter = f.shutter;
    pending_.read.clear();
    pending_.landmarks.clear();
    pending_.information.clear();
    by_landmark_.clear();
    for (std::size_t i = 0; i != f.size(); ++i)
      if (f.landmarks[i] != no_id) by_landmark_.emplace_back(f.landmarks[i], i);
    std::sort(by_landmark_.begin(), by_landmark_.end());
    for (const auto& [landmark, i] : by_landmark_) {
      pending_.read.push_back(f.as_read[i]);
      pending_.landmarks.push_back(landmark);
      pending_.information.push_back(rig.scales.information(f.features.keypoints[i].octave));
    }
    pending_keyframe_ = keyframe;
  }

  /// Reads the depths of the pending frame with its final twist: the error of the twist assumed in tracking would
  /// shorten the estimated delay. Also sets their changes with the delay.
  void read_depths() {
    const auto read = [&](double later) {
      frame_motion motion{pending_.shutter, pending_.twist};
      motion.shutter.depth_delay += later;
      auto keypoints = pending_.read;
      read_(keypoints, motion);
      return keypoints;
    };
    const auto later = read(depth_change::step), earlier = read(-depth_change::step);
    read_(pending_.read, {pending_.shutter, pending_.twist});
    for (std::size_t i = 0; i != pending_.read.size(); ++i) {
      const float a = earlier[i].depth, b = pending_.read[i].depth, c = later[i].depth;
      if (a > 0.0F && b > 0.0F && c > 0.0F) pending_.read[i].change = {c - b, a - b};
    }
  }

  template <feature_descriptor D, camera::camera_model Camera>
  void compare(const basic_map<D>& m, const camera_rig<Camera>& rig, const camera::shutter& assumed) {
    for (auto& [id, view] : views_) {
      if (!m.has_keyframe(id.keyframe)) continue;
      view.T_world_camera = m.at(id.keyframe).T_world_camera;
      if (const auto e = build_shutter_equations(view, pending_, rig, assumed)) estimator_.add(id, *e);
    }
  }

  void keep(map_keyframe id) {
    if (views_.size() == kept) views_.erase(views_.begin());
    views_.emplace_back(id, pending_);
  }

  /// Revises the estimate each time the observation time has grown by half, and discards the measurements made with the
  /// previous shutter: the equations are valid only near the assumed values, and the gates of tracking are biased
  /// towards these values, so that several steps are needed.
  [[nodiscard]] std::optional<camera::shutter> decide(const camera::shutter& assumed) {
    constexpr double first = 2.0, often = 0.5, same = 0.001;  // seconds
    if (watched_ - looked_ < often) return std::nullopt;
    looked_ = watched_;
    const shutter_estimate now = estimator_.estimate(assumed);
    // After a change, the first estimates have few measurements; an earlier estimate has more until then.
    if (!last_ || (watched_ >= decided_ && now.read_out_deviation <= 2.0 * last_->linear.read_out_deviation))
      estimate_ = {now, with_distance(now, assumed)};
    else
      estimate_ = *last_;
    if (watched_ < std::max(first, 1.5 * decided_) || !std::isfinite(now.read_out_deviation)) return std::nullopt;
    decided_ = watched_;
    const camera::shutter& next = estimate_.linear.shutter;
    const double change = std::max(std::abs(next.color_read_out - assumed.color_read_out),
                                   std::abs(next.depth_delay - assumed.depth_delay));
    if (change < same) return std::nullopt;
    estimator_.clear();
    views_.clear();  // their depths were read assuming the previous delay
    interrupt();
    last_ = estimate_;
    return next;
  }

  /// Adds to the deviations for the distance from the assumed shutter, around which the equations were linearised. For
  /// TUM freiburg1_xyz, the first estimate is two thirds of the last one.
  [[nodiscard]] static shutter_estimate with_distance(shutter_estimate e, const camera::shutter& assumed) {
    constexpr double share = 0.5;
    e.read_out_deviation = std::hypot(e.read_out_deviation, share * (e.read_out - assumed.color_read_out));
    e.delay_deviation = std::hypot(e.delay_deviation, share * (e.delay - assumed.depth_delay));
    return e;
  }

  shutter_estimator estimator_;
  struct judged_estimate {
    shutter_estimate linear;    ///< with the deviations of the linear equations
    shutter_estimate reported;  ///< the deviations include the linearisation error
  };
  judged_estimate estimate_;
  std::optional<judged_estimate> last_;  ///< estimate at the last change of the shutter
  std::vector<std::pair<map_keyframe, row_view>> views_;
  row_view pending_;
  std::vector<std::pair<landmark_id, std::size_t>> by_landmark_;  ///< reused working memory
  row_reader read_;  ///< reads the depth image of the pending frame
  std::optional<map_keyframe> pending_keyframe_;
  map_id map_ = no_id;  ///< the map of the views and of the pending frame
  /// Mean twist in the interval before the pending frame, and in the interval before that one.
  std::optional<vec6> before_, before_that_;
  double watched_ = 0.0, looked_ = 0.0;  ///< seconds
  double decided_;                       ///< duration of the observation behind the assumed shutter, seconds
};
using shutter_observer = basic_shutter_observer<>;

}  // namespace orbis::slam::detail
