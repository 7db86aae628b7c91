// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The way of a camera that is carried once round a building and a little further; and ways of given poses.
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/trajectory.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>

#include "support/synthetic/world.hpp"

ORBIS_BEGIN_UNFUSED

namespace orbis::test {

/// How a camera is carried.
struct walk_options {
  double speed = 0.6;          ///< metres per second, once it goes; it starts and ends at rest
  double overlap = 2.0;        ///< seconds that it goes on along its way after coming back to where it began
  double corner_radius = 0.9;  ///< of the way round a corner, metres
  double foresight = 1.3;      ///< the camera begins to turn so many metres before a corner and ends as many after it
  double height = 1.45;        ///< of the camera above the floor, metres
  double pitch = -0.10;        ///< mean pitch, radians; negative looks down
  double look_aside = 0.0;     ///< radians from the way's direction, positive to the left
  double wobble = 1.0;         ///< scales the slow swaying in place and angles, which is the same in every round
  double jitter = 1.0;         ///< scales the trembling of the hand (millimetres, tenths of degrees), which is not
};

/// A closed way along legs that meet at right angles, with rounded corners. It begins at the middle of the first leg.
class walk {
 public:
  /// `corners`: metres, world, of which z does not count; the first leg goes from the first to the second.
  /// @pre at least 4 corners, legs along x or y that meet at right angles and are longer than 2 corner_radius;
  /// speed, corner_radius and foresight > 0, overlap >= 0
  walk(const walk_options& options, const std::vector<triple>& corners, std::uint64_t seed)
      : options_{options}, seed_{mix64(seed ^ 0x77616c6bULL)} {
    assert(corners.size() >= 4 && options.speed > 0.0 && options.corner_radius > 0.0 && options.foresight > 0.0);
    const std::size_t n = corners.size();
    const double r = options.corner_radius, arc = 1.5707963267948966 * r;
    const auto direction = [&](std::size_t i) {
      const triple leg = corners[(i + 1) % n] - corners[i % n];
      return (1.0 / length({leg.x, leg.y, 0.0})) * triple{leg.x, leg.y, 0.0};
    };
    const triple first = direction(0);
    heading_ = first.x > 0.5 ? 0.0 : (first.y > 0.5 ? 0.25 : (first.x < -0.5 ? 0.5 : 0.75));
    triple at = 0.5 * (corners[0] + corners[1]);
    at.z = 0.0;
    for (std::size_t i = 0; i != n; ++i) {
      const triple d = direction(i), next = direction(i + 1);
      const triple corner{corners[(i + 1) % n].x, corners[(i + 1) % n].y, 0.0};
      const double straight = dot(d, corner - at) - r;
      assert(straight >= 0.0 && dot(d, next) < 1e-9 && dot(d, next) > -1e-9);
      pieces_.push_back({length_, straight, at, d, 0.0});
      pieces_.push_back({length_ + straight, arc, corner - r * d, d, cross(d, next).z > 0.0 ? 0.25 : -0.25});
      length_ += straight + arc;
      at = corner + r * next;
    }
    const triple d = direction(n);
    const triple end = 0.5 * (corners[0] + corners[1]);
    const double straight = dot(d, triple{end.x, end.y, 0.0} - at);
    assert(straight >= 0.0);
    pieces_.push_back({length_, straight, at, d, 0.0});
    length_ += straight;
    for (const piece& p : pieces_) round_ += p.turn;
    way_ = length_ + options.overlap * options.speed;
  }

  /// Of one round, metres.
  [[nodiscard]] double length_of_round() const noexcept { return length_; }
  /// Seconds.
  [[nodiscard]] double duration() const noexcept { return way_ / options_.speed + ramp; }
  /// When the camera is back where it began, seconds.
  [[nodiscard]] double time_of_round() const noexcept {
    return std::min(length_ / options_.speed + 0.5 * ramp, duration());
  }

