// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_cost.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/nav/robot_trajectory.hpp>
#include <orbis/octree/occupancy_octree.hpp>
#include <orbis/octree/overlap.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace elsewhere {

/// A shape of somebody's own: a ball that hangs beneath its reference point.
struct pendulum {
  double radius = 0.1, length = 0.15;
};
[[nodiscard]] octree::capsule swept(const pendulum& s, const vec3& a, const vec3& b) {
  return {a - s.length * vec3::UnitZ(), b - s.length * vec3::UnitZ(), s.radius};
}
[[nodiscard]] nav::ball_cover covering_balls(const pendulum& s) { return {-s.length, 0.0, 1, s.radius, s.radius}; }
static_assert(nav::robot_shape<pendulum>);
static_assert(nav::inflatable_space<nav::planning_view<octree::occupancy_octree<>, pendulum>>);
static_assert(nav::inflatable_space<nav::floor_view>);

}  // namespace elsewhere

namespace {

using map_type = octree::occupancy_octree<>;

void set(map_type& map, const octree::voxel_key& k, float log_odds) {
  map.edit_octant(k, [&](auto& voxels) {
    const auto i = octree::morton_code(k) & 63U;
    voxels.known |= std::uint64_t{1} << i;
    voxels.value[i] = log_odds;
  });
}
/// Boxes strewn in 3 m x 3 m x 1.5 m of free space.
map_type boxes(random_bits& random, int count) {
  map_type map{0.1};
  const std::uint32_t o = map.grid().cells() / 2;
  for (std::uint32_t z = 0; z != 15; ++z)
    for (std::uint32_t y = 0; y != 30; ++y)
      for (std::uint32_t x = 0; x != 30; ++x) set(map, {o + x, o + y, o + z}, -1.0F);
  for (int i = 0; i != count; ++i) {
    const std::uint32_t x = random.below(27), y = random.below(27), z = random.below(12);
    for (std::uint32_t j = 0; j != 27; ++j) set(map, {o + x + j % 3, o + y + j / 3 % 3, o + z + j / 9}, 1.0F);
  }
  return map;
}

/// Whether a robot touches something there, by the exact test alone.
template <class View>
bool is_blocked(const View& view, const vec3& p) {
  return octree::overlaps(view.map(), swept(view.shape(), p, p), {.unknown = view.field().options().unknown});
}
bool is_blocked(const nav::floor_view& view, const vec3& p) {
  const nav::floor_map& map = view.map();
  for (int y = -1; y <= map.states.height(); ++y)
    for (int x = -1; x <= map.states.width(); ++x) {
      const bool is_inside = x >= 0 && y >= 0 && x < map.states.width() && y < map.states.height();
      if (is_inside && map.states(x, y) == nav::floor_state::free) continue;
      const vec2 low = map.origin + map.resolution * vec2{x, y};
      const vec2 nearest = p.head<2>().cwiseMax(low).cwiseMin(vec2{low.array() + map.resolution});
      if ((nearest - p.head<2>()).norm() <= view.radius()) return true;
    }
  return false;
}
/// A floor of 4 m x 3 m with boxes on it, that rises by 5 cm from one half to the other.
nav::floor_map boxes_on_floor(random_bits& random, int count) {
  nav::floor_map map{.resolution = 0.1, .origin = {-1.0, 0.5}, .floor = 0.2};
  map.states = image<nav::floor_state>(40, 30, nav::floor_state::free);
  map.heights = image<float>(40, 30, 0.2F);
  for (int y = 0; y != 30; ++y)
    for (int x = 20; x != 40; ++x) map.heights(x, y) = 0.25F;
  for (int i = 0; i != count; ++i) {
    const int x = static_cast<int>(random.below(38)), y = static_cast<int>(random.below(28));
    for (int j = 0; j != 4; ++j)
      map.states(x + j % 2, y + j / 2) = i % 6 == 0 ? nav::floor_state::unknown : nav::floor_state::occupied;
  }
  return map;
}

/// Bounds, continuity, rest at both ends, by dense samples; the robot is free at each of them by the exact test.
template <class View>
void check(const View& view, const std::vector<vec3>& points, const nav::motion_limits& limits) {
  const nav::robot_trajectory motion = nav::make_trajectory(view, points, limits);
  const double duration = motion.duration();
  REQUIRE(std::isfinite(duration));
  const auto first = motion.at(0.0), last = motion.at(duration);
  CHECK(first.position == points.front());
  CHECK((last.position - points.back()).norm() < 1e-9);
  CHECK((motion.at(duration - 1e-9).position - points.back()).norm() < 1e-6);
  CHECK(first.velocity.norm() == 0.0);
  CHECK(last.velocity.norm() == 0.0);
  CHECK(motion.at(-1.0).position == points.front());
  CHECK(motion.at(duration + 1.0).velocity.norm() == 0.0);
  CHECK(motion.at(1e-7).velocity.norm() < 1e-5);
  CHECK(motion.at(duration - 1e-7).velocity.norm() < 1e-5);

  const double dt = 1e-3 / limits.speed;  // at most 1 mm
  double length = 0.0, top_speed = 0.0, top_acceleration = 0.0, jump = 0.0, slope = 0.0;
  std::size_t blocked = 0;
  nav::motion_state before = first;
  const auto steps = static_cast<std::size_t>(duration / dt);
  for (std::size_t i = 1; i <= steps; ++i) {
    const nav::motion_state now = motion.at(static_cast<double>(i) * dt);
    top_speed = std::max(top_speed, now.velocity.norm());
    top_acceleration = std::max(top_acceleration, now.acceleration.norm());
    const vec3 moved = now.position - before.position;
    length += moved.norm();
    jump = std::max(jump, (now.velocity - before.velocity).norm());
    slope = std::max(slope, (moved - 0.5 * dt * (now.velocity + before.velocity)).norm());
    blocked += is_blocked(view, now.position) ? 1 : 0;
    before = now;
  }
  CHECK(blocked == 0);
  CHECK(top_speed <= limits.speed * (1.0 + 1e-9));
  CHECK(top_acceleration <= limits.acceleration * (1.0 + 1e-9));
  CHECK(jump <= limits.acceleration * dt * (1.0 + 1e-6) + 1e-12);        // velocity is the integral of what is bounded
  CHECK(slope <= limits.acceleration * dt * dt * (1.0 + 1e-6) + 1e-12);  // and position the integral of velocity
  CHECK(length <= nav::path_length(points) + 1e-9);
}

}  // namespace

