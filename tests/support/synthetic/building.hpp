// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A building whose corridor leads once round its core.
#pragma once

#include <algorithm>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/io/detail/synthetic/arithmetic.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>

#include "support/synthetic/world.hpp"

ORBIS_BEGIN_UNFUSED

namespace orbis::test {

/// Which building.
struct building_options {
  double core_length = 6.0;      ///< along x, metres
  double core_width = 4.0;       ///< along y, metres
  double corridor = 2.4;         ///< its width, metres
  double height = 2.7;           ///< metres
  bool furniture = true;         ///< false: bare walls
  int poor_walls = 0;            ///< how many of the eight walls are nearly without texture, 0..8
  double texture_density = 1.0;  ///< scales the number of patches painted on every surface; 0: none
  double wall_period = 0.0;      ///< metres; above 0 all walls bear one picture that repeats itself at this distance
};

/// The corners of the way along the middle of the corridor, to the left all the way; the core is in the middle of it.
[[nodiscard]] inline std::vector<triple> corridor_corners(const building_options& o) {
  const double x = 0.5 * (o.core_length + o.corridor), y = 0.5 * (o.core_width + o.corridor);
  return {{-x, -y, 0.0}, {x, -y, 0.0}, {x, y, 0.0}, {-x, y, 0.0}};
}

namespace detail {

/// Builds the corridor's walls and what stands at them.
class builder {
 public:
  builder(const building_options& options, std::uint64_t seed)
      : o_{options}, bits_{mix64(seed ^ 0x636f7265ULL)}, place_{shell()} {
    add_core();
    if (!o_.furniture) return;
    for (int i = 0; i != 8; ++i) furnish(wall_of(i));
    hang_from_ceiling();
  }
  [[nodiscard]] world take() { return std::move(place_); }

 private:
  /// A wall as seen from the corridor.
  struct wall {
    triple from;        ///< its end, on the floor
    triple along, out;  ///< unit vectors: along it, and out of it into the corridor
    double length;      ///< metres
  };

  /// 0..3: the outer walls, in the order of a solid's faces; 4..7: those of the core.
  [[nodiscard]] wall wall_of(int i) const noexcept {
    const bool core = i >= 4, along_y = (i & 3) < 2, positive = (i & 1) != 0;
    const double hx = 0.5 * o_.core_length + (core ? 0.0 : o_.corridor);
    const double hy = 0.5 * o_.core_width + (core ? 0.0 : o_.corridor);
    const double side = positive ? 1.0 : -1.0, out = core ? side : -side;
    if (along_y) return {{side * hx, -hy, 0.0}, {0.0, 1.0, 0.0}, {out, 0.0, 0.0}, 2.0 * hy};
    return {{-hx, side * hy, 0.0}, {1.0, 0.0, 0.0}, {0.0, out, 0.0}, 2.0 * hx};
  }

  [[nodiscard]] face_look wall_look(int i, std::uint64_t seed) {
    constexpr std::array<material, 8> kinds{material::wallpaper, material::brick,     material::tile, material::fabric,
                                            material::brick,     material::wallpaper, material::wood, material::tile};
    material m = kinds[static_cast<std::size_t>((i + first_kind_) & 7)];
    if (o_.wall_period > 0.0) m = material::wallpaper;
    const bool poor = ((i - first_poor_ + 8) & 7) < o_.poor_walls;
    if (poor) m = material::plain;
    face_look look = usual_look(m, seed, i, o_.texture_density);
    if (poor) look.patches = 4.0 * o_.texture_density;
    if (o_.wall_period > 0.0) {
      look.period = o_.wall_period;
      look.seed = noise_word(seed_of_walls_, 7, 0);
    }
    return look;
  }

  [[nodiscard]] world shell() {
    seed_of_walls_ = bits_();
    first_kind_ = static_cast<int>(bits_.below(8));
    first_poor_ = static_cast<int>(bits_.below(8));
    solid room;
    room.kind = shape::room;
    room.half = {0.5 * o_.core_length + o_.corridor, 0.5 * o_.core_width + o_.corridor, 0.5 * o_.height};
    room.centre = {0.0, 0.0, 0.5 * o_.height};
    room.seed = bits_();
    face_looks looks;
    for (int i = 0; i != 4; ++i) looks[static_cast<std::size_t>(i)] = wall_look(i, room.seed);
    looks[4] = usual_look(material::tile, room.seed, 4, o_.texture_density);
    looks[5] = usual_look(material::plain, room.seed, 5, o_.texture_density);
    looks[5].patches *= 5.0;
    looks[4].coarseness = looks[5].coarseness = 1.6;  // neither is ever near
    const double x = 0.5 * (o_.core_length + o_.corridor), y = 0.5 * (o_.core_width + o_.corridor);
    std::vector<triple> lamps;
    for (const double a : {-1.0, 0.0, 1.0})
      for (const double b : {-1.0, 0.0, 1.0})
        if (a != 0.0 || b != 0.0) lamps.push_back({a * x, b * y, o_.height - 0.4});
    return world{room, looks, std::move(lamps)};
  }

