// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Shapes of robots: a ball, a vertical capsule, a vertical cylinder. z points up; robots do not tilt.
#pragma once

#include <algorithm>
#include <cmath>
#include <concepts>

#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/overlap.hpp>

namespace orbis::nav {

/// Everything within `radius` (metres) of the robot's reference point. @pre radius > 0
struct ball {
  double radius = 0.2;
};
/// Everything within `radius` of the vertical segment from `low` to `high` above the reference point, metres.
/// @pre radius > 0; low <= high
struct vertical_capsule {
  double radius = 0.2;
  double low = 0.2, high = 0.8;
};
/// All points at a horizontal distance of at most `radius` from the reference point, and at a height from `low` to
/// `high` above it, metres. @pre radius > 0; low < high
struct vertical_cylinder {
  double radius = 0.2;
  double low = 0.0, high = 1.0;
};

/// The volume that a shape sweeps while its reference point moves straight from `a` to `b`.
template <class Shape>
struct swept_shape {
  vec3 a = zeros<vec3>(), b = zeros<vec3>();
  Shape shape{};
};

[[nodiscard]] inline octree::bounding_box bounds_of(const swept_shape<vertical_capsule>& s) {
  const octree::bounding_box b = bounds_of(octree::capsule{s.a, s.b, s.shape.radius});
  return {b.min + s.shape.low * vec3(0.0, 0.0, 1.0), b.max + s.shape.high * vec3(0.0, 0.0, 1.0)};
}
[[nodiscard]] inline octree::bounding_box bounds_of(const swept_shape<vertical_cylinder>& s) {
  const octree::bounding_box b = bounds_of(octree::capsule{s.a, s.b, s.shape.radius});
  return {vec3{b.min.x(), b.min.y(), std::min(s.a.z(), s.b.z()) + s.shape.low},
          vec3{b.max.x(), b.max.y(), std::max(s.a.z(), s.b.z()) + s.shape.high}};
}
/// Exact: extends the box by the capsule's vertical segment, and tests a ball instead of the capsule.
[[nodiscard]] inline bool touches(const swept_shape<vertical_capsule>& s, const octree::bounding_box& box) noexcept {
  const octree::bounding_box stretched{box.min - s.shape.high * vec3(0.0, 0.0, 1.0),
                                       box.max - s.shape.low * vec3(0.0, 0.0, 1.0)};
  return touches(octree::capsule{s.a, s.b, s.shape.radius}, stretched);
}
/// Exact: in the part of the motion in which the height ranges of the robot and the box overlap, tests the robot's
/// circle against the box, both seen from above.
[[nodiscard]] inline bool touches(const swept_shape<vertical_cylinder>& s, const octree::bounding_box& box) noexcept {
  const double rise = s.b.z() - s.a.z();
  const double lowest = box.min.z() - s.shape.high, highest = box.max.z() - s.shape.low;  // of the reference point
  if (std::max(s.a.z(), s.b.z()) < lowest || std::min(s.a.z(), s.b.z()) > highest) return false;
  double from = 0.0, to = 1.0;
  if (rise != 0.0) {
    const double t = (lowest - s.a.z()) / rise, u = (highest - s.a.z()) / rise;
    from = std::clamp(std::min(t, u), 0.0, 1.0);
    to = std::clamp(std::max(t, u), 0.0, 1.0);
  }
  const auto above = [](const vec3& p) { return vec3{p.x(), p.y(), 0.0}; };
  const vec3 a = above(s.a), along = above(s.b) - a;
  return touches(octree::capsule{a + from * along, a + to * along, s.shape.radius},
                 octree::bounding_box{above(box.min), above(box.max)});
}

/// The volume swept on the straight segment from `a` to `b`, metres.
[[nodiscard]] inline octree::capsule swept(const ball& s, const vec3& a, const vec3& b) { return {a, b, s.radius}; }
[[nodiscard]] inline swept_shape<vertical_capsule> swept(const vertical_capsule& s, const vec3& a, const vec3& b) {
  return {a, b, s};
}
[[nodiscard]] inline swept_shape<vertical_cylinder> swept(const vertical_cylinder& s, const vec3& a, const vec3& b) {
  return {a, b, s};
}

/// Balls on the vertical line through the reference point that bound a shape from outside and from inside: `count`
/// balls, the first `low` above the reference point, `spacing` apart (metres). Balls of radius `outer` cover the shape,
/// and balls of radius `inner` are inside it.
struct ball_cover {
  double low = 0.0, spacing = 0.0;
  int count = 1;
  double outer = 0.0, inner = 0.0;
};

namespace detail {
/// Number of balls that cover an object of this height (metres): at most a few dozen, even for thin objects.
[[nodiscard]] inline int ball_count(double height, double radius) noexcept {
  return static_cast<int>(std::ceil(std::min(height / radius, 40.0)));
}
}  // namespace detail

[[nodiscard]] inline ball_cover covering_balls(const ball& s) { return {0.0, 0.0, 1, s.radius, s.radius}; }
[[nodiscard]] inline ball_cover covering_balls(const vertical_capsule& s) {
  const int pieces = detail::ball_count(s.high - s.low, s.radius);
  const double spacing = pieces == 0 ? 0.0 : (s.high - s.low) / pieces;
  return {s.low, spacing, pieces + 1, std::hypot(s.radius, spacing / 2), s.radius};
}
[[nodiscard]] inline ball_cover covering_balls(const vertical_cylinder& s) {
  const int pieces = detail::ball_count(s.high - s.low, s.radius);
  const double spacing = (s.high - s.low) / pieces;
  return {s.low + spacing / 2, spacing, pieces, std::hypot(s.radius, spacing / 2), std::min(s.radius, spacing / 2)};
}

/// The shape of a robot with constant orientation: `swept(shape, a, b)` is the volume that it sweeps on a straight
/// segment, for `octree::overlaps`, and `covering_balls(shape)` returns balls that make most calls of
/// `octree::overlaps` unnecessary.
template <class S>
concept robot_shape = std::copyable<S> && requires(const S& shape, const vec3& p) {
  { swept(shape, p, p) } -> octree::overlap_shape;
  { covering_balls(shape) } -> std::same_as<ball_cover>;
};
template <robot_shape S>
[[deprecated("use covering_balls")]] [[nodiscard]] ball_cover cover_of(const S& shape) {
  return covering_balls(shape);
}

namespace detail {
/// A shape that covers everything within `by` (metres) of `s`.
[[nodiscard]] inline ball grown(const ball& s, double by) { return {s.radius + by}; }
[[nodiscard]] inline vertical_capsule grown(const vertical_capsule& s, double by) {
  return {s.radius + by, s.low, s.high};
}
[[nodiscard]] inline vertical_cylinder grown(const vertical_cylinder& s, double by) {
  return {s.radius + by, s.low - by, s.high + by};
}
/// For any other shape: a capsule around the balls that cover it.
template <robot_shape Shape>
[[nodiscard]] vertical_capsule grown(const Shape& s, double by) {
  const ball_cover c = covering_balls(s);
  return {c.outer + by, c.low, c.low + (c.count - 1) * c.spacing};
}
}  // namespace detail

}  // namespace orbis::nav
