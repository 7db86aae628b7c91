// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A furnished room of known geometry, and a walking person: a body of capsules with swinging arms and legs.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>
#include <orbis/io/synthetic_options.hpp>

ORBIS_BEGIN_UNFUSED

namespace orbis::io::detail::synthetic {

/// The parts of a person: two legs, two arms, two halves of the trunk, and a head.
using body_parts = std::array<solid, 7>;

/// An adult, 1.75 m tall and 0.55 m wide, standing at `foot` (metres, world) and facing along `(cos_yaw, sin_yaw)`.
/// `step`: number of double steps so far; its fraction determines the position of arms and legs. The textures depend
/// only on `seed`.
[[nodiscard]] inline body_parts walking_person(triple foot, double cos_yaw, double sin_yaw, double step,
                                               std::uint64_t seed) noexcept {
  body_parts parts;
  std::size_t i = 0;
  // `from`: the upper end of the part's axis relative to the foot: forward, to the left, and up.
  const auto add = [&](triple from, double radius, double height, double tilt, material surface) {
    solid& s = parts[i];
    s.kind = shape::capsule;
    s.half = {radius, radius, 0.5 * height};
    s.cos_yaw = cos_yaw;
    s.sin_yaw = sin_yaw;
    s.cos_tilt = cos_turns(tilt);
    s.sin_tilt = sin_turns(tilt);
    s.surface = surface;
    s.seed = noise_word(seed, 0x626f6479ULL, i);
    const triple upper{cos_yaw * from.x - sin_yaw * from.y, sin_yaw * from.x + cos_yaw * from.y, from.z};
    s.centre = foot + upper - s.to_world_direction({0.0, 0.0, 0.5 * height - radius});
    ++i;
  };
  const double swing = 0.07 * sin_turns(step);  // 25 degrees
  add({0.0, -0.1, 0.86}, 0.08, 0.93, swing, material::plain);
  add({0.0, 0.1, 0.86}, 0.08, 0.93, -swing, material::plain);
  add({0.0, -0.24, 1.4}, 0.05, 0.72, -0.8 * swing, material::wallpaper);
  add({0.0, 0.24, 1.4}, 0.05, 0.72, 0.8 * swing, material::wallpaper);
  add({0.0, -0.07, 1.3}, 0.15, 0.7, 0.0, material::wallpaper);
  add({0.0, 0.07, 1.3}, 0.15, 0.7, 0.0, material::wallpaper);
  add({0.0, 0.0, 1.65}, 0.1, 0.3, 0.0, material::fabric);
  return parts;
}

/// A room with the floor at z = 0 and its centre at the origin, furnished along the walls. The seed determines the
/// sizes, order and positions of the furniture, and all textures.
class scene {
 public:
  /// @pre the size is at least 3 m x 3 m x 2 m, size_jitter is in [0, 0.2]
  scene(const synthetic_scene_options& options, std::uint64_t seed)
      : options_{options}, bits_{mix64(seed ^ 0x726f6f6dULL)} {
    length_ = options.length * (1.0 + options.size_jitter * between(bits_, -1.0, 1.0));
    width_ = options.width * (1.0 + options.size_jitter * between(bits_, -1.0, 1.0));
    add(shape::room, {0.0, 0.0, 0.5 * options.height}, {0.5 * length_, 0.5 * width_, 0.5 * options.height},
        material::wallpaper);
    first_poor_wall_ = static_cast<int>(bits_.below(4));
    if (options.furniture) furnish();
    still_ = solids_.size();
    if (options.person) {
      person_seed_ = bits_();
      for (const solid& s : person_at(0.0)) solids_.push_back(s);
    }
  }

  /// The solids at the start: first the room itself, then all objects in it.
  [[nodiscard]] const std::vector<solid>& solids() const noexcept { return solids_; }
  /// The solids `time` seconds after the start; only the person moves.
  [[nodiscard]] std::vector<solid> solids_at(double time) const {
    std::vector<solid> now = solids_;
    if (options_.person) {
      const body_parts parts = person_at(time);
      std::copy(parts.begin(), parts.end(), now.end() - static_cast<std::ptrdiff_t>(parts.size()));
    }
    return now;
  }
  /// Number of static solids, which precede the moving ones.
  [[nodiscard]] std::size_t still() const noexcept { return still_; }

  /// Size in metres along x, y and z.
  [[nodiscard]] vec3 size() const { return {length_, width_, options_.height}; }
  [[nodiscard]] const synthetic_scene_options& options() const noexcept { return options_; }
  /// Returns true if wall `face` (0: -x, 1: +x, 2: -y, 3: +y) has almost no texture.
  [[nodiscard]] bool is_poor_wall(int face) const noexcept {
    return face < 4 && (face - first_poor_wall_ + 4) % 4 < options_.poor_walls;
  }

