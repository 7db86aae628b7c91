// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of robot_trajectory.hpp.
#pragma once

#include <limits>

#include <orbis/core/inline.hpp>
#include <orbis/nav/robot_trajectory.hpp>

namespace orbis::nav {

ORBIS_LAZY_INLINE robot_trajectory::robot_trajectory(const vec3& start, std::vector<path_piece> pieces,
                                                     const std::vector<bool>& stops, const motion_limits& limits)
    : start_{start}, end_{start}, pieces_{std::move(pieces)} {
  assert(stops.size() == pieces_.size());
  assert(limits.speed > 0.0 && std::isfinite(limits.speed));
  assert(limits.acceleration > 0.0 && std::isfinite(limits.acceleration));
  if (!pieces_.empty()) end_ = pieces_.back().position(pieces_.back().length);
  set_times(limits, stops);
}

ORBIS_LAZY_INLINE motion_state robot_trajectory::at(double time) const {
  if (!(time > 0.0) || knots_.empty()) return {start_};
  if (time >= duration()) return {end_};
  const auto after =
      std::upper_bound(knots_.begin() + 1, knots_.end(), time, [](double t, const knot& k) { return t < k.time; });
  const knot& k = after[-1];
  const path_piece& piece = pieces_[k.piece];
  const double t = time - k.time;
  const double s = std::min(k.s + t * (k.speed + 0.5 * t * k.gain), piece.length);
  const double ds = std::max(0.0, k.speed + t * k.gain);
  const vec3 q1 = piece.first(s);
  return {piece.position(s), ds * q1, k.gain * q1 + ds * ds * piece.second(s)};
}

ORBIS_LAZY_INLINE void robot_trajectory::set_times(const motion_limits& limits, const std::vector<bool>& stops) {
  struct interval {
    std::size_t piece;
    double s, length, a, b;
  };
  constexpr int parts = 16;  // number of intervals in a corner
  std::vector<interval> all;
  std::vector<double> u{0.0};
  const double top = limits.speed * limits.speed;
  const auto cap = [&](const interval& i) {
    return std::min(top / (i.a * i.a), i.b > 0.0 ? limits.acceleration / i.b : std::numeric_limits<double>::infinity());
  };
  for (std::size_t p = 0; p != pieces_.size(); ++p) {
    const path_piece& piece = pieces_[p];
    const bool is_line = piece.direction == piece.turned;
    const int n = is_line ? 1 : parts;
    if (p != 0 && stops[p]) u.back() = 0.0, ++stops_;
    for (int k = 0; k != n; ++k) {
      const double h = piece.length / n, s = k * h;
      // |q'| is smallest and |q''| largest in the middle of a corner.
      const auto far = std::max(norm(piece.first(s)), norm(piece.first(s + h)));
      const auto near = std::max(norm(piece.second(s)), norm(piece.second(s + h)));
      all.push_back({p, s, h, is_line ? 1.0 : far, is_line ? 0.0 : near});
      u.back() = std::min(u.back(), cap(all.back()));
      u.push_back(cap(all.back()));
    }
  }
  u.back() = 0.0;
  const auto reach = [&](const interval& i, double from) {
    const double slope = i.a / (2.0 * i.length);
    return (limits.acceleration + slope * from) / (slope + i.b);
  };
  for (std::size_t i = 0; i != all.size(); ++i) u[i + 1] = std::min(u[i + 1], reach(all[i], u[i]));
  for (std::size_t i = all.size(); i-- != 0;) u[i] = std::min(u[i], reach(all[i], u[i + 1]));

  knots_.clear();
  double time = 0.0;
  const auto add = [&](std::size_t piece, double s, double length, double from, double to) {
    if (!(length > 0.0)) return;
    knots_.push_back({time, piece, s, std::sqrt(from), (to - from) / (2.0 * length)});
    time += 2.0 * length / (std::sqrt(from) + std::sqrt(to));
  };
  for (std::size_t i = 0; i != all.size(); ++i) {
    const interval& here = all[i];
    if (here.b > 0.0) {
      add(here.piece, here.s, here.length, u[i], u[i + 1]);
      continue;
    }
    // On a line: accelerate, move at full speed, brake.
    const double twice = 2.0 * limits.acceleration;
    const double peak = std::min(top, 0.5 * (u[i] + u[i + 1] + twice * here.length));
    const double up = std::min((peak - u[i]) / twice, here.length);
    const double down = std::min((peak - u[i + 1]) / twice, here.length - up);
    add(here.piece, 0.0, up, u[i], peak);
    add(here.piece, up, here.length - up - down, peak, peak);
    add(here.piece, here.length - down, down, peak, u[i + 1]);
  }
  if (!pieces_.empty()) knots_.push_back({time, pieces_.size() - 1, pieces_.back().length, 0.0, 0.0});
}

}  // namespace orbis::nav