TEST_CASE("A straight way is a trapezoid, or a triangle where it is short") {
  random_bits random{1};
  const map_type map = boxes(random, 0);
  const nav::distance_field field{map, {.reach = 0.6}};
  const nav::planning_view view{map, field, 0.2};
  const vec3 a{0.5, 0.5, 0.7};
  const auto trapezoid = nav::make_trajectory(view, {a, a + 2.0 * vec3::UnitX()}, {.speed = 1.0, .acceleration = 2.0});
  CHECK(trapezoid.duration() == Approx(2.5));  // 0.5 s faster, 1.5 s at full speed, 0.5 s slower
  CHECK(trapezoid.at(0.25).velocity.x() == Approx(0.5));
  CHECK(trapezoid.at(0.25).acceleration.x() == Approx(2.0));
  CHECK(trapezoid.at(1.0).position.x() == Approx(1.25));
  CHECK(trapezoid.at(1.0).velocity.x() == Approx(1.0));
  CHECK(trapezoid.at(2.25).acceleration.x() == Approx(-2.0));
  const auto triangle = nav::make_trajectory(view, {a, a + 0.5 * vec3::UnitY()}, {.speed = 5.0, .acceleration = 2.0});
  CHECK(triangle.duration() == Approx(1.0));
  CHECK(triangle.at(0.5).velocity.y() == Approx(1.0));
  for (const auto& points : {std::vector<vec3>{a}, std::vector<vec3>{a, a, a}}) {
    const auto nothing = nav::make_trajectory(view, points);
    CHECK(nothing.duration() == 0.0);
    CHECK(nothing.at(0.0).position == a);
    CHECK(nothing.at(1.0).position == a);
  }
}