  /// The pose `time` seconds after the beginning. World: z up, the floor at z = 0. O(corners)
  [[nodiscard]] camera_pose at(double time) const noexcept {
    const double along = travelled(time), lap = along / length_;
    const auto sway = [&](double amplitude, int harmonic, double phase) {
      return options_.wobble * amplitude * sin_turns(static_cast<double>(harmonic) * lap + phase);
    };
    const auto tremble = [&](double amplitude, std::uint64_t stream) {
      return options_.jitter * amplitude *
             (smooth_noise(seed_, stream, 3.0 * time) + 0.4 * smooth_noise(seed_, stream + 50, 9.0 * time));
    };
    const triple here = place(along - length_ * static_cast<double>(floor_to_int(lap)));
    const double ahead = heading(along);  // turns more evenly than the way itself
    const double aside = sway(0.06, 5, 0.15) + sway(0.02, 13, 0.4);
    camera_pose pose;
    pose.position = {here.x - aside * sin_turns(ahead) + tremble(0.004, 0),
                     here.y + aside * cos_turns(ahead) + tremble(0.004, 1),
                     options_.height + sway(0.04, 7, 0.3) + sway(0.015, 23, 0.8) + tremble(0.004, 2)};
    constexpr double turns_per_radian = 0.15915494309189535;
    const double yaw =
        ahead + turns_per_radian * (options_.look_aside + sway(0.12, 6, 0.7) + sway(0.03, 17, 0.2) + tremble(0.006, 3));
    const double pitch =
        turns_per_radian * (options_.pitch + sway(0.08, 8, 0.45) + sway(0.02, 19, 0.15) + tremble(0.006, 4));
    const double roll = turns_per_radian * (sway(0.03, 7, 0.55) + sway(0.02, 16, 0.35) + tremble(0.006, 5));
    orient(pose, yaw, pitch, roll);
    return pose;
  }

 private:
  static constexpr double ramp = 1.0;  // seconds from rest to full speed

  /// A straight, or a quarter of a circle.
  struct piece {
    double begin, length;  // along the way
    triple from, direction;
    double turn;  // to the left, in turns
  };

  /// How many metres of the way are behind the camera.
  [[nodiscard]] double travelled(double time) const noexcept {
    const double t = std::clamp(time, 0.0, duration()), left = duration() - t;
    if (t < ramp && t < left) return 0.5 * options_.speed * t * t / ramp;
    if (left < ramp) return way_ - 0.5 * options_.speed * left * left / ramp;
    return options_.speed * (t - 0.5 * ramp);
  }

  [[nodiscard]] triple place(double along) const noexcept {
    std::size_t i = 0;
    while (i + 1 < pieces_.size() && pieces_[i + 1].begin <= along) ++i;
    const piece& p = pieces_[i];
    const double d = along - p.begin;
    if (p.turn == 0.0) return p.from + d * p.direction;
    const double side = p.turn > 0.0 ? 1.0 : -1.0, angle = 0.25 * d / p.length;
    const triple inward{-side * p.direction.y, side * p.direction.x, 0.0};
    const double s = sin_turns(angle), c = cos_turns(angle), r = options_.corner_radius;
    return p.from + r * s * p.direction + r * (1.0 - c) * inward;
  }

  /// Where the way leads, in turns: the mean over what is a little ahead and behind.
  [[nodiscard]] double heading(double along) const noexcept {
    const double reach = options_.foresight;
    // The integral of a ramp from 0 to 1 over [0, length].
    const auto integral = [](double x, double length) {
      if (x <= 0.0) return 0.0;
      return x < length ? 0.5 * x * x / length : x - 0.5 * length;
    };
    double turned = heading_ - round_;  // by the round before the first
    const auto last = floor_to_int((along + reach) / length_);
    for (std::int64_t lap = -1; lap <= last; ++lap)
      for (const piece& p : pieces_) {
        if (p.turn == 0.0) continue;
        const double x = along - (p.begin + length_ * static_cast<double>(lap));
        turned += p.turn * (integral(x + reach, p.length) - integral(x - reach, p.length)) / (2.0 * reach);
      }
    return turned;
  }

  walk_options options_;
  std::uint64_t seed_;
  std::vector<piece> pieces_;
  double heading_ = 0.0;  // at the beginning, turns
  double round_ = 0.0;    // how far a round turns, turns
  double length_ = 0.0, way_ = 0.0;
};

/// Given poses, with even motion from each to the next; time counts from the first of them.
class posed_path {
 public:
  /// @pre !poses.empty(), in the order of time
  explicit posed_path(trajectory poses) : poses_{std::move(poses)} { assert(!poses_.empty()); }

