// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Conversion of a path to a timed trajectory within bounds on speed and acceleration.
///
/// @code
///   const auto path = orbis::nav::find_path(view, start, goal);
///   const auto motion = orbis::nav::make_trajectory(view, path.points, {.speed = 0.8, .acceleration = 1.5});
///   for (double t = 0.0; t < motion.duration(); t += 0.01) steer(motion.at(t));
/// @endcode
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include <orbis/core/inline.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/planning_space.hpp>

namespace orbis::nav {

struct motion_limits {
  double speed = 1.0;         ///< metres / second
  double acceleration = 1.0;  ///< magnitude in any direction, metres / second^2
};

/// State of a moving robot at one instant.
struct motion_state {
  vec3 position = zeros<vec3>();      ///< metres
  vec3 velocity = zeros<vec3>();      ///< metres / second
  vec3 acceleration = zeros<vec3>();  ///< metres / second^2
};

/// A piece of a path, parameterised from 0 to `length`: a straight line along `direction`, or a corner that turns
/// from `direction` to `turned`. In a corner, with l = parameter / length, the derivative turns from one unit vector to
/// the other,
///
///     q' = (1 - w) direction + w turned,    w = l^2 (3 - 2 l),
///
/// so that |q'| <= 1, and with q'' = 0 at both ends: lines and corners join with continuous velocity and curvature. A
/// corner is a Bezier curve of degree 4. It replaces two straight legs of `length` / 2 each; its control points are the
/// point where the legs meet, and the middle and the other end of each leg (see corner_points).
struct path_piece {
  vec3 start = zeros<vec3>();
  vec3 direction = vec3(1.0, 0.0, 0.0), turned = vec3(1.0, 0.0, 0.0);  ///< unit vectors
  double length = 0.0;

  [[nodiscard]] vec3 position(double s) const {
    const double l = s / length, w = l * l * l * (1.0 - 0.5 * l);  // the integral over l
    return start + length * ((l - w) * direction + w * turned);
  }
  /// The first derivative q'.
  [[nodiscard]] vec3 first(double s) const {
    const double l = s / length, w = l * l * (3.0 - 2.0 * l);
    return (1.0 - w) * direction + w * turned;
  }
  /// The second derivative q''.
  [[nodiscard]] vec3 second(double s) const {
    const double l = s / length;
    return 6.0 * l * (1.0 - l) / length * (turned - direction);
  }
  /// The control points of a corner.
  [[nodiscard]] std::array<vec3, 5> corner_points() const {
    const vec3 corner = start + 0.5 * length * direction;
    return {start, start + 0.25 * length * direction, corner, corner + 0.25 * length * turned,
            corner + 0.5 * length * turned};
  }
};

/// Positions, velocities and accelerations over time, from rest to rest. Velocity is continuous; acceleration is
/// bounded but discontinuous at both ends, at the start of braking, and in corners. Created by make_trajectory.
class robot_trajectory {
 public:
  /// A trajectory along consecutive pieces, as fast as the limits allow. `stops[i]`: true to stop at the start of piece
  /// i. `start`: the position if there are no pieces. @pre stops.size() == pieces.size(); limits finite and > 0
  ORBIS_LAZY robot_trajectory(const vec3& start, std::vector<path_piece> pieces, const std::vector<bool>& stops,
                              const motion_limits& limits);

  /// Duration in seconds.
  [[nodiscard]] double duration() const noexcept { return knots_.empty() ? 0.0 : knots_.back().time; }
  /// The state at `time` seconds; at rest before 0 and after `duration()`. O(log n)
  ORBIS_LAZY [[nodiscard]] motion_state at(double time) const;
  /// The lines and corners of the trajectory.
  [[nodiscard]] const std::vector<path_piece>& pieces() const noexcept { return pieces_; }
  /// Number of stops between start and end.
  [[nodiscard]] std::size_t stops() const noexcept { return stops_; }

 private:
  /// Start of an interval in which the second time derivative of the parameter is constant.
  struct knot {
    double time;
    std::size_t piece;
    double s;      ///< parameter of the piece
    double speed;  ///< first time derivative of the parameter
    double gain;   ///< second time derivative of the parameter
  };

  /// Computes the knots of the fastest motion within the limits. Let u be the square of the parameter's speed, linear
  /// in the parameter over an interval of length h. If |q'| <= a and |q''| <= b in the interval, then
  ///
  ///     speed^2 <= a^2 u,    |acceleration| <= a |du| / (2 h) + b u,
  ///
  /// so that u at one end bounds u at the other. One forward and one backward pass compute u, as in J. E. Bobrow, S.
  /// Dubowsky, J. S. Gibson, "Time-optimal control of robotic manipulators along specified paths", International
  /// Journal of Robotics Research 4(3), 1985. `stops`: the pieces at whose start the robot stops.
  ORBIS_LAZY void set_times(const motion_limits& limits, const std::vector<bool>& stops);