TEST_CASE("Corners are rounded where the robot fits, and it stops where it does not") {
  random_bits random{1};
  map_type map = boxes(random, 0);
  const std::vector<vec3> points{{0.5, 0.5, 0.7}, {2.5, 0.5, 0.7}, {2.5, 2.5, 0.7}};
  {
    const nav::distance_field field{map, {.reach = 0.6}};
    const nav::planning_view view{map, field, 0.2};
    const auto motion = nav::make_trajectory(view, points);
    CHECK(motion.pieces().size() == 1);  // the curve takes both legs
    CHECK(motion.stops() == 0);
    check(view, points, {});
    // It does not stop, and is faster than with a stop.
    double slowest = 1.0;
    for (double t = 0.5; t < motion.duration() - 0.5; t += 0.01)
      slowest = std::min(slowest, motion.at(t).velocity.norm());
    CHECK(slowest > 0.3);
    CHECK(motion.duration() < 2 * nav::make_trajectory(view, {points[0], points[1]}).duration());
    // There and back again: no curve turns on the spot.
    const std::vector<vec3> back{points[0], points[1], points[0]};
    const auto reverse = nav::make_trajectory(view, back);
    CHECK(std::isfinite(reverse.duration()));
    check(view, back, {});
  }
  // A pole on the inside of the corner: a smaller curve.
  const std::uint32_t o = map.grid().cells() / 2;
  for (std::uint32_t z = 0; z != 15; ++z) set(map, {o + 22, o + 7, o + z}, 1.0F);
  {
    const nav::distance_field field{map, {.reach = 0.6}};
    const nav::planning_view view{map, field, 0.1999};
    REQUIRE(view.is_free(points[0], points[1]));
    REQUIRE(view.is_free(points[1], points[2]));
    const auto motion = nav::make_trajectory(view, points);
    CHECK(motion.pieces().size() == 3);
    CHECK(motion.stops() == 0);
    check(view, points, {});
  }
  // A way round a pole that it nearly touches before and after the corner: the corner itself is a hair's breadth
  // farther away, and there is no room for a curve.
  for (std::uint32_t z = 0; z != 15; ++z) set(map, {o + 14, o + 15, o + z}, 1.0F);
  const nav::distance_field field{map, {.reach = 0.6}};
  const nav::planning_view view{map, field, 0.2};
  const double turn = 0.05, half = std::sqrt(0.5);
  const vec3 along{half, half, 0.0}, out{half, -half, 0.0};
  const vec3 corner = vec3{1.5, 1.5, 0.7} + (0.2 + 1e-6) / std::cos(turn) * out;
  const std::vector<vec3> tight{corner - 1.2 * (std::cos(turn) * along + std::sin(turn) * out), corner,
                                corner + 1.2 * (std::cos(turn) * along - std::sin(turn) * out)};
  REQUIRE(view.is_free(tight[0], tight[1]));
  REQUIRE(view.is_free(tight[1], tight[2]));
  CHECK_FALSE(view.is_free(tight[0], tight[2]));
  const auto motion = nav::make_trajectory(view, tight);
  CHECK(motion.stops() == 1);
  CHECK(motion.pieces().size() == 2);
  const double at_corner = 2.2;  // 1 m/s and 1 m/s^2 over 1.2 m
  CHECK(motion.at(at_corner).velocity.norm() < 1e-9);
  CHECK((motion.at(at_corner).position - corner).norm() < 1e-9);
  check(view, tight, {});
}

TEST_CASE("Trajectories of paths between boxes keep their bounds and touch nothing") {
  std::size_t smooth = 0, stops = 0, found = 0;
  for (std::uint64_t seed = 1; seed != 9; ++seed) {
    random_bits random{seed};
    const map_type map = boxes(random, 60);
    const nav::distance_field field{map, {.reach = 0.6}};
    const auto run = [&](const auto& view) {
      for (int i = 0; i != 4; ++i) {
        const auto place = [&] {
          for (;;) {
            const vec3 p{3.0 * random.uniform(), 3.0 * random.uniform(), 1.5 * random.uniform()};
            if (view.is_free(p)) return p;
          }
        };
        const vec3 a = place(), b = place();
        const nav::path_options options{.shorten = i % 2 == 0};
        const auto path = nav::find_path(view, a, b, options);
        if (path.status != nav::path_status::found) continue;
        ++found;
        const nav::motion_limits limits{.speed = random.uniform(0.3, 2.0), .acceleration = random.uniform(0.5, 4.0)};
        check(view, path.points, limits);
        const auto motion = nav::make_trajectory(view, path.points, limits);
        smooth += path.points.size() - 2 - motion.stops();
        stops += motion.stops();
      }
    };
    run(nav::planning_view{map, field, 0.12});
    run(nav::planning_view{map, field, nav::vertical_cylinder{.radius = 0.1, .low = -0.1, .high = 0.15}});
    run(nav::planning_view{map, field, nav::vertical_capsule{.radius = 0.1, .low = -0.1, .high = 0.1}});
    run(nav::planning_view{map, field, elsewhere::pendulum{}});
  }
  CHECK(found > 40);
  CHECK(smooth > 3 * stops);
}

