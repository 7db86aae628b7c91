// SPDX-License-Identifier: BSD-3-Clause
#include "rooms.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <orbis/io/detail/synthetic/scene.hpp>

namespace orbis::bench {

using io::detail::synthetic::shape;
using io::detail::synthetic::solid;
using io::detail::synthetic::to_triple;

namespace {

constexpr double pi = 3.14159265358979323846;

solid hull(double length, double width, double height) {
  return {.kind = shape::room, .centre = {0, 0, 0.5 * height}, .half = {0.5 * length, 0.5 * width, 0.5 * height}};
}

solid upright(shape kind, vec3 foot, vec3 size, double yaw) {
  solid s;
  s.kind = kind;
  s.centre = {foot.x(), foot.y(), foot.z() + 0.5 * size.z()};
  s.half = {0.5 * size.x(), 0.5 * (kind == shape::box ? size.y() : size.x()), 0.5 * size.z()};
  if (kind == shape::sphere) {
    s.half = {s.half.x, s.half.x, s.half.x};
    s.centre.z = foot.z() + s.half.x;
  }
  s.cos_yaw = std::cos(yaw);
  s.sin_yaw = std::sin(yaw);
  return s;
}

shape any_shape(random_bits& random) {
  return std::array{shape::box, shape::box, shape::cylinder, shape::sphere}[random.below(4)];
}

room clutter(random_bits& random) {
  const double length = random.uniform(4.0, 6.0), width = random.uniform(4.0, 5.5), height = random.uniform(2.4, 3.0);
  room r{room_kind::clutter, {hull(length, width, height)}};
  while (r.solids.size() != 26) {
    const double x = random.uniform(-0.5, 0.5) * length, y = random.uniform(-0.5, 0.5) * width;
    if (std::hypot(x, y) < 1.2) continue;  // where the camera is
    const bool hangs = random.below(6) == 0;
    const double tall = random.uniform(0.1, hangs ? 0.5 : 1.9);
    r.solids.push_back(upright(any_shape(random), {x, y, hangs ? height - tall : 0.0},
                               {random.uniform(0.1, 0.9), random.uniform(0.1, 0.9), tall}, random.uniform(0, pi)));
  }
  return r;
}

room corridor(random_bits& random) {
  const double length = random.uniform(9.0, 13.0), width = random.uniform(1.8, 2.6), height = random.uniform(2.3, 2.8);
  room r{room_kind::corridor, {hull(length, width, height)}};
  for (double x = -0.4 * length; x < 0.5 * length; x += random.uniform(0.9, 1.8)) {
    const double side = random.below(2) == 0 ? 1 : -1;
    const double size = random.uniform(0.1, 0.5);
    r.solids.push_back(upright(any_shape(random), {x, side * (0.5 * width - 0.4 * size), 0},
                               {size, size, random.uniform(0.4, 2.2)}, random.uniform(-0.2, 0.2)));
  }
  return r;
}

room table_top(random_bits& random) {
  room r{room_kind::table_top, {hull(random.uniform(3.2, 4.5), random.uniform(3.2, 4.5), 2.5)}};
  const double top = random.uniform(0.7, 0.8);
  r.solids.push_back(upright(shape::box, {0, 0, top - 0.04}, {1.3, 0.9, 0.04}, 0));
  for (const double x : {-0.6, 0.6})
    for (const double y : {-0.4, 0.4}) r.solids.push_back(upright(shape::box, {x, y, 0}, {0.06, 0.06, top - 0.04}, 0));
  for (int i = 0; i != 16; ++i) {
    const vec3 size{random.uniform(0.05, 0.22), random.uniform(0.05, 0.22), random.uniform(0.04, 0.30)};
    r.solids.push_back(upright(any_shape(random), {random.uniform(-0.55, 0.55), random.uniform(-0.38, 0.38), top}, size,
                               random.uniform(0, pi)));
  }
  return r;
}

room hall(random_bits& random) {
  const double length = random.uniform(7.0, 9.0), width = random.uniform(6.0, 8.0);
  room r{room_kind::hall, {hull(length, width, 3.6)}};
  for (int i = 0; i != 5; ++i) {
    const double angle = 2 * pi * (i + random.uniform(0, 0.6)) / 5;
    r.solids.push_back(
        upright(i % 2 == 0 ? shape::cylinder : shape::box, {2.6 * std::cos(angle), 2.4 * std::sin(angle), 0},
                {random.uniform(0.25, 0.6), random.uniform(0.25, 0.6), i == 0 ? 1.1 : 3.6}, random.uniform(0, pi)));
  }
  return r;
}

/// A camera at `from` that looks at `at`, the world's z upward.
se3 look(const vec3& from, const vec3& at) {
  const vec3 forward = (at - from).normalized();
  const vec3 right = forward.cross(vec3::UnitZ()).normalized();
  mat3 rotation;
  rotation << right, forward.cross(right), forward;
  return {so3{so3::quaternion{rotation}}, from};
}

}  // namespace

double room::distance(const vec3& p) const {
  double nearest = std::numeric_limits<double>::infinity();
  for (const solid& s : solids) nearest = std::min(nearest, s.signed_distance(to_triple(p)));
  return std::abs(nearest);
}

double room::cast(const vec3& origin, const vec3& direction) const {
  double t = std::numeric_limits<double>::infinity();
  for (const solid& s : solids) {
    const auto d = s.to_local_direction(to_triple(direction));
    t = std::min(t, intersect(s, s.to_local(to_triple(origin)), d).t);
  }
  return std::isfinite(t) && t > 0 ? t : 0;
}

room make_room(room_kind kind, std::uint64_t seed) {
  random_bits random{mix64(seed ^ 0x726f6f6d73ULL)};
  switch (kind) {
    case room_kind::furnished: return {kind, io::detail::synthetic::scene{{}, seed}.solids()};
    case room_kind::clutter: return clutter(random);
    case room_kind::corridor: return corridor(random);
    case room_kind::table_top: return table_top(random);
    case room_kind::hall: break;
  }
  return hall(random);
}

std::vector<se3> make_path(const room& r, int views, std::uint64_t seed) {
  random_bits random{mix64(seed ^ 0x70617468ULL)};
  const double start = random.uniform(0, 2 * pi);
  std::vector<se3> path;
  for (int i = 0; i != views; ++i) {
    const auto wobble = [&] {
      return vec3{random.uniform(-.04, .04), random.uniform(-.04, .04), random.uniform(-.04, .04)};
    };
    const double a = start + 0.28 * i;
    const vec3 around{std::cos(a), std::sin(a), 0};
    if (r.kind == room_kind::corridor) {
      const double x = -r.solids.front().half.x + 0.5 + 0.22 * i;
      path.push_back(look(vec3{x, 0.15 * std::sin(a), 1.4} + wobble(), vec3{x + 3, 0.3 * std::sin(2 * a), 1.1}));
    } else if (r.kind == room_kind::table_top) {
      path.push_back(look(1.15 * around + vec3{0, 0, 1.35} + wobble(), vec3{0, 0, 0.8} + wobble()));
    } else if (r.kind == room_kind::hall) {
      path.push_back(look(-1.2 * around + vec3{0, 0, 1.5} + wobble(), 3.0 * around + vec3{0, 0, 1.2}));
    } else {
      path.push_back(look(0.5 * around + vec3{0, 0, 1.35} + wobble(), 2.0 * around + vec3{0, 0, 1.0}));
    }
  }
  return path;
}

float depth_sensor::measure(double z, random_bits& random) const {
  const double noise = random.normal(), chance = random.uniform();
  if (z <= 0 || chance < dropouts) return 0;
  z += deviation(z) * noise;
  if (z <= 0) return 0;
  if (disparity_step > 0) {
    const double steps = std::round(focal_baseline / z / disparity_step);
    if (steps < 1) return 0;
    z = focal_baseline / (steps * disparity_step);
  }
  return z > 0.25 && z <= max_depth ? static_cast<float>(z) : 0.0F;
}

solid walker(const room& r, const std::vector<se3>& path, double progress, std::uint64_t seed) {
  random_bits random{mix64(seed ^ 0x77616c6bULL)};
  const se3& middle = path[path.size() / 2];
  const vec3 forward = middle.rotation_matrix().col(2), right = middle.rotation_matrix().col(0);
  const bool small = r.kind == room_kind::table_top;  // a hand, say
  const double ahead = small ? 0.7 : r.kind == room_kind::clutter ? 0.7 : random.uniform(1.2, 1.6);
  const double span = small ? 0.4 : r.kind == room_kind::corridor ? 0.7 : 1.2;
  const vec3 at = middle.translation() + ahead * forward + span * (2 * progress - 1) * right;
  const double wide = small ? random.uniform(0.08, 0.14) : random.uniform(0.3, 0.5);
  return upright(random.below(2) == 0 ? shape::cylinder : shape::box, {at.x(), at.y(), small ? 0.9 : 0.0},
                 {wide, 0.7 * wide, small ? 0.4 : random.uniform(1.4, 1.9)}, random.uniform(0, pi));
}

}  // namespace orbis::bench