  /// Seconds.
  [[nodiscard]] double duration() const noexcept { return poses_.back().timestamp - poses_.front().timestamp; }

  /// The pose `time` seconds after the first; that of an end beyond it. O(log poses)
  [[nodiscard]] camera_pose at(double time) const noexcept {
    const double t = time + poses_.front().timestamp;
    const auto next = std::lower_bound(poses_.begin(), poses_.end(), t,
                                       [](const stamped_pose& p, double when) { return p.timestamp < when; });
    if (next == poses_.begin()) return between_poses(poses_.front(), poses_.front(), 0.0);
    if (next == poses_.end()) return between_poses(poses_.back(), poses_.back(), 0.0);
    const stamped_pose& last = *(next - 1);
    return between_poses(last, *next, (t - last.timestamp) / (next->timestamp - last.timestamp));
  }

 private:
  /// Places on a straight line, rotations on the chord between their quaternions.
  [[nodiscard]] static camera_pose between_poses(const stamped_pose& a, const stamped_pose& b, double f) noexcept {
    camera_pose pose;
    const triple from = to_triple(a.T_world_camera.translation()), to = to_triple(b.T_world_camera.translation());
    pose.position = from + f * (to - from);
    const auto p = a.T_world_camera.rotation().unit_quaternion(), q = b.T_world_camera.rotation().unit_quaternion();
    const triple pv{p.x(), p.y(), p.z()}, qv{q.x(), q.y(), q.z()};
    const double g = p.w() * q.w() + dot(pv, qv) < 0.0 ? -f : f;
    const double w = (1.0 - f) * p.w() + g * q.w();
    const triple v = (1.0 - f) * pv + g * qv;
    const double scale = 1.0 / std::sqrt(w * w + dot(v, v));
    set_rotation(pose, {scale * w, scale * v});
    return pose;
  }

  trajectory poses_;
};

/// A body's way across the view of a camera that goes its own: evenly from one place to another, both as the camera
/// sees them at that moment. The default crosses from left to right; in a corridor a body rather comes towards the
/// camera: from {4.0, 0.3} to {0.3, 0.6}.
struct crossing {
  struct place {
    double ahead, left;  ///< metres from the camera, along the floor
  };
  double begin = 0.0, end = 4.0;  ///< seconds
  place from{1.1, 1.1};
  place to{1.1, -1.1};
};

namespace detail {

/// In front of a camera: `ahead` and `left` of it in metres, at the height of the floor.
[[nodiscard]] inline triple on_floor(const camera_pose& pose, double ahead, double left) noexcept {
  const triple f{pose.forward.x, pose.forward.y, 0.0};
  const double n = length(f);
  const triple forward = n > 1e-9 ? (1.0 / n) * f : triple{1.0, 0.0, 0.0};
  return {pose.position.x + ahead * forward.x - left * forward.y,
          pose.position.y + ahead * forward.y + left * forward.x, 0.0};
}

}  // namespace detail

}  // namespace orbis::test

ORBIS_END_UNFUSED

namespace orbis::test {

/// The pose of a camera by time.
template <class P>
concept camera_motion = requires(const P& path, double time) {
  { path.at(time) } -> std::convertible_to<camera_pose>;
  { path.duration() } -> std::convertible_to<double>;
};

/// Where a body is that crosses the view of a camera on `path`, ten times a second. @pre begin <= end
template <camera_motion Path>
[[nodiscard]] std::vector<whereabouts> way_across(const Path& path, const crossing& c) {
  std::vector<whereabouts> way;
  const int steps = std::max(1, static_cast<int>(10.0 * (c.end - c.begin) + 0.5));
  for (int i = 0; i <= steps; ++i) {
    const double f = static_cast<double>(i) / steps, time = c.begin + f * (c.end - c.begin);
    const double ahead = c.from.ahead + f * (c.to.ahead - c.from.ahead);
    const double left = c.from.left + f * (c.to.left - c.from.left);
    way.push_back({time, detail::on_floor(path.at(time), ahead, left), 0.1 * f});
  }
  return way;
}

}  // namespace orbis::test