  /// The unsigned distance (metres) from a point to the nearest surface visible to a camera: the error of a map point.
  /// Exact in front of the surfaces; behind them, where several solids overlap, it is the distance to the surface of
  /// the solid in which the point is deepest. Ignores moving solids.
  [[nodiscard]] double distance(const vec3& p_world) const noexcept {
    const triple p = to_triple(p_world);
    double nearest = solids_.front().signed_distance(p);
    for (std::size_t i = 1; i != still_; ++i) nearest = std::min(nearest, solids_[i].signed_distance(p));
    return std::abs(nearest);
  }

  /// The parameter `t` at which the ray `origin + t direction` first meets a surface; empty if the ray starts outside
  /// the room, or the direction is zero or not finite. Ignores moving solids.
  [[nodiscard]] std::optional<double> cast(const vec3& origin, const vec3& direction) const noexcept {
    if (!all_finite(origin) || !all_finite(direction) || direction.isZero(0.0)) return std::nullopt;
    double t = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i != still_; ++i)
      t = std::min(t, intersect(solids_[i], solids_[i].to_local(to_triple(origin)),
                                solids_[i].to_local_direction(to_triple(direction)))
                          .t);
    if (!(t > 0.0) || !std::isfinite(t)) return std::nullopt;
    return t;
  }

 private:
  /// The person, on an ellipse between the camera's path and the furniture.
  [[nodiscard]] body_parts person_at(double time) const noexcept {
    const double a = 0.5 * length_ - 1.25, b = 0.5 * width_ - 1.15;
    constexpr double radians_per_turn = 6.283185307179586;
    // Mean speed 1 m/s, with double steps of 1.3 m.
    const double turn = -time / (radians_per_turn * std::sqrt(0.5 * (a * a + b * b)));
    const double x = cos_turns(turn), y = sin_turns(turn);
    const double speed = std::sqrt(square(a * y) + square(b * x));
    return walking_person({a * x, b * y, 0.0}, a * y / speed, -b * x / speed, time / 1.3, person_seed_);
  }

  /// A wall. Positions next to it are given by `along`, measured from the wall's centre, and `out`, measured from the
  /// wall into the room.
  struct wall {
    int face;       // see is_poor_wall
    double length;  // metres
  };

  solid& add(shape kind, triple centre, triple half, material surface) {
    solid s;
    s.kind = kind;
    s.centre = centre;
    s.half = half;
    s.surface = surface;
    s.seed = bits_();
    solids_.push_back(s);
    return solids_.back();
  }

  [[nodiscard]] triple place(const wall& w, double along, double out, double up) const noexcept {
    switch (w.face) {
      case 0: return {out - 0.5 * length_, along, up};
      case 1: return {0.5 * length_ - out, -along, up};
      case 2: return {-along, out - 0.5 * width_, up};
      default: return {along, 0.5 * width_ - out, up};
    }
  }

  /// Adds a box given by its extents along the wall, away from it, and upwards.
  solid& block(const wall& w, std::array<double, 2> along, std::array<double, 2> out, std::array<double, 2> up,
               material surface) {
    const triple centre = place(w, 0.5 * (along[0] + along[1]), 0.5 * (out[0] + out[1]), 0.5 * (up[0] + up[1]));
    const double a = 0.5 * (along[1] - along[0]), o = 0.5 * (out[1] - out[0]), u = 0.5 * (up[1] - up[0]);
    return add(shape::box, centre, w.face < 2 ? triple{o, a, u} : triple{a, o, u}, surface);
  }
  solid& pillar(const wall& w, double along, double out, std::array<double, 2> up, double radius, material surface) {
    return add(shape::cylinder, place(w, along, out, 0.5 * (up[0] + up[1])), {radius, radius, 0.5 * (up[1] - up[0])},
               surface);
  }
  solid& ball(const wall& w, double along, double out, double up, double radius, material surface) {
    return add(shape::sphere, place(w, along, out, up), {radius, radius, radius}, surface);
  }
  /// Rotates a box about the vertical axis by a random angle of up to `turns`.
  void turn(solid& s, double turns) {
    const double by = between(bits_, -turns, turns);
    s.cos_yaw = cos_turns(by);
    s.sin_yaw = sin_turns(by);
  }

  // The furniture; `a` is the centre of each piece along the wall.

