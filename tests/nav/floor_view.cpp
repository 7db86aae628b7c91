// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <orbis/core/random.hpp>
#include <orbis/nav/floor_cost.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/path_search.hpp>

#include "nav/dijkstra.hpp"
#include "support/catch.hpp"

using namespace orbis;
using nav::floor_state;
using nav::path_method;
using nav::path_status;
using octree::occupancy;

namespace {

constexpr double cell = 0.1;
static_assert(nav::planning_space<nav::floor_view>);

nav::floor_map empty_floor(int width, int height) {
  nav::floor_map map{.resolution = cell, .floor = 0.2};
  map.states = image<floor_state>(width, height, floor_state::free);
  map.heights = image<float>(width, height, 0.2F);
  return map;
}
/// With boxes in it, and cells of which nothing is known.
nav::floor_map random_floor(random_bits& random, int width, int height, int boxes) {
  nav::floor_map map = empty_floor(width, height);
  const auto below = [&](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
  for (int i = 0; i != boxes; ++i) {
    const int left = below(width), low = below(height), right = left + 1 + below(5), high = low + 1 + below(5);
    for (int y = low; y < std::min(high, height); ++y)
      for (int x = left; x < std::min(right, width); ++x)
        map.states(x, y) = i % 5 == 0 ? floor_state::unknown : floor_state::occupied;
  }
  return map;
}
/// Whether a disc touches a blocked cell on its way, by all cells in the box around it, also outside of the map.
bool is_free(const nav::floor_map& map, vec3 a, vec3 b, double radius, bool unknown_blocks) {
  a.z() = b.z() = 0.0;
  const auto index = [](double p, double origin) { return static_cast<int>(std::floor((p - origin) / cell)); };
  const vec3 low_end = a.cwiseMin(b), high_end = a.cwiseMax(b);
  for (int y = index(low_end.y() - radius, map.origin.y()) - 1; y <= index(high_end.y() + radius, map.origin.y()) + 1;
       ++y)
    for (int x = index(low_end.x() - radius, map.origin.x()) - 1; x <= index(high_end.x() + radius, map.origin.x()) + 1;
         ++x) {
      const vec2 middle = map.center(x, y);
      const floor_state s = map.state(middle);
      if (s == floor_state::free || (s == floor_state::unknown && !unknown_blocks)) continue;
      const vec3 low{map.origin.x() + cell * x, map.origin.y() + cell * y, 0.0};
      if (touches(octree::capsule{a, b, radius}, octree::bounding_box{low, low + vec3{cell, cell, 0.0}})) return false;
    }
  return true;
}
vec3 random_point(random_bits& random, const nav::floor_map& map) {
  return {map.origin.x() + cell * map.states.width() * random.uniform(),
          map.origin.y() + cell * map.states.height() * random.uniform(), random.uniform()};
}

}  // namespace

TEST_CASE("Whether a disc is free on a floor is what all its cells say") {
  random_bits random{41};
  for (const bool unknown_blocks : {true, false}) {
    nav::floor_map map = random_floor(random, 40, 30, 25);
    map.origin = {-1.23, 0.77};
    std::array<int, 2> seen{};
    for (const double radius : {0.04, 0.13, 0.31}) {
      const nav::floor_view view{map, radius, {}, unknown_blocks ? occupancy::occupied : occupancy::free};
      for (int i = 0; i != 500; ++i) {
        const vec3 a = random_point(random, map), b = i % 3 == 0 ? a : random_point(random, map);
        const bool expected = is_free(map, a, b, radius, unknown_blocks);
        CHECK(view.is_free(a, b) == expected);
        const auto k = *view.key(a);
        CHECK(view.is_free(k) == is_free(map, view.center(k), view.center(k), radius, unknown_blocks));
        ++seen[expected ? 1 : 0];
      }
    }
    CHECK(seen[0] > 100);
    CHECK(seen[1] > 100);
  }
  const nav::floor_map map = empty_floor(10, 10);
  const nav::floor_view view{map, 0.1};
  CHECK_FALSE(view.is_free(vec3{-0.5, 0.5, 0.0}));
  CHECK_FALSE(view.is_free(vec3{0.05, 0.5, 0.0}));  // leaves the map
  CHECK(view.is_free(vec3{0.15, 0.5, 7.0}));
  CHECK_FALSE(view.is_free(vec3{std::nan(""), 0.5, 0.0}));
}

TEST_CASE("A path over a floor is as cheap as Dijkstra's, free, and at the floor's height") {
  random_bits random{42};
  int found = 0, bent = 0, unreachable = 0;
  for (int round = 0; round != 12; ++round) {
    nav::floor_map map = random_floor(random, 24, 20, 14);
    for (int y = 0; y != 20; ++y)
      for (int x = 0; x != 24; ++x) map.heights(x, y) = 0.01F * static_cast<float>(x);
    const bool unknown_blocks = round % 2 == 0, is_wary = round % 3 == 0;
    const double radius = 0.11, wanted = 0.4, weight = is_wary ? 3.0 : 0.0, unknown_cost = unknown_blocks ? 1.0 : 2.5;
    const nav::floor_view view{
        map,
        radius,
        {.clearance_weight = weight, .preferred_clearance = wanted, .unknown_cost = unknown_cost},
        unknown_blocks ? occupancy::occupied : occupancy::free};
    const auto free = [&](const vec3& a, const vec3& b) { return is_free(map, a, b, radius, unknown_blocks); };
    const auto density = [&](const std::array<int, 3>& p) {
      double nearest = 1e9;
      for (int y = -1; y <= 20; ++y)
        for (int x = -1; x <= 24; ++x) {
          const floor_state s = map.state(map.center(x, y));
          if (s == floor_state::occupied || (s == floor_state::unknown && unknown_blocks))
            nearest = std::min(nearest, cell * std::hypot(x - p[0], y - p[1]));
        }
      const double lacking = std::max(0.0, 1.0 - std::max(0.0, nearest - radius) / wanted);
      return (1.0 + weight * lacking * lacking) * (map.states(p[0], p[1]) == floor_state::unknown ? unknown_cost : 1.0);
    };
    for (int i = 0; i != 8; ++i) {
      const auto draw = [&] {
        for (;;) {
          vec3 p = random_point(random, map);
          // Where metres do not all cost the same, the way to the middle of a cell counts as well.
          if (!view.is_uniform()) p = view.center(*view.key(p));
          if (view.is_free(p)) return p;
        }
      };
      const vec3 start = draw(), goal = draw();
      CAPTURE(round, i);
      const auto grid = nav::find_path(view, start, goal, {.method = path_method::grid, .shorten = false});
      const auto path = nav::find_path(view, start, goal);
      const auto flat = [](const vec3& p) { return vec3{p.x(), p.y(), 0.0}; };
      const double expected = test::cheapest_on_grid(
          {24, 20, 1},
          [&](const std::array<int, 3>& p) {
            return vec3{cell * (p[0] + 0.5), cell * (p[1] + 0.5), 0.0};
          },
          free, density, cell, flat(start), flat(goal));
      if (std::isinf(expected)) {
        CHECK(grid.status == path_status::unreachable);
        ++unreachable;
        continue;
      }
      ++found;
      REQUIRE(grid.status == path_status::found);
      REQUIRE(path.status == path_status::found);
      CHECK(grid.cost == Approx(expected).epsilon(1e-9));
      for (const auto* p : {&grid, &path}) {
        CHECK(flat(p->points.front()) == flat(start));
        CHECK(flat(p->points.back()) == flat(goal));
        CHECK(p->cost == Approx(nav::path_cost(view, p->points)));
        for (std::size_t j = 0; j != p->points.size(); ++j) {
          CHECK(p->points[j].z() == Approx(0.01 * (*map.cell(p->points[j]))[0]).margin(1e-6));
          if (j == 0) continue;
          const vec3 a = flat(p->points[j - 1]), way = flat(p->points[j]) - a;
          CHECK(free(a, a + way));
          const int steps = std::max(1, static_cast<int>(std::ceil(way.norm() / 0.001)));
          for (int s = 0; s <= steps; ++s) REQUIRE(free(a + way * s / steps, a + way * s / steps));
        }
      }
      bent += path.points.size() > 2 ? 1 : 0;
    }
  }
  CHECK(found > 40);
  CHECK(bent > 15);
  CHECK(unreachable > 0);
}

TEST_CASE("Why there is no path over a floor") {
  nav::floor_map map = empty_floor(40, 20);
  for (int y = 0; y != 20; ++y)
    for (int x = 19; x != 21; ++x)
      if (y < 8 || y >= 12) map.states(x, y) = floor_state::occupied;
  const vec3 start{0.5, 0.4, 0.0}, goal{3.5, 0.4, 0.0};
  const auto plan = [&](double radius, const vec3& from, const vec3& to, const nav::path_options& options = {}) {
    return nav::find_path(nav::floor_view{map, radius}, from, to, options);
  };
  const auto through = plan(0.15, start, goal);
  CHECK(through.status == path_status::found);
  CHECK(through.points.size() > 2);
  CHECK(through.length < 1.2 * (goal - start).norm());
  const auto too_wide = plan(0.21, start, goal);
  CHECK(too_wide.status == path_status::unreachable);
  CHECK(too_wide.points.back().x() == Approx(1.75));  // in the mouth of the hole
  CHECK(too_wide.points.back().z() == Approx(0.2));
  CHECK(plan(0.15, vec3{1.95, 0.2, 0.0}, goal).status == path_status::start_blocked);
  CHECK(plan(0.15, vec3{-1.0, 0.2, 0.0}, goal).status == path_status::start_outside);
  CHECK(plan(0.15, start, vec3{1.95, 0.2, 0.0}).status == path_status::goal_blocked);
  CHECK(plan(0.15, start, vec3{5.0, 0.2, 0.0}).status == path_status::goal_outside);
  CHECK(plan(0.15, start, vec3{0.5, std::nan(""), 0.0}).status == path_status::goal_outside);
  CHECK(plan(0.15, start, goal, {.max_expanded = 5}).status == path_status::gave_up);
  const octree::bounding_box left{{0.0, 0.0, 0.0}, {1.5, 2.0, 0.0}};
  CHECK(nav::find_path(nav::floor_view{map, 0.15, {.region = left}}, start, goal).status == path_status::goal_outside);
}

TEST_CASE("A path over a cost map") {
  nav::floor_map map = empty_floor(60, 30);
  for (int x = 0; x != 40; ++x) map.states(x, 15) = floor_state::occupied;
  map.states(55, 5) = floor_state::unknown;
  const auto costs = nav::inflate(map, {.radius = 0.2, .inflation_radius = 1.0});
  const vec3 start{0.5, 0.65, 0.0}, goal{0.5, 2.45, 0.0};
  const nav::floor_view direct{map, costs}, wary{map, costs, {.clearance_weight = 20.0}};
  CHECK(direct.is_uniform());
  CHECK_FALSE(direct.is_free(vec3{1.0, 1.4, 0.0}));  // inscribed
  CHECK_FALSE(direct.is_free(vec3{5.55, 0.55, 0.0}));
  CHECK(nav::floor_view{map, costs, {}, occupancy::free}.is_free(vec3{5.55, 0.55, 0.0}));
  const auto highest = [&](const nav::found_path& path) {
    int most = 0;
    for (std::size_t i = 1; i < path.points.size(); ++i)
      for (int s = 0; s <= 500; ++s) {
        const vec3 p = path.points[i - 1] + 0.002 * s * (path.points[i] - path.points[i - 1]);
        const auto at = *map.cell(p);
        most = std::max<int>(most, costs(at[0], at[1]));
      }
    return most;
  };
  const auto near = nav::find_path(direct, start, goal), far = nav::find_path(wary, start, goal);
  REQUIRE(near.status == path_status::found);
  REQUIRE(far.status == path_status::found);
  CHECK(highest(near) < nav::floor_cost::inscribed);
  CHECK(highest(far) < highest(near));
  CHECK(far.length > near.length);
  CHECK(far.cost < nav::path_cost(wary, near.points));
  CHECK(near.cost == Approx(near.length));
}

namespace {

/// Says how often it was asked what lies outside of it.
struct watched_floor : nav::floor_view {
  using nav::floor_view::floor_view;
  [[nodiscard]] double density(const octree::voxel_key& k) const {
    if (contains(k)) return 1.0;
    ++outside;
    return 1.0;
  }
  mutable int outside = 0;
};

}  // namespace

TEST_CASE("What a long way to the corner of a floor costs is asked of its cells only") {
  random_bits random{9};
  for (int round = 0; round != 30; ++round) {
    nav::floor_map map = empty_floor(20000, 3);
    map.resolution = random.uniform(0.01, 0.1);
    map.origin = {random.uniform(-300.0, 0.0), random.uniform(-300.0, 0.0)};
    const watched_floor view{map, 0.01, {.clearance_weight = 1.0}, occupancy::free};
    const vec3 corner{map.origin.x(), map.origin.y(), 0.0};
    for (int i = 0; i != 5; ++i) {
      const vec3 p = corner + map.resolution * vec3{random.uniform(0.0, 20000.0), random.uniform(0.0, 3.0), 0.0};
      const double length = (p - corner).norm();
      CHECK(nav::path_cost(view, {p, corner}) == Approx(length).epsilon(1e-12));
      CHECK(nav::path_cost(view, {corner, p}) == Approx(length).epsilon(1e-12));
    }
    CHECK(view.outside == 0);
  }
}
