// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The motion of the camera between frames, assumed to be constant.
#pragma once

#include <algorithm>
#include <optional>

#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>

namespace orbis::slam::detail {

/// A pose at a time.
struct timed_pose {
  double timestamp = 0.0;  ///< seconds
  se3 T_world_camera;
};

/// Predicts poses by the motion between the last two frames. Unknown at first.
class motion_model {
 public:
  /// The motion is not known.
  void reset() { velocity_.reset(); }
  /// The motion is the one between two frames.
  void set(const timed_pose& before, const timed_pose& after) {
    velocity_ = (before.T_world_camera.inverse() * after.T_world_camera).log();
    interval_ = after.timestamp - before.timestamp;
  }
  /// Lengths are so many times what they were.
  void scale_by(double factor) {
    if (velocity_) velocity_->head<3>() *= factor;
  }
  [[nodiscard]] bool is_known() const noexcept { return velocity_.has_value(); }

  /// `T_world_camera` at `timestamp` if the motion goes on from `last`, for three times the last interval at most;
  /// `last` itself if the motion is not known.
  [[nodiscard]] se3 predict(const timed_pose& last, double timestamp) const {
    if (!velocity_) return last.T_world_camera;
    const double ratio = interval_ > 0.0 ? (timestamp - last.timestamp) / interval_ : 1.0;
    return last.T_world_camera * se3::exp(std::clamp(ratio, 0.0, 3.0) * *velocity_);
  }

 private:
  std::optional<vec6> velocity_;  ///< of the camera in its own frame, per interval
  double interval_ = 0.0;         ///< seconds
};

}  // namespace orbis::slam::detail