  void cupboard(const wall& w, double a) {
    block(w, {a - 0.5, a + 0.5}, {0.0, 0.5}, {0.0, 1.9}, material::wood);
    block(w, {a - 0.47, a - 0.02}, {0.5, 0.52}, {0.1, 1.85}, material::wallpaper);
    block(w, {a + 0.02, a + 0.47}, {0.5, 0.52}, {0.1, 1.85}, material::plain);
    turn(block(w, {a - 0.3, a + 0.2}, {0.1, 0.4}, {1.9, 2.15}, material::clutter), 0.03);
  }
  void shelves(const wall& w, double a) {
    block(w, {a - 0.6, a - 0.57}, {0.0, 0.32}, {0.0, 1.9}, material::wood);
    block(w, {a + 0.57, a + 0.6}, {0.0, 0.32}, {0.0, 1.9}, material::wood);
    for (int board = 0; board != 5; ++board) {
      const double up = 0.05 + 0.45 * board;
      block(w, {a - 0.57, a + 0.57}, {0.0, 0.32}, {up, up + 0.03}, material::wood);
      if (board == 4) break;
      const double from = a - 0.55 + between(bits_, 0.0, 0.3), to = from + between(bits_, 0.4, 0.75);
      block(w, {from, to}, {0.02, 0.24}, {up + 0.03, up + 0.03 + between(bits_, 0.22, 0.33)}, material::books);
    }
    ball(w, a + 0.42, 0.16, 0.05 + 0.45 * 4 + 0.03 + 0.12, 0.12, material::fabric);
  }
  void table(const wall& w, double a) {
    block(w, {a - 0.65, a + 0.65}, {0.1, 0.85}, {0.70, 0.74}, material::wood);
    for (const double x : {a - 0.6, a + 0.6})
      for (const double y : {0.15, 0.8})
        block(w, {x - 0.03, x + 0.03}, {y - 0.03, y + 0.03}, {0.0, 0.70}, material::wood);
    turn(block(w, {a - 0.5, a - 0.2}, {0.25, 0.45}, {0.74, 0.92}, material::clutter), 0.08);
    turn(block(w, {a + 0.2, a + 0.45}, {0.3, 0.65}, {0.74, 0.80}, material::books), 0.1);
    ball(w, a + 0.05, 0.5, 0.74 + 0.1, 0.1, material::tile);
    pillar(w, a - 0.1, 0.25, {0.74, 0.98}, 0.05, material::fabric);
    pillar(w, a + 0.52, 0.25, {0.74, 0.86}, 0.045, material::brick);
  }
  void bed(const wall& w, double a) {
    block(w, {a - 1.0, a + 1.0}, {0.02, 0.92}, {0.0, 0.30}, material::wood);
    block(w, {a - 0.98, a + 0.98}, {0.04, 0.90}, {0.30, 0.48}, material::fabric);
    block(w, {a - 1.05, a - 1.0}, {0.0, 0.95}, {0.0, 0.95}, material::wood);
    turn(block(w, {a - 0.92, a - 0.52}, {0.17, 0.77}, {0.48, 0.60}, material::clutter), 0.02);
    turn(block(w, {a + 0.1, a + 0.6}, {0.2, 0.7}, {0.48, 0.53}, material::wallpaper), 0.06);
  }
  void sofa(const wall& w, double a) {
    block(w, {a - 0.9, a + 0.9}, {0.05, 0.80}, {0.05, 0.42}, material::fabric);
    block(w, {a - 0.9, a + 0.9}, {0.05, 0.25}, {0.42, 0.85}, material::fabric);
    block(w, {a - 1.05, a - 0.9}, {0.05, 0.80}, {0.05, 0.62}, material::clutter);
    block(w, {a + 0.9, a + 1.05}, {0.05, 0.80}, {0.05, 0.62}, material::clutter);
    turn(block(w, {a - 0.7, a - 0.3}, {0.27, 0.42}, {0.42, 0.78}, material::tile), 0.02);
    turn(block(w, {a + 0.25, a + 0.6}, {0.27, 0.40}, {0.42, 0.74}, material::brick), 0.03);
  }
  void basin(const wall& w, double a) {
    block(w, {a - 0.40, a + 0.40}, {0.0, 0.55}, {0.0, 0.62}, material::tile);
    block(w, {a - 0.40, a + 0.40}, {0.0, 0.05}, {0.62, 0.85}, material::clutter);
    block(w, {a - 0.40, a + 0.40}, {0.50, 0.55}, {0.62, 0.85}, material::clutter);
    block(w, {a - 0.40, a - 0.35}, {0.05, 0.50}, {0.62, 0.85}, material::clutter);
    block(w, {a + 0.35, a + 0.40}, {0.05, 0.50}, {0.62, 0.85}, material::clutter);
    pillar(w, a, 0.09, {0.85, 1.1}, 0.02, material::plain);
    block(w, {a - 0.02, a + 0.02}, {0.07, 0.25}, {1.06, 1.1}, material::plain);
    block(w, {a - 0.3, a + 0.3}, {0.0, 0.02}, {1.25, 1.85}, material::clutter);
  }
  void lamp(const wall& w, double a) {
    pillar(w, a, 0.3, {0.0, 0.04}, 0.15, material::tile);
    pillar(w, a, 0.3, {0.04, 1.45}, 0.02, material::plain);
    ball(w, a, 0.3, 1.6, 0.17, material::brick);
  }
  void column(const wall& w, double a) { pillar(w, a, 0.25, {0.0, options_.height}, 0.15, material::brick); }
  void drawers(const wall& w, double a) {
    block(w, {a - 0.3, a + 0.3}, {0.0, 0.42}, {0.0, 0.75}, material::wood);
    for (int i = 0; i != 3; ++i)
      block(w, {a - 0.27, a + 0.27}, {0.42, 0.435}, {0.06 + 0.23 * i, 0.26 + 0.23 * i}, material::clutter);
    pillar(w, a + 0.1, 0.2, {0.75, 1.05}, 0.07, material::clutter);
  }
  void bin(const wall& w, double a) {
    pillar(w, a, 0.3, {0.0, 0.45}, 0.16, material::fabric);
    ball(w, a - 0.02, 0.75, 0.13, 0.13, material::tile);
  }
  void stool(const wall& w, double a) {
    pillar(w, a, 0.45, {0.0, 0.42}, 0.2, material::clutter);
    turn(block(w, {a - 0.12, a + 0.12}, {0.33, 0.57}, {0.42, 0.50}, material::books), 0.1);
  }

