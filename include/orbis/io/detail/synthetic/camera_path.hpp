// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Path of a hand-held or robot-mounted camera around a room, in one or two rounds.
#pragma once

#include <algorithm>
#include <cstdint>

#include <orbis/core/se3.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/synthetic_options.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// A camera's position and the columns of its rotation: right, down and forward in the world frame.
struct camera_pose {
  triple position;
  triple right, down, forward;
  double qw = 1.0;  ///< the same rotation, as a unit quaternion
  triple q;

  /// The pose `T_world_camera`.
  [[nodiscard]] se3 T_world_camera() const { return {so3{so3::quaternion(qw, q.x, q.y, q.z)}, to_vec3(position)}; }
};

struct quaternion {
  double w;
  triple v;
  [[nodiscard]] friend quaternion operator*(quaternion a, quaternion b) noexcept {
    return {a.w * b.w - dot(a.v, b.v), a.w * b.v + b.w * a.v + cross(a.v, b.v)};
  }
};

/// Sets the rotation of `pose` from its unit quaternion.
inline void set_rotation(camera_pose& pose, quaternion r) noexcept {
  const double w = r.w, x = r.v.x, y = r.v.y, z = r.v.z;
  pose.right = {1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)};
  pose.down = {2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)};
  pose.forward = {2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)};
  pose.qw = w;
  pose.q = r.v;
}

/// Rotates a camera: `yaw` from the world's x axis towards y, `pitch` upward, `roll` about the optical axis; all angles
/// are in turns.
inline void orient(camera_pose& pose, double yaw, double pitch, double roll) noexcept {
  const quaternion about_up{cos_turns(0.5 * yaw), {0.0, 0.0, sin_turns(0.5 * yaw)}};
  const quaternion about_side{cos_turns(0.5 * pitch), {0.0, -sin_turns(0.5 * pitch), 0.0}};
  const quaternion axes{0.5, {-0.5, 0.5, -0.5}};  // camera z forward -> world x, camera y down -> world -z
  const quaternion about_view{cos_turns(0.5 * roll), {0.0, 0.0, sin_turns(0.5 * roll)}};
  set_rotation(pose, about_up * about_side * axes * about_view);
}

/// The path of the camera: its pose as a function of time.
class camera_path {
 public:
  /// @pre duration > 0 (seconds), 0 <= overlap < 0.5, step_rate >= 0, impact_duration > 0
  camera_path(const synthetic_path_options& options, std::uint64_t seed, double duration) noexcept
      : options_{options}, seed_{mix64(seed ^ 0x70617468ULL)}, duration_{duration} {
    start_ = upper_fraction(noise_word(seed_, 99, 0));
  }

  /// Duration in seconds.
  [[nodiscard]] double duration() const noexcept { return duration_; }

  /// The pose `time` seconds after the start. World: z up, the floor at z = 0.
  [[nodiscard]] camera_pose at(double time) const noexcept {
    const double trip = options_.rounds() * progress(time / duration_), turn = start_ + trip;
    const double inward = options_.sees_floor ? inwardness(trip - 1.0) : 0.0;
    const auto sway = [&](double amplitude, int harmonic, double phase) {
      return options_.wobble * amplitude * sin_turns(static_cast<double>(harmonic) * turn + phase);
    };
    const auto tremble = [&](double amplitude, std::uint64_t stream) {
      return options_.jitter * amplitude *
             (smooth_noise(seed_, stream, 3.0 * time) + 0.4 * smooth_noise(seed_, stream + 50, 9.0 * time));
    };
    const body_motion body = body_at(time);
    const double reach = 1.0 + sway(0.08, 3, 0.1) + sway(0.015, 7, 0.6) + 0.6 * inward;
    camera_pose pose;
    pose.position = {reach * options_.semi_axis_x * cos_turns(turn) + tremble(0.004, 0),
                     reach * options_.semi_axis_y * sin_turns(turn) + tremble(0.004, 1),
                     options_.height + sway(0.10, 2, 0.3) + sway(0.02, 11, 0.8) + tremble(0.004, 2) + body.height};
    constexpr double turns_per_radian = 0.15915494309189535;
    const double yaw =
        turn - 0.5 * inward + sway(0.035, 2, 0.7) + sway(0.008, 5, 0.2) + turns_per_radian * tremble(0.006, 3);
    const double pitch = turns_per_radian * (options_.pitch - 0.35 * inward + sway(0.09, 3, 0.45) +
                                             sway(0.02, 8, 0.15) + tremble(0.006, 4) + body.pitch);
    const double roll = turns_per_radian * (sway(0.05, 2, 0.55) + sway(0.02, 6, 0.35) + tremble(0.006, 5) + body.roll);
    orient(pose, yaw, pitch, roll);
    return pose;
  }

 private:
  /// Motion of a walking body: height in metres, angles in radians.
  struct body_motion {
    double height = 0.0, pitch = 0.0, roll = 0.0;
  };

  [[nodiscard]] body_motion body_at(double time) const noexcept {
    const synthetic_gait_options& gait = options_.gait;
    if (gait.step_rate == 0.0) return {};
    const double steps = gait.step_rate * time + upper_fraction(noise_word(seed_, 100, 0));
    const std::int64_t step = floor_to_int(steps);
    const double since = (steps - static_cast<double>(step)) / gait.step_rate;  // time since the impact, seconds
    const double fading = std::max(0.0, 1.0 - since / gait.impact_duration);
    const double strength = 0.5 + upper_fraction(noise_word(seed_, 101, static_cast<std::uint64_t>(step)));
    const double shake = strength * fading * fading * fading * sin_turns(gait.impact_frequency * since);
    const double side = step % 2 == 0 ? 1.0 : -1.0;  // left or right foot
    const double speed = speed_at(time / duration_);
    return {speed * (gait.impact * shake - gait.bounce * cos_turns(steps)),
            speed * (gait.impact_angle * shake + gait.pitch * sin_turns(steps)),
            speed * (side * gait.impact_angle * shake + gait.roll * sin_turns(0.5 * steps))};
  }

  /// View direction at the fraction `s` of the second round: 0 is outward, 1 is inward. Changes smoothly in the first
  /// and last quarter of the round.
  [[nodiscard]] static double inwardness(double s) noexcept {
    const double t = std::clamp(4.0 * std::min(s, 1.0 - s), 0.0, 1.0);
    return t * t * (3.0 - 2.0 * t);
  }
  /// Completed fraction of the path after the fraction `s` of the time: acceleration, uniform motion, deceleration,
  /// rest.
  [[nodiscard]] double progress(double s) const noexcept {
    const double t = std::clamp(s / (1.0 - options_.overlap), 0.0, 1.0);
    constexpr double speed = 1.0 / (1.0 - ramp);
    if (t < ramp) return 0.5 * speed * t * t / ramp;
    if (t > 1.0 - ramp) return 1.0 - 0.5 * speed * (1.0 - t) * (1.0 - t) / ramp;
    return speed * (t - 0.5 * ramp);
  }
  /// Speed of `progress`, relative to its maximum.
  [[nodiscard]] double speed_at(double s) const noexcept {
    const double t = std::clamp(s / (1.0 - options_.overlap), 0.0, 1.0);
    return std::min({1.0, t / ramp, (1.0 - t) / ramp});
  }

  static constexpr double ramp = 0.06;  ///< fraction of the motion's time for acceleration, and again for deceleration

  synthetic_path_options options_;
  std::uint64_t seed_;
  double duration_;
  double start_;
};

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
