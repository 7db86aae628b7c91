// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include <orbis/core/random.hpp>
#include <orbis/io/detail/synthetic/camera_path.hpp>
#include <orbis/io/detail/synthetic/scene.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::io::detail::synthetic;

namespace {

triple random_direction(random_bits& bits) {
  for (;;) {
    const triple d{bits.uniform(-1, 1), bits.uniform(-1, 1), bits.uniform(-1, 1)};
    if (length(d) > 0.1 && length(d) < 1.0) return d;
  }
}

}  // namespace

TEST_CASE("a ray meets each kind of solid where walking along the distance field does") {
  random_bits bits{11};
  for (const shape kind : {shape::box, shape::sphere, shape::cylinder, shape::capsule, shape::room}) {
    int hits = 0;
    for (int i = 0; i != 2000; ++i) {
      solid s;
      s.kind = kind;
      s.centre = {bits.uniform(-1, 1), bits.uniform(-1, 1), bits.uniform(-1, 1)};
      s.half = {bits.uniform(0.1, 0.8), bits.uniform(0.1, 0.8), bits.uniform(0.1, 0.8)};
      const double yaw = bits.uniform();
      s.cos_yaw = cos_turns(yaw);
      s.sin_yaw = sin_turns(yaw);
      if (kind == shape::capsule) {
        const double tilt = bits.uniform();
        s.cos_tilt = cos_turns(tilt);
        s.sin_tilt = sin_turns(tilt);
        s.half.z += s.half.x;
      }
      const triple origin = kind == shape::room
                                ? s.centre
                                : s.centre + 2.0 * (1.0 / length(random_direction(bits))) * random_direction(bits);
      if (s.signed_distance(origin) <= 0.01) continue;
      const triple ray = random_direction(bits);
      const triple d = (1.0 / length(ray)) * ray;
      const hit h = intersect(s, s.to_local(origin), s.to_local_direction(d));

      double t = 0.0;  // sphere tracing, which knows of nothing but the distance
      for (int step = 0; step != 2000 && t < 20.0; ++step) {
        const double free = s.signed_distance(origin + t * d);
        if (free < 1e-9) break;
        t += free;
      }
      if (t >= 20.0) {
        CHECK(!(h.t < 20.0));
      } else if (std::isfinite(h.t)) {
        ++hits;
        CHECK(std::abs(s.signed_distance(origin + h.t * d)) < 1e-9);
        CHECK(h.t == Approx(t).margin(1e-4));
      } else {
        CHECK(std::abs(s.signed_distance(origin + t * d)) < 1e-6);  // grazes it
      }
    }
    CHECK(hits > 30);
  }
}

TEST_CASE("distances of simple solids are those of school geometry") {
  solid s;
  s.half = {1.0, 2.0, 3.0};
  CHECK(s.signed_distance({2.0, 0.0, 0.0}) == Approx(1.0));
  CHECK(s.signed_distance({4.0, 6.0, 0.0}) == Approx(5.0));
  CHECK(s.signed_distance({0.5, 0.0, 0.0}) == Approx(-0.5));
  s.kind = shape::room;
  CHECK(s.signed_distance({0.5, 0.0, 0.0}) == Approx(0.5));
  s.kind = shape::sphere;
  CHECK(s.signed_distance({0.0, 3.0, 0.0}) == Approx(2.0));
  s.kind = shape::cylinder;
  CHECK(s.signed_distance({0.0, 4.0, 7.0}) == Approx(5.0));
  CHECK(s.signed_distance({0.0, 0.0, 2.9}) == Approx(-0.1));
}

TEST_CASE("rays from inside the room end on a true surface") {
  random_bits bits{5};
  const scene room{{}, 3};
  for (int i = 0; i != 2000; ++i) {
    const vec3 origin{bits.uniform(-0.8, 0.8), bits.uniform(-0.6, 0.6), 1.4};
    const vec3 d = to_vec3(random_direction(bits));
    const auto t = room.cast(origin, d);
    REQUIRE(t);
    CHECK(room.distance(origin + *t * d) < 1e-9);
    CHECK(room.distance(origin + 0.5 * *t * d) > 0.0);
  }
  CHECK_FALSE(room.cast({0, 0, 1}, {std::numeric_limits<double>::quiet_NaN(), 0, 0}));
  CHECK_FALSE(room.cast({0, 0, 1}, {0, 0, 0}));
}

TEST_CASE("bare walls are as far as the plan says") {
  const scene room{{.length = 6.0, .width = 5.0, .height = 3.0, .size_jitter = 0.0, .furniture = false}, 1};
  CHECK(room.size() == vec3(6.0, 5.0, 3.0));
  CHECK(room.distance({0, 0, 1.0}) == Approx(1.0));
  CHECK(room.distance({2.9, 0, 1.5}) == Approx(0.1));
  CHECK(room.distance({3.2, 0, 1.5}) == Approx(0.2));
  CHECK(room.cast({0, 0, 1}, {0, 1, 0}).value() == Approx(2.5));
}