  using piece = void (scene::*)(const wall&, double);
  struct furniture {
    piece build;
    double width;
  };

  /// Places four groups of furniture, one per wall, in an order and with gaps determined by the seed.
  void furnish() {
    std::array<std::vector<furniture>, 4> groups{{
        {{&scene::bed, 2.1}, {&scene::lamp, 0.4}, {&scene::drawers, 0.6}},
        {{&scene::shelves, 1.2}, {&scene::table, 1.3}, {&scene::stool, 0.5}},
        {{&scene::sofa, 2.1}, {&scene::column, 0.4}, {&scene::lamp, 0.4}},
        {{&scene::cupboard, 1.0}, {&scene::basin, 0.8}, {&scene::bin, 0.5}, {&scene::drawers, 0.6}},
    }};
    shuffle(groups);
    for (int face = 0; face != 4; ++face) {
      const wall w{face, face < 2 ? width_ : length_};
      auto& group = groups[static_cast<std::size_t>(face)];
      shuffle(group);
      arrange(w, group);
      decorate(w);
    }
    // A beam under the ceiling and a lamp next to it.
    add(shape::box, {0.22 * length_, 0.0, options_.height - 0.1}, {0.1, 0.5 * width_, 0.1}, material::wood);
    add(shape::sphere, {-0.1 * length_, 0.1, options_.height - 0.35}, {0.2, 0.2, 0.2}, material::fabric);
  }

  void arrange(const wall& w, const std::vector<furniture>& group) {
    constexpr double corner = 0.7;  // space for furniture at the adjacent wall
    double taken = 0.0;
    for (const furniture& f : group) taken += f.width;
    double spare = std::max(0.0, w.length - 2.0 * corner - taken);
    double at = -0.5 * (taken + spare);
    for (const furniture& f : group) {
      const double gap = spare * between(bits_, 0.1, 0.6);
      spare -= gap;
      at += gap;
      if (at + f.width > 0.5 * w.length) break;  // no space left in a small room
      (this->*f.build)(w, at + 0.5 * f.width);
      at += f.width;
    }
  }

  /// Adds picture frames that project slightly from the wall.
  void decorate(const wall& w) {
    const int count = 2 + static_cast<int>(bits_.below(2));
    for (int i = 0; i != count; ++i) {
      const double a = w.length * ((i + between(bits_, 0.25, 0.75)) / count - 0.5);
      const double half_width = between(bits_, 0.15, 0.35), half_height = between(bits_, 0.15, 0.25);
      const double up = between(bits_, 1.6, 2.1);
      block(w, {a - half_width, a + half_width}, {0.0, 0.025}, {up - half_height, up + half_height}, material::clutter);
    }
  }

  template <class Sequence>
  void shuffle(Sequence& s) {
    for (std::size_t i = s.size(); i > 1; --i) std::swap(s[i - 1], s[bits_.below(static_cast<std::uint32_t>(i))]);
  }

  synthetic_scene_options options_;
  random_bits bits_;
  double length_ = 0.0, width_ = 0.0;
  int first_poor_wall_ = 0;
  std::vector<solid> solids_;
  std::size_t still_ = 0;  // number of static solids
  std::uint64_t person_seed_ = 0;
};

}  // namespace orbis::io::detail::synthetic

ORBIS_END_UNFUSED