  void add_core() {
    solid core;
    core.centre = {0.0, 0.0, 0.5 * o_.height};
    core.half = {0.5 * o_.core_length, 0.5 * o_.core_width, 0.5 * o_.height};
    core.seed = bits_();
    face_looks looks;
    for (int i = 0; i != 4; ++i) looks[static_cast<std::size_t>(i)] = wall_look(4 + i, core.seed);
    looks[4].coarseness = looks[5].coarseness = 16.0;  // never seen
    place_.add(core, looks);
  }

  void add(shape kind, triple centre, triple half, material surface) {
    solid s;
    s.kind = kind;
    s.centre = centre;
    s.half = half;
    s.surface = surface;
    s.seed = bits_();
    place_.add(s, usual_looks(s, o_.texture_density));
  }
  [[nodiscard]] static triple point(const wall& w, double along, double out, double up) noexcept {
    return w.from + along * w.along + out * w.out + triple{0.0, 0.0, up};
  }
  /// A box by its extent along the wall, out of it and up.
  void block(const wall& w, std::array<double, 2> along, std::array<double, 2> out, std::array<double, 2> up,
             material surface) {
    const double a = 0.5 * (along[1] - along[0]), b = 0.5 * (out[1] - out[0]), c = 0.5 * (up[1] - up[0]);
    add(shape::box, point(w, along[0] + a, out[0] + b, up[0] + c), w.along.x > 0.5 ? triple{a, b, c} : triple{b, a, c},
        surface);
  }
  void pillar(const wall& w, double along, double out, std::array<double, 2> up, double radius, material surface) {
    add(shape::cylinder, point(w, along, out, 0.5 * (up[0] + up[1])), {radius, radius, 0.5 * (up[1] - up[0])}, surface);
  }
  void ball(const wall& w, double along, double out, double up, double radius, material surface) {
    add(shape::sphere, point(w, along, out, up), {radius, radius, radius}, surface);
  }
  [[nodiscard]] material any() {
    constexpr std::array<material, 5> kinds{material::clutter, material::books, material::fabric, material::wood,
                                            material::brick};
    return kinds[bits_.below(5)];
  }

  // What stands at a wall; `a` is the middle of each piece along it. No call has two arguments that draw a number:
  // their order would be the compiler's choice.

  void cupboard(const wall& w, double a) {
    block(w, {a - 0.45, a + 0.45}, {0.0, 0.36}, {0.0, 1.85}, material::wood);
    block(w, {a - 0.43, a - 0.01}, {0.36, 0.375}, {0.1, 1.8}, any());
    block(w, {a + 0.01, a + 0.43}, {0.36, 0.375}, {0.1, 1.8}, material::wallpaper);
    block(w, {a - 0.3, a + 0.15}, {0.05, 0.3}, {1.85, 2.1}, material::clutter);
  }
  void shelves(const wall& w, double a) {
    for (const double x : {a - 0.56, a + 0.54}) block(w, {x, x + 0.02}, {0.0, 0.28}, {0.0, 1.8}, material::wood);
    for (int board = 0; board != 4; ++board) {
      const double up = 0.1 + 0.45 * board, from = a - 0.52 + between(bits_, 0.0, 0.3);
      const double to = from + between(bits_, 0.4, 0.7), top = up + between(bits_, 0.22, 0.36);
      block(w, {a - 0.54, a + 0.54}, {0.0, 0.28}, {up, up + 0.03}, material::wood);
      block(w, {from, to}, {0.02, 0.22}, {up + 0.03, top}, material::books);
    }
  }
  void bench(const wall& w, double a) {
    block(w, {a - 0.6, a + 0.6}, {0.05, 0.42}, {0.40, 0.45}, material::wood);
    for (const double x : {a - 0.55, a + 0.5}) block(w, {x, x + 0.05}, {0.08, 0.38}, {0.0, 0.40}, material::wood);
    const double b = a + between(bits_, -0.3, 0.0), top = 0.45 + between(bits_, 0.15, 0.35);
    block(w, {b - 0.2, b + 0.2}, {0.1, 0.36}, {0.45, top}, any());
    ball(w, a + 0.45, 0.24, 0.57, 0.12, any());
    picture(w, a, 1.55);
  }
  void crates(const wall& w, double a) {
    block(w, {a - 0.35, a + 0.3}, {0.02, 0.44}, {0.0, 0.5}, material::clutter);
    block(w, {a - 0.25, a + 0.2}, {0.04, 0.38}, {0.5, 0.9}, any());
    block(w, {a - 0.1, a + 0.22}, {0.06, 0.32}, {0.9, 1.15}, any());
  }
  void plant(const wall& w, double a) {
    pillar(w, a, 0.24, {0.0, 0.4}, 0.18, material::tile);
    pillar(w, a, 0.24, {0.4, 1.0}, 0.03, material::wood);
    ball(w, a, 0.25, 1.2, 0.25, material::fabric);
  }
  void dresser(const wall& w, double a) {
    block(w, {a - 0.4, a + 0.4}, {0.0, 0.38}, {0.0, 0.8}, material::wood);
    for (int i = 0; i != 3; ++i)
      block(w, {a - 0.37, a + 0.37}, {0.38, 0.395}, {0.06 + 0.25 * i, 0.27 + 0.25 * i}, any());
    pillar(w, a + between(bits_, -0.3, 0.0), 0.2, {0.8, 1.1}, 0.08, material::clutter);
    block(w, {a + 0.1, a + 0.35}, {0.1, 0.3}, {0.8, 0.8 + between(bits_, 0.1, 0.3)}, material::books);
    picture(w, a, 1.65);
  }
  void door(const wall& w, double a) {
    block(w, {a - 0.42, a + 0.42}, {0.0, 0.03}, {0.0, 2.0}, material::wood);
    for (const double x : {a - 0.5, a + 0.42}) block(w, {x, x + 0.08}, {0.0, 0.05}, {0.0, 2.08}, material::tile);
    block(w, {a - 0.42, a + 0.42}, {0.0, 0.05}, {2.0, 2.08}, material::tile);
    block(w, {a - 0.2, a + 0.2}, {0.03, 0.04}, {1.35, 1.65}, material::clutter);
    ball(w, a + 0.36, 0.06, 1.0, 0.035, material::plain);
  }
  void notice_board(const wall& w, double a) {
    block(w, {a - 0.6, a + 0.6}, {0.0, 0.02}, {1.0, 1.9}, material::fabric);
    for (int i = 0; i != 6; ++i) {
      const double x = a - 0.55 + 0.36 * (i % 3) + between(bits_, 0.0, 0.1);
      const double z = 1.05 + 0.42 * (i / 3) + between(bits_, 0.0, 0.08);
      const double wide = between(bits_, 0.15, 0.25), high = between(bits_, 0.2, 0.32);
      block(w, {x, x + wide}, {0.02, 0.024}, {z, z + high}, i % 2 == 0 ? material::books : material::clutter);
    }
  }
  void column(const wall& w, double a) { pillar(w, a, 0.15, {0.0, o_.height}, 0.14, material::brick); }
  void picture(const wall& w, double a, double up) {
    const double x = a + between(bits_, -0.15, 0.15), half = between(bits_, 0.18, 0.35);
    block(w, {x - half, x + half}, {0.0, 0.025}, {up - 0.2, up + between(bits_, 0.15, 0.35)}, material::clutter);
  }

