// SPDX-License-Identifier: BSD-3-Clause
#include "support/synthetic/world.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/io/detail/synthetic/texture.hpp>

#include "support/catch.hpp"
#include "support/synthetic/building.hpp"

using namespace orbis;
using namespace orbis;
using namespace orbis::io;
using namespace orbis::io::detail::synthetic;
using namespace orbis::test;

namespace {

world bare_room() {
  solid room;
  room.kind = shape::room;
  room.half = {3.0, 2.0, 1.5};
  room.centre = {0.0, 0.0, 1.5};
  return {room, usual_looks(room), {{0.0, 0.0, 2.5}}};
}

}  // namespace

TEST_CASE("a body goes evenly along its way, turns as one, and is not there before and after") {
  world place = bare_room();
  const moving_body someone = person({{1.0, {-1.0, 0.0, 0.0}, 0.0}, {3.0, {1.0, 0.5, 0.0}, 0.25}}, 5);
  place.add(someone);
  CHECK(place.still() == 1);
  REQUIRE(place.solids().size() == 1 + someone.solids.size());
  for (const double time : {0.9, 3.1})
    for (std::size_t i = 1; i != place.solids().size(); ++i) CHECK(place.solids_at(time)[i].centre.z < -1e5);
  const auto begin = place.solids_at(1.0), middle = place.solids_at(2.0), end = place.solids_at(3.0);
  for (std::size_t i = 1; i != begin.size(); ++i) {
    const triple own = someone.solids[i - 1].centre;
    CHECK(length(begin[i].centre - triple{own.x - 1.0, own.y, own.z}) < 1e-12);
    CHECK(length(end[i].centre - triple{1.0 - own.y, 0.5 + own.x, own.z}) < 1e-12);  // a quarter turn to the left
    CHECK(middle[i].cos_yaw == Approx(std::sqrt(0.5)));
    const double across = std::hypot(middle[i].centre.x, middle[i].centre.y - 0.25);
    CHECK(across == Approx(std::hypot(own.x, own.y)).margin(1e-12));
  }
}

TEST_CASE("bodies that move are no part of the map") {
  world place = bare_room();
  const double before = place.distance({0.0, 0.0, 1.1});
  place.add(person({{0.0, {0.0, 0.0, 0.0}, 0.0}, {9.0, {0.0, 0.0, 0.0}, 0.0}}, 5));
  CHECK(place.distance({0.0, 0.0, 1.1}) == before);
  CHECK(place.cast({-2.0, 0.0, 1.1}, {1.0, 0.0, 0.0}).value() == Approx(5.0));
  CHECK_FALSE(place.cast({-2.0, 0.0, 1.1}, {0.0, 0.0, 0.0}));
}

TEST_CASE("the world of a scene has the scene's surfaces") {
  const scene room{{.person = true}, 3};
  const world place{room};
  random_bits bits{4};
  for (int i = 0; i != 300; ++i) {
    const vec3 p{bits.uniform(-2.5, 2.5), bits.uniform(-2.0, 2.0), bits.uniform(0.1, 2.8)};
    CHECK(place.distance(p) == room.distance(p));
  }
}

TEST_CASE("a building stands within its walls, and nobody sees through its core") {
  for (std::uint64_t seed = 0; seed != 20; ++seed) {
    const building_options options;
    const world place = corridor_building(options, seed);
    CHECK(place.solids().size() > 100);
    const solid& hull = place.solids().front();
    for (const solid& s : place.solids()) {
      const triple b = s.bounds();
      CHECK(std::abs(s.centre.x) + b.x < hull.half.x + 1e-9);
      CHECK(std::abs(s.centre.y) + b.y < hull.half.y + 1e-9);
      CHECK(s.centre.z - b.z > -1e-9);
      CHECK(s.centre.z + b.z < options.height + 1e-9);
    }
    const auto corners = corridor_corners(options);
    REQUIRE(corners.size() == 4);
    for (std::size_t i = 0; i != 4; ++i) {
      const vec3 a = to_vec3(0.5 * (corners[i] + corners[(i + 1) % 4])) + vec3(0.0, 0.0, 1.4);
      const vec3 b = to_vec3(0.5 * (corners[(i + 2) % 4] + corners[(i + 3) % 4])) + vec3(0.0, 0.0, 1.4);
      CHECK(place.cast(a, b - a).value() < 0.3);  // ends at the core
      CHECK(place.distance(a) > 0.6);
    }
  }
}

TEST_CASE("as many walls of a building are poor as were asked for") {
  const auto patches = [](int poor, double period) {
    int few = 0;
    const world place = corridor_building({.poor_walls = poor, .wall_period = period}, 8);
    for (std::size_t of = 0; of != 2; ++of)
      for (std::size_t face = 0; face != 4; ++face) few += place.looks()[of][face].patches < 10.0 ? 1 : 0;
    return few;
  };
  for (int poor = 0; poor <= 8; ++poor) CHECK(patches(poor, 0.0) == poor);
  CHECK(patches(3, 0.7) == 3);
}

TEST_CASE("walls with a period bear one picture over and over, the others never do") {
  const auto likeness = [](double period) {
    const world place{scene{{.furniture = false, .poor_walls = 0, .wall_period = period}, 1}};
    const texture_set textures{place.painted(), 0.02};
    double sum = 0.0;
    constexpr int n = 500;
    random_bits bits{2};
    const auto green = [&](int face, double u, double v) {
      return static_cast<double>((textures.sample(0, face, u, v, 0.02) >> 8U) & 0xffU);
    };
    for (int i = 0; i != n; ++i) {
      const double u = bits.uniform(0.8, 1.5), v = bits.uniform(0.8, 1.4);
      // A period (of whole texels) further on the same wall, and at the same place of another.
      sum += std::abs(green(0, u, v) - green(0, u + 0.8, v)) + std::abs(green(0, u, v) - green(2, u, v));
    }
    return sum / (2 * n);
  };
  CHECK(likeness(0.8) < 8.0);  // not 0: the light is another
  CHECK(likeness(0.0) > 16.0);
}