  vec3 start_ = zeros<vec3>(), end_ = zeros<vec3>();
  std::vector<path_piece> pieces_;
  std::vector<knot> knots_;
  std::size_t stops_ = 0;
};

namespace detail {

/// Returns true if a robot is certainly free along a Bezier curve. The curve is in the convex hull of its control
/// points, so its distance from the segment between its ends is at most the distance of the farthest control point.
/// Tests a robot inflated by that distance along the segment and, if it is not free, each half of the curve
/// recursively. Nothing is sampled.
template <inflatable_space Space>
[[nodiscard]] bool is_free_curve(const Space& space, const std::array<vec3, 5>& points, int halvings = 6) {
  const vec3 along = points[4] - points[0];
  const double squared = squared_norm(along);
  double away = 0.0;
  for (const vec3& p : points) {
    const double t = squared > 0.0 ? std::clamp(dot(p - points[0], along) / squared, 0.0, 1.0) : 0.0;
    away = std::max(away, norm(p - (points[0] + t * along)));
  }
  const double rounding = 1e-9 * space.resolution();
  if (space.is_free(points[0], points[4], away + rounding)) return true;
  if (halvings == 0 || !space.is_free(points[0], points[4])) return false;
  // De Casteljau's algorithm.
  std::array<vec3, 5> left = points, right = points;
  for (std::size_t n = 4; n != 0; --n) {
    for (std::size_t i = 0; i != n; ++i) right[i] = 0.5 * (right[i] + right[i + 1]);
    left[5 - n] = right[0];
  }
  // `right` holds the control points of the second half, `left` those of the first.
  return is_free_curve(space, left, halvings - 1) && is_free_curve(space, right, halvings - 1);
}

}  // namespace detail

/// Makes a trajectory along a polyline, from rest to rest, within the limits. Corners are rounded (see path_piece)
/// where the robot fits: each rounded corner is certified as a whole by an exact test of the volume that an inflated
/// robot (for a user-defined shape, its covering balls) sweeps along chords of the curve. If none of several corner
/// sizes fits, the robot stops at the corner. The robot is therefore free at all times. Speed and acceleration are
/// within the limits everywhere, not only at samples.
///
/// On a floor (`floor_view`), the points keep their heights. Between them, the height is interpolated linearly, so the
/// robot's true height may differ: `view.on_ground(position)` returns it. The limits hold for the polyline's motion.
///
/// Consecutive points at the same position, or less than 1e-100 m apart, count once. O(points), plus the cost of
/// `is_free`.
/// @pre points is not empty; each segment is free (space.is_free), as in paths from find_path; limits finite and > 0
template <inflatable_space Space>
[[nodiscard]] robot_trajectory make_trajectory(const Space& space, const std::vector<vec3>& points,
                                               const motion_limits& limits = {}) {
  assert(!points.empty());
  constexpr double least = 1e-100;  // minimum length of a leg: its square does not underflow
  std::vector<vec3> corners;
  for (const vec3& p : points)
    if (corners.empty() || norm(p - corners.back()) > least) corners.push_back(p);
  std::vector<path_piece> pieces;
  std::vector<bool> stops;
  vec3 from = corners.front();
  const std::size_t last = corners.size() - 1;
  const auto line_to = [&](const vec3& to, const vec3& direction, bool stop) {
    const double length = norm(to - from);
    if (length > least) {
      pieces.push_back({from, direction, direction, length});
      stops.push_back(stop);
    }
    from = to;
  };
  bool stop = false;  // the robot stops at the start of the next piece
  for (std::size_t i = 1; i <= last; ++i) {
    const vec3 leg = corners[i] - corners[i - 1];
    const vec3 direction = normalized(leg);
    if (i == last) {
      line_to(corners[i], direction, stop);
      break;
    }
    const vec3 next = corners[i + 1] - corners[i];
    const vec3 turned = normalized(next);
    // A leg between two corners is shared equally.
    const double room = std::min(norm(leg) * (i == 1 ? 1.0 : 0.5), norm(next) * (i + 1 == last ? 1.0 : 0.5));
    bool rounded = false;
    for (double share = 1.0; share > 0.01 && !rounded; share *= 0.5) {
      const path_piece corner{corners[i] - share * room * direction, direction, turned, 2.0 * share * room};
      if (!detail::is_free_curve(space, corner.corner_points())) continue;
      line_to(corner.start, direction, stop);
      stop = false;
      pieces.push_back(corner);
      stops.push_back(false);
      from = corner.corner_points()[4];
      rounded = true;
    }
    if (!rounded) {
      line_to(corners[i], direction, stop);
      stop = true;
    }
  }
  return {points.front(), std::move(pieces), stops, limits};
}

}  // namespace orbis::nav

#ifndef ORBIS_COMPILED
#include <orbis/nav/robot_trajectory-inl.hpp>
#endif
