// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Anything that can be walked through: solids with their looks, lamps, and bodies that move.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/looks.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::test {

using namespace io;
using namespace io::detail::synthetic;

/// Where a moving body is at a moment: the place its middle stands on, and where it is turned to.
struct whereabouts {
  double time = 0.0;  ///< seconds
  triple position;    ///< metres, world
  double yaw = 0.0;   ///< turns about the vertical
};

/// Solids that move as one.
struct moving_body {
  std::vector<solid> solids;     ///< about the body's own origin, on the floor under its middle
  std::vector<whereabouts> way;  ///< in the order of time; it goes evenly from one to the next, and is not there
                                 ///< before the first and after the last
};

/// A grown person of fabric and clutter: legs, trunk, arms and head, 0.6 m from shoulder to shoulder, 1.75 m tall.
[[nodiscard]] inline moving_body person(std::vector<whereabouts> way, std::uint64_t seed) {
  moving_body body;
  body.way = std::move(way);
  const auto add = [&](shape kind, triple centre, triple half, material surface) {
    solid s;
    s.kind = kind;
    s.centre = centre;
    s.half = half;
    s.surface = surface;
    s.seed = mix64(seed + body.solids.size());
    body.solids.push_back(s);
  };
  for (const double side : {-0.12, 0.12}) add(shape::cylinder, {0.0, side, 0.42}, {0.09, 0.09, 0.42}, material::fabric);
  add(shape::box, {0.0, 0.0, 1.14}, {0.13, 0.21, 0.30}, material::clutter);
  for (const double side : {-0.26, 0.26}) add(shape::cylinder, {0.0, side, 1.08}, {0.05, 0.05, 0.34}, material::books);
  add(shape::sphere, {0.0, 0.0, 1.62}, {0.13, 0.13, 0.13}, material::fabric);
  return body;
}

/// A room and all that stands or moves in it. The first solid is the room itself, which is the world's end.
class world {
 public:
  /// @pre room.kind is shape::room. `lamps`: metres, world; the brightest of them lights a place.
  world(const solid& room, const face_looks& looks, std::vector<triple> lamps) : lamps_{std::move(lamps)} {
    assert(room.kind == shape::room);
    add(room, looks);
  }

  /// The room of `scene` with what stands in it, as it looks there; without what moves there.
  explicit world(const scene& room) : lamps_{{0.0, 0.0, room.options().height - 0.5}} {
    const synthetic_scene_options& o = room.options();
    for (std::size_t i = 0; i != room.still(); ++i)
      add(room.solids()[i], i == 0 ? looks_of_walls(room) : usual_looks(room.solids()[i], o.texture_density));
  }

  /// Puts a solid there that never moves. @pre no body has been added yet
  void add(const solid& s, const face_looks& looks) {
    assert(bodies_.empty());
    solids_.push_back(s);
    looks_.push_back(looks);
    still_ = solids_.size();
  }
  /// The same with the usual looks of its material.
  void add(const solid& s) { add(s, usual_looks(s)); }
  /// Lets a body in. @pre its way is in the order of time
  void add(const moving_body& body) {
    for (const solid& s : body.solids) {
      solids_.push_back(s);
      looks_.push_back(usual_looks(s));
    }
    bodies_.push_back({solids_.size() - body.solids.size(), solids_.size(), body.way});
  }

  /// All solids; those of moving bodies about the body's own origin.
  [[nodiscard]] const std::vector<solid>& solids() const noexcept { return solids_; }
  /// One for each solid.
  [[nodiscard]] const std::vector<face_looks>& looks() const noexcept { return looks_; }
  [[nodiscard]] const std::vector<triple>& lamps() const noexcept { return lamps_; }
  /// What the textures are painted from.
  [[nodiscard]] painted_solids painted() const { return {solids_, looks_, lamps_}; }
  /// How many of the solids never move: the first ones.
  [[nodiscard]] std::size_t still() const noexcept { return still_; }

  /// All solids as they are `time` seconds after the beginning. A body that is not there is far outside of the room.
  [[nodiscard]] std::vector<solid> solids_at(double time) const {
    std::vector<solid> now = solids_;
    for (const walker& w : bodies_) {
      const whereabouts at = where(w.way, time);
      const double c = cos_turns(at.yaw), s = sin_turns(at.yaw);
      for (std::size_t i = w.begin; i != w.end; ++i) {
        solid& b = now[i];
        const triple p = b.centre;
        b.centre = at.position + triple{c * p.x - s * p.y, s * p.x + c * p.y, p.z};
        const double cos_yaw = b.cos_yaw;
        b.cos_yaw = c * cos_yaw - s * b.sin_yaw;
        b.sin_yaw = s * cos_yaw + c * b.sin_yaw;
      }
    }
    return now;
  }

  /// The distance (metres, unsigned) of a point to the nearest surface that never moves: the error of a map point.
  /// Exact in front of the surfaces; behind them, where several solids overlap, the distance to the hull of the one
  /// the point is deepest in. O(solids)
  [[nodiscard]] double distance(const vec3& p_world) const noexcept {
    const triple p = to_triple(p_world);
    double nearest = solids_.front().signed_distance(p);
    for (std::size_t i = 1; i != still_; ++i) nearest = std::min(nearest, solids_[i].signed_distance(p));
    return std::abs(nearest);
  }

  /// Where the ray `origin + t direction` first meets a surface that never moves: `t`; empty if the ray starts outside
  /// of the room, or the direction is zero or not finite. O(solids)
  [[nodiscard]] std::optional<double> cast(const vec3& origin, const vec3& direction) const noexcept {
    if (!origin.allFinite() || !direction.allFinite() || direction.isZero(0.0)) return std::nullopt;
    double t = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i != still_; ++i) {
      const solid& s = solids_[i];
      t = std::min(t, intersect(s, s.to_local(to_triple(origin)), s.to_local_direction(to_triple(direction))).t);
    }
    if (!(t > 0.0) || !std::isfinite(t)) return std::nullopt;
    return t;
  }

 private:
  struct walker {
    std::size_t begin, end;  // of its solids
    std::vector<whereabouts> way;
  };

  [[nodiscard]] static whereabouts where(const std::vector<whereabouts>& way, double time) noexcept {
    if (way.empty() || time < way.front().time || time > way.back().time) return {time, {0.0, 0.0, -1e6}, 0.0};
    std::size_t i = 1;
    while (i < way.size() && way[i].time < time) ++i;
    if (i >= way.size()) return way.back();
    const whereabouts &a = way[i - 1], &b = way[i];
    const double f = b.time > a.time ? (time - a.time) / (b.time - a.time) : 1.0;
    return {time, a.position + f * (b.position - a.position), a.yaw + f * (b.yaw - a.yaw)};
  }

  std::vector<solid> solids_;
  std::vector<face_looks> looks_;
  std::vector<triple> lamps_;
  std::size_t still_ = 0;
  std::vector<walker> bodies_;
};

}  // namespace orbis::test

ORBIS_END_UNFUSED
