// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A constant-velocity model of the camera motion between frames.
#pragma once

#include <algorithm>
#include <optional>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::slam::detail {

/// A pose with its timestamp.
struct timed_pose {
  double timestamp = 0.0;  ///< seconds
  se3 T_world_camera;
};

/// Predicts poses from the motion between the last two frames, which is unknown at first.
class motion_model {
 public:
  /// Marks the motion as unknown.
  void reset() { velocity_.reset(); }
  /// Sets the motion to that between two frames.
  void set(const timed_pose& before, const timed_pose& after) {
    velocity_ = (before.T_world_camera.inverse() * after.T_world_camera).log();
    interval_ = after.timestamp - before.timestamp;
  }
  /// Rescales the motion after a scale correction.
  void scale_by(double factor) {
    if (velocity_) velocity_->head<3>() *= factor;
  }
  [[nodiscard]] bool is_known() const noexcept { return velocity_.has_value(); }
  /// The twist of the camera in its own frame, per second; zero if it is unknown.
  [[nodiscard]] vec6 twist() const {
    return velocity_ && interval_ > 0.0 ? vec6(*velocity_ / interval_) : vec6(zeros<vec6>());
  }

  /// Predicts `T_world_camera` at `timestamp` by continuing the motion from `last`, for at most three times the last
  /// interval; returns the pose of `last` if the motion is unknown.
  [[nodiscard]] se3 predict(const timed_pose& last, double timestamp) const {
    if (!velocity_) return last.T_world_camera;
    const double ratio = interval_ > 0.0 ? (timestamp - last.timestamp) / interval_ : 1.0;
    return last.T_world_camera * se3::exp(std::clamp(ratio, 0.0, 3.0) * *velocity_);
  }

 private:
  std::optional<vec6> velocity_;  ///< twist of the camera in its own frame, per `interval_`
  double interval_ = 0.0;         ///< seconds
};

}  // namespace orbis::slam::detail