TEST_CASE("Trajectories over a floor keep their bounds and touch no blocked cell") {
  std::size_t smooth = 0, stops = 0, found = 0;
  for (std::uint64_t seed = 1; seed != 9; ++seed) {
    random_bits random{seed};
    const nav::floor_map map = boxes_on_floor(random, 30);
    const auto run = [&](const nav::floor_view& view, const nav::floor_view& disc) {
      for (int i = 0; i != 4; ++i) {
        const auto place = [&] {
          for (;;) {
            const vec3 p{random.uniform(-1.0, 3.0), random.uniform(0.5, 3.5), 0.0};
            if (view.is_free(p) && disc.is_free(p)) return p;
          }
        };
        const vec3 a = place(), b = place();
        const auto path = nav::find_path(view, a, b, {.shorten = i % 2 == 0});
        if (path.status != nav::path_status::found) continue;
        ++found;
        const nav::motion_limits limits{.speed = random.uniform(0.3, 2.0), .acceleration = random.uniform(0.5, 4.0)};
        if (&view == &disc) check(view, path.points, limits);
        const auto motion = nav::make_trajectory(view, path.points, limits);
        for (double t = 0.0; t < motion.duration(); t += 0.01) CHECK(view.is_free(motion.at(t).position));
        CHECK(motion.at(0.0).position == view.on_ground(a));
        CHECK((motion.at(motion.duration()).position - view.on_ground(b)).norm() < 1e-9);
        smooth += path.points.size() - 2 - motion.stops();
        stops += motion.stops();
      }
    };
    const nav::floor_view disc{map, 0.12};
    run(disc, disc);
    const auto costs = nav::inflate(map, {.radius = 0.12});
    run(nav::floor_view{map, costs, {.clearance_weight = 2.0}}, disc);
  }
  CHECK(found > 40);
  CHECK(smooth > 3 * stops);
}

