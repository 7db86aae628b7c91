// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Straight segments: tests of whether a robot can move along them, and their costs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/core/types.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav::detail {

/// Cost per metre at a clearance (metres) from obstacles, see planning_options.
[[nodiscard]] inline double clearance_density(const planning_options& options, double clearance) noexcept {
  const double lacking = 1.0 - std::max(0.0, clearance) / options.preferred_clearance;
  return lacking > 0.0 ? 1.0 + options.clearance_weight * lacking * lacking : 1.0;
}

/// Value of `margin` where a robot certainly does not fit.
inline constexpr double blocked = -std::numeric_limits<double>::infinity();

/// Returns true if the segment from `a` to `b` is free. `margin(p)`: the distance that the robot can certainly move
/// from `p` in any direction, `blocked` if it certainly does not fit at `p`, or a negative value if neither is certain.
/// `is_blocked(p, q)`: exact test of whether an obstacle prevents the robot from moving from `p` to `q`. Advances by
/// the available margin, as in J. C. Hart, "Sphere tracing", The Visual Computer 12, 1996.
template <class Margin, class IsBlocked>
[[nodiscard]] bool is_segment_free(const vec3& a, const vec3& b, double cell, Margin&& margin, IsBlocked&& is_blocked) {
  const double length = norm(b - a);
  const auto at = [&](double t) -> vec3 { return t >= length ? b : vec3{a + (b - a) * (t / length)}; };
  const double least_step = 0.2 * cell;  // several such steps cost less than an exact test
  // Cheap tests first: the margins alone reject most blocked segments.
  bool is_near = false;
  double t = 0.0;
  do {
    const double m = margin(at(t));
    if (m == blocked) return false;
    is_near = is_near || m < least_step;
    t += m < least_step ? cell : m;
  } while (t < length);
  if (!is_near) return true;
  t = 0.0;
  do {
    const vec3 p = at(t);
    double step = margin(p);
    if (step < least_step) {
      step = 4.0 * cell;
      if (is_blocked(p, at(t + step))) return false;
    }
    t += step;
  } while (t < length);
  return true;
}

/// Returns true if the margins alone prove the segment free, in steps of at least a tenth of a cell.
template <class Margin>
[[nodiscard]] bool is_segment_certainly_free(const vec3& a, const vec3& b, double cell, Margin&& margin) {
  const double length = norm(b - a);
  double t = 0.0;
  do {
    const double m = margin(t > 0.0 ? vec3{a + (b - a) * (t / length)} : a);
    if (m < 0.1 * cell) return false;
    t += m;
  } while (t < length);
  return true;
}

/// Cost of the segment from `a` to `b`: the exact integral of the density, which is constant in each cell. O(cells on
/// the segment). @pre `a` and `b` lie in the space
///
/// J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing", Eurographics, 1987.
template <class Space>
[[nodiscard]] double segment_cost(const Space& space, const vec3& a, const vec3& b) {
  const double length = norm(b - a);
  const auto key = space.key(a), end = space.key(b);
  if (space.is_uniform() || length == 0.0 || !key || !end) return length;
  const vec3 middle = space.center(*key);
  std::array<std::uint32_t, 3> at{key->x, key->y, key->z};
  const std::array<std::uint32_t, 3> last{end->x, end->y, end->z};
  std::array<std::uint32_t, 3> step{};
  // Positions along the segment at which faces are crossed, metres. Rounding errors accumulate and could lead out of
  // the grid at the end, so no face is crossed along an axis once the last cell is reached.
  std::array<double, 3> next{}, apart{};
  constexpr double never = std::numeric_limits<double>::infinity();
  for (int i = 0; i != 3; ++i) {
    const auto j = static_cast<std::size_t>(i);
    const double along = (b[i] - a[i]) / length;
    const double face = middle[i] + (along > 0.0 ? 0.5 : -0.5) * space.resolution();
    next[j] = at[j] == last[j] ? never : std::max(0.0, (face - a[i]) / along);
    apart[j] = space.resolution() / std::abs(along);
    step[j] = along > 0.0 ? 1U : ~0U;
  }
  double t = 0.0, sum = 0.0, density = 1.0;
  while (t < length) {
    const std::size_t i = next[0] < next[1] ? (next[0] < next[2] ? 0U : 2U) : (next[1] < next[2] ? 1U : 2U);
    const double to = std::min(std::max(next[i], t), length);
    // Where the segment passes through an edge or a corner, it touches adjacent cells, which do not count.
    if (to - t > 1e-9 * space.resolution()) density = space.density({at[0], at[1], at[2]});
    sum += (to - t) * density;
    t = to;
    at[i] += step[i];
    next[i] = at[i] == last[i] ? never : next[i] + apart[i];
  }
  return sum;
}

}  // namespace orbis::nav::detail