TEST_CASE("another seed gives another room and the same seed the same") {
  const scene a{{}, 1}, b{{}, 2}, c{{}, 1};
  CHECK(a.size() != b.size());
  CHECK(a.solids().size() > 40);
  random_bits bits{2};
  int different = 0;
  for (int i = 0; i != 300; ++i) {
    const vec3 d = to_vec3(random_direction(bits));
    CHECK(a.cast({0, 0, 1.4}, d) == c.cast({0, 0, 1.4}, d));
    different += std::abs(*a.cast({0, 0, 1.4}, d) - *b.cast({0, 0, 1.4}, d)) > 0.2 ? 1 : 0;
  }
  CHECK(different > 50);
}

TEST_CASE("the path keeps clear of the furniture in every room") {
  for (std::uint64_t seed = 0; seed != 40; ++seed) {
    const scene room{{}, seed};
    const camera_path path{{}, seed, 13.0};
    for (int i = 0; i != 130; ++i) CHECK(room.distance(path.at(0.1 * i).T_world_camera().translation()) > 0.4);
  }
}

TEST_CASE("furniture stays inside the room") {
  for (std::uint64_t seed = 0; seed != 40; ++seed) {
    const scene room{{}, seed};
    const vec3 half = 0.5 * room.size();
    for (const solid& s : room.solids()) {
      const triple b = s.bounds();
      CHECK(std::abs(s.centre.x) + b.x < half.x() + 1e-9);
      CHECK(std::abs(s.centre.y) + b.y < half.y() + 1e-9);
      CHECK(s.centre.z - b.z > -1e-9);
      CHECK(s.centre.z + b.z < room.size().z() + 1e-9);
    }
  }
}

TEST_CASE("as many walls are poor as were asked for") {
  for (int poor = 0; poor <= 4; ++poor) {
    const scene room{{.poor_walls = poor}, 8};
    int count = 0;
    for (int face = 0; face != 6; ++face) count += room.is_poor_wall(face) ? 1 : 0;
    CHECK(count == poor);
  }
}

TEST_CASE("only the person moves and only if there is one") {
  const scene still{{}, 1}, moving{{.person = true}, 1};
  const auto count_moved = [](const scene& s) {
    const auto a = s.solids_at(0.0), b = s.solids_at(2.0);
    int moved = 0;
    for (std::size_t i = 0; i != a.size(); ++i) moved += length(a[i].centre - b[i].centre) > 0.1 ? 1 : 0;
    return moved;
  };
  CHECK(count_moved(still) == 0);
  CHECK(count_moved(moving) == static_cast<int>(moving.solids().size() - still.solids().size()));
  CHECK(count_moved(moving) > 1);
}

TEST_CASE("a solid is inside of its bounds") {
  random_bits bits{12};
  for (const shape kind : {shape::box, shape::cylinder, shape::capsule}) {
    for (int i = 0; i != 300; ++i) {
      solid s;
      s.kind = kind;
      s.half = {bits.uniform(0.1, 0.4), bits.uniform(0.1, 0.4), bits.uniform(0.4, 0.8)};
      const double yaw = bits.uniform(), tilt = bits.uniform();
      s.cos_yaw = cos_turns(yaw);
      s.sin_yaw = sin_turns(yaw);
      s.cos_tilt = cos_turns(tilt);
      s.sin_tilt = sin_turns(tilt);
      const triple b = s.bounds();
      for (int j = 0; j != 50; ++j) {
        const triple p{bits.uniform(-1, 1), bits.uniform(-1, 1), bits.uniform(-1, 1)};
        if (s.signed_distance(p) > 0.0) continue;
        const bool inside = std::abs(p.x) <= b.x && std::abs(p.y) <= b.y && std::abs(p.z) <= b.z;
        REQUIRE(inside);
      }
    }
  }
}

TEST_CASE("a person walks round the room, on the floor and between camera and furniture") {
  const scene empty{{}, 4}, with{{.person = true}, 4};
  REQUIRE(with.still() == empty.solids().size());
  REQUIRE(with.solids().size() > with.still());
  const auto middle = [&](double time) {
    triple sum;
    const auto now = with.solids_at(time);
    for (std::size_t i = with.still(); i != now.size(); ++i) sum = sum + now[i].centre;
    return (1.0 / static_cast<double>(now.size() - with.still())) * sum;
  };
  double way = 0.0;
  for (double time = 0.0; time < 10.0; time += 0.1) {
    way += length(middle(time + 0.1) - middle(time));
    const auto now = with.solids_at(time);
    double lowest = 9.0, highest = 0.0;
    for (std::size_t i = with.still(); i != now.size(); ++i) {
      lowest = std::min(lowest, now[i].centre.z - now[i].bounds().z);
      highest = std::max(highest, now[i].centre.z + now[i].bounds().z);
      CHECK(empty.solids().front().signed_distance(now[i].centre) > 0.4);  // away from the walls
      CHECK(std::abs(now[i].centre.x) + std::abs(now[i].centre.y) > 0.9);  // the camera is not run over
      for (std::size_t other = 1; other != with.still(); ++other)
        CHECK(with.solids()[other].signed_distance(now[i].centre) > 0.0);
    }
    CHECK(std::abs(lowest) < 0.1);
    CHECK(highest == Approx(1.75).margin(0.1));
    for (std::size_t i = 0; i != with.still(); ++i) REQUIRE(length(now[i].centre - empty.solids()[i].centre) == 0.0);
  }
  CHECK(way == Approx(10.0).epsilon(0.1));
  // The truth is that of the room.
  CHECK(with.distance(to_vec3(middle(3.0))) == empty.distance(to_vec3(middle(3.0))));
}