  using piece = void (builder::*)(const wall&, double);
  struct furniture {
    piece build;
    double width;
  };

  /// Pieces in any order with gaps between them, clear of the corners.
  void furnish(const wall& w) {
    std::array<furniture, 9> stock{{{&builder::cupboard, 0.9},
                                    {&builder::shelves, 1.15},
                                    {&builder::bench, 1.2},
                                    {&builder::crates, 0.7},
                                    {&builder::plant, 0.5},
                                    {&builder::dresser, 0.8},
                                    {&builder::door, 1.0},
                                    {&builder::notice_board, 1.2},
                                    {&builder::column, 0.3}}};
    orbis::shuffle(stock, bits_);
    double at = between(bits_, 0.7, 0.9);
    for (const furniture& f : stock) {
      if (at + f.width > w.length - 0.7) continue;
      (this->*f.build)(w, at + 0.5 * f.width);
      at += f.width + between(bits_, 0.15, 0.6);
    }
  }

  /// Beams and lamps across the corridor.
  void hang_from_ceiling() {
    const double ox = 0.5 * o_.core_length + o_.corridor, oy = 0.5 * o_.core_width + o_.corridor;
    const double half = 0.5 * o_.corridor, top = o_.height;
    for (const double side : {-1.0, 1.0}) {
      for (double x = -ox + 1.0; x < ox - 0.5; x += between(bits_, 1.4, 2.2))
        add(shape::box, {x, side * (oy - half), top - 0.06}, {0.08, half, 0.06}, any());
      for (double y = -oy + o_.corridor + 0.3; y < oy - o_.corridor; y += between(bits_, 1.4, 2.2))
        add(shape::box, {side * (ox - half), y, top - 0.06}, {half, 0.08, 0.06}, any());
    }
  }

  building_options o_;
  random_bits bits_;
  std::uint64_t seed_of_walls_ = 0;
  int first_kind_ = 0, first_poor_ = 0;
  world place_;
};

}  // namespace detail

/// A corridor round a core that nobody sees through: four outer walls, four of the core, furniture along them all. Its
/// floor is at z = 0, its middle at the origin. The seed decides what stands where, and all textures.
/// @pre core of 2 m x 2 m, corridor of 2 m, height of 2.4 m at least
[[nodiscard]] inline world corridor_building(const building_options& options, std::uint64_t seed) {
  assert(options.core_length >= 2.0 && options.core_width >= 2.0 && options.corridor >= 2.0 && options.height >= 2.4);
  return detail::builder{options, seed}.take();
}

}  // namespace orbis::test

ORBIS_END_UNFUSED