TEST_CASE("Legs that are next to nothing, or nothing, leave a trajectory within its bounds") {
  random_bits random{23};
  const map_type map = boxes(random, 0);
  const nav::distance_field field{map, {.reach = 0.6, .unknown = octree::occupancy::free}};
  const nav::planning_view view{map, field, 0.1};
  constexpr std::array lengths{0.0,    5e-324, 1e-300, 1e-160, 1e-16, 1e-12, 9e-10, 1e-9,
                               1.1e-9, 2e-9,   1e-8,   1e-6,   1e-3,  0.1,   1.0};
  int moving = 0, rounded = 0;
  for (int i = 0; i != 2000; ++i) {
    // Where coordinates are 0 the legs are as short as they are said to be.
    const vec3 first = i % 2 == 0 ? vec3{1.5, 1.5, 0.7} : vec3{0.0, 1.5, 0.7};
    std::vector<vec3> points{first};
    const std::uint32_t legs = 1 + random.below(8);
    for (std::uint32_t j = 0; j != legs; ++j) {
      const double length = lengths[random.below(i % 3 == 0 ? 11 : lengths.size())];
      const vec3 direction =
          i % 4 == 1 ? vec3{random.normal(), 0.0, 0.0} : vec3{random.normal(), random.normal(), 0.3 * random.normal()};
      vec3 to = points.back() + length * direction;
      if (j != 0 && random.below(8) == 0) to = points[points.size() - 2];  // and back again
      points.push_back(to);
    }
    const nav::motion_limits limits{.speed = std::pow(10.0, random.uniform(-3.0, 2.0)),
                                    .acceleration = std::pow(10.0, random.uniform(-3.0, 2.0))};
    const auto motion = nav::make_trajectory(view, points, limits);
    const double duration = motion.duration();
    REQUIRE(std::isfinite(duration));
    CHECK(motion.at(0.0).position == points.front());
    CHECK((motion.at(duration).position - points.back()).norm() < 1e-14);
    if (duration == 0.0) continue;
    ++moving;
    for (const nav::path_piece& p : motion.pieces()) rounded += p.direction != p.turned ? 1 : 0;
    // In halves, so long as the direction changes: a corner may be over in a moment.
    double top_speed = 0.0, top_acceleration = 0.0, jump = 0.0, slope = 0.0, length = 0.0;
    const auto look = [&](const nav::motion_state& now) {
      top_speed = std::max(top_speed, now.velocity.norm());
      top_acceleration = std::max(top_acceleration, now.acceleration.norm());
    };
    const auto halve = [&](auto&& self, double t0, const nav::motion_state& s0, double t1, const nav::motion_state& s1,
                           int halvings) -> void {
      const double dt = t1 - t0, t = t0 + 0.5 * dt;
      const bool turns = s0.velocity.dot(s1.velocity) < 0.99 * s0.velocity.norm() * s1.velocity.norm();
      if (halvings > 0 && t0 < t && t < t1 && (halvings > 33 || turns)) {
        const nav::motion_state middle = motion.at(t);
        look(middle);
        self(self, t0, s0, t, middle, halvings - 1);
        self(self, t, middle, t1, s1, halvings - 1);
        return;
      }
      jump = std::max(jump, (s1.velocity - s0.velocity).norm() - limits.acceleration * dt * (1.0 + 1e-6));
      const vec3 moved = s1.position - s0.position;
      slope = std::max(slope, (moved - 0.5 * dt * (s1.velocity + s0.velocity)).norm() - limits.acceleration * dt * dt);
      length += moved.norm();
    };
    halve(halve, 0.0, motion.at(0.0), duration, motion.at(duration), 40);
    // What is not a number is not less either.
    CHECK(top_speed <= limits.speed * (1.0 + 1e-9));
    CHECK(top_acceleration <= limits.acceleration * (1.0 + 1e-9));
    CHECK(jump <= 1e-9 * limits.speed);
    CHECK(slope <= 1e-14);
    CHECK(length <= nav::path_length(points) + 1e-12);
  }
  CHECK(moving > 1000);
  CHECK(rounded > 1000);
}

TEST_CASE("What is free for a thicker robot is free for the robot with all that is near it") {
  random_bits random{5};
  const map_type map = boxes(random, 60);
  const nav::distance_field field{map, {.reach = 0.6}};
  const nav::floor_map floor = boxes_on_floor(random, 30);
  std::array<int, 2> seen{};
  const auto compare = [&](const auto& thin, const auto& thick, double by) {
    for (int i = 0; i != 600; ++i) {
      const vec3 a{random.uniform(-1.0, 3.0), random.uniform(0.0, 3.5), random.uniform(0.0, 1.5)};
      const vec3 b = a + vec3{random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(-0.2, 0.2)};
      const bool expected = thick.is_free(a, b);
      CHECK(thin.is_free(a, b, by) == expected);
      CHECK(thin.is_free(a, b, 0.0) == thin.is_free(a, b));
      ++seen[expected ? 1 : 0];
    }
  };
  compare(nav::planning_view{map, field, 0.1}, nav::planning_view{map, field, 0.17}, 0.07);
  compare(nav::planning_view{map, field, nav::vertical_capsule{0.1, 0.0, 0.2}},
          nav::planning_view{map, field, nav::vertical_capsule{0.15, 0.0, 0.2}}, 0.05);
  compare(nav::planning_view{map, field, nav::vertical_cylinder{0.1, 0.0, 0.2}},
          nav::planning_view{map, field, nav::vertical_cylinder{0.15, -0.05, 0.25}}, 0.05);
  compare(nav::floor_view{floor, 0.1}, nav::floor_view{floor, 0.17}, 0.07);
  CHECK(seen[0] > 100);
  CHECK(seen[1] > 100);
}
