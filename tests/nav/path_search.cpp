// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "nav/dijkstra.hpp"
#include "nav/maze.hpp"
#include "support/catch.hpp"

using namespace orbis;
using nav::path_method;
using nav::path_status;
using octree::occupancy;
using octree::voxel_key;
using test::cell, test::is_free, test::key, test::map_type, test::maze, test::random_point, test::set;

namespace {

/// What a path has to be as cheap as: Dijkstra's algorithm, with the exact capsule test.
double shortest(const map_type& map, std::array<int, 3> size, const vec3& start, const vec3& goal, double radius) {
  return test::cheapest_on_grid(
      size, [&](const std::array<int, 3>& p) { return map.grid().center(key(p[0], p[1], p[2])); },
      [&](const vec3& a, const vec3& b) { return is_free(map, a, b, radius, occupancy::occupied); },
      [](const std::array<int, 3>&) { return 1.0; }, cell, start, goal);
}

}  // namespace

TEST_CASE("A path over the voxels is as short as Dijkstra's, and shortening keeps it free") {
  random_bits random{2};
  const std::array<int, 3> size{16, 14, 10};
  int found = 0, unreachable = 0, bent = 0;
  for (int round = 0; round != 10; ++round) {
    map_type map = maze(random, size, 16);
    for (int z = 0; z != size[2]; ++z)  // a wall with a hole, in some of the rounds
      for (int y = 0; y != size[1]; ++y)
        if (round % 5 == 0 || y < 4 || y > 8 || z < 2 || z > 6) set(map, 8, y, z, true);
    const nav::distance_field field{map, {.reach = 0.6}};
    const double radius = round % 2 == 0 ? 0.08 : 0.14;
    const nav::planning_view view{map, field, radius};
    for (int i = 0; i != 12; ++i) {
      const auto draw = [&] {  // mostly free
        vec3 p = random_point(random, size);
        for (int j = 0; j != 8 && !view.is_free(p); ++j) p = random_point(random, size);
        return p;
      };
      const vec3 start = draw(), goal = draw();
      CAPTURE(round, i);
      const bool start_free = is_free(map, start, start, radius, occupancy::occupied);
      const bool goal_free = is_free(map, goal, goal, radius, occupancy::occupied);
      const auto grid = nav::find_path(view, start, goal, {.method = path_method::grid, .shorten = false});
      const auto shortened = nav::find_path(view, start, goal, {.method = path_method::grid});
      const auto path = nav::find_path(view, start, goal);
      CHECK(path.status == grid.status);
      if (!start_free) {
        CHECK(grid.status == path_status::start_blocked);
        CHECK(grid.points.empty());
        continue;
      }
      CHECK(grid.points.front() == start);
      CHECK(path.points.front() == start);
      CHECK(shortened.status == path.status);
      CHECK(shortened.length <= grid.length + 1e-12);
      for (const auto* p : {&grid.points, &shortened.points, &path.points})
        for (std::size_t j = 1; j < p->size(); ++j)
          CHECK(is_free(map, (*p)[j - 1], (*p)[j], radius, occupancy::occupied));
      if (!goal_free) {
        CHECK(grid.status == path_status::goal_blocked);
        continue;
      }
      const double expected = shortest(map, size, start, goal, radius);
      if (std::isinf(expected)) {
        // The straight way may be free where the grid has none.
        const bool straight = is_free(map, start, goal, radius, occupancy::occupied);
        CHECK(grid.status == path_status::unreachable);
        CHECK(path.status == (straight ? path_status::found : path_status::unreachable));
        ++unreachable;
        continue;
      }
      ++found;
      CHECK(grid.status == path_status::found);
      CHECK(grid.length == Approx(expected).epsilon(1e-12));
      CHECK(grid.points.back() == goal);
      CHECK(path.points.back() == goal);
      CHECK(path.length == Approx(nav::path_length(path.points)));
      CHECK(path.length >= (goal - start).norm() - 1e-12);
      bent += path.points.size() > 2 ? 1 : 0;
    }
  }
  CHECK(found > 40);
  CHECK(bent > 20);
  CHECK(unreachable > 5);
}

TEST_CASE("The way to an obstacle in the open does not look at the whole world") {
  map_type map{cell};
  set(map, 150, 0, 0, true);
  const nav::distance_field field{map, {.reach = 0.8, .unknown = occupancy::free}};
  const vec3 start{1, 1, 1}, goal{15.05, 0.05, 0.05};
  const auto way = nav::find_path(nav::planning_view{map, field, 0.15}, start, goal, {.max_expanded = 20000});
  CHECK(way.status == path_status::goal_blocked);
  REQUIRE(way.points.size() >= 2);
  CHECK((way.points.back() - goal).norm() < 0.5);
}

TEST_CASE("Where the goal cannot be reached the path leads to the nearest cell of all that can") {
  random_bits random{17};
  const std::array<int, 3> size{24, 24, 12};
  std::array<int, 2> seen{};  // goals that are blocked, and enclosed
  for (int round = 0; round != 10; ++round) {
    // Rooms of all sizes, some of whose free voxels hang together by edges and corners alone, where no robot passes.
    map_type map{cell};
    const double share = random.uniform(0.35, 0.65);
    for (int z = 0; z != size[2]; ++z)
      for (int y = 0; y != size[1]; ++y)
        for (int x = 0; x != size[0]; ++x) set(map, x, y, z, x % 8 == 0 || (x > 8 && random.uniform() < share));
    if (round % 2 == 0) set(map, 8, 3, 3, false);
    const nav::distance_field field{map, {.reach = 0.6}};
    const nav::planning_view view{map, field, 0.03};
    std::map<std::array<int, 3>, bool> reached;
    const auto for_each_near = [&](const std::array<int, 3>& p, auto&& visit) {
      for (int z = -1; z <= 1; ++z)
        for (int y = -1; y <= 1; ++y)
          for (int x = -1; x <= 1; ++x)
            if (x != 0 || y != 0 || z != 0) visit(std::array{p[0] + x, p[1] + y, p[2] + z});
    };
    const auto middle = [&](const std::array<int, 3>& p) { return map.grid().center(key(p[0], p[1], p[2])); };
    const vec3 start = middle({4, 4, 4});
    std::vector<std::array<int, 3>> open{{4, 4, 4}};
    reached[open[0]] = true;
    while (!open.empty()) {
      const auto p = open.back();
      open.pop_back();
      for_each_near(p, [&](const std::array<int, 3>& q) {
        if (!view.is_free(middle(p), middle(q)) || !reached.emplace(q, true).second) return;
        open.push_back(q);
      });
    }
    for (int i = 0; i != 40; ++i) {
      vec3 goal = random_point(random, size);
      if (i % 2 == 0) goal = map.grid().center(*map.grid().key(goal));
      if (i % 8 == 1) goal += vec3{1.0, -3.0, 2.0};  // in the unknown
      if (view.is_free(goal) &&
          (i % 2 != 0 || reached.contains({static_cast<int>(goal.x() / cell), static_cast<int>(goal.y() / cell),
                                           static_cast<int>(goal.z() / cell)})))
        continue;
      ++seen[view.is_free(goal) ? 1 : 0];
      double least = 1e9;
      for (const auto& [p, is_reached] : reached) least = std::min(least, (middle(p) - goal).norm());
      for (const path_method method : {path_method::grid, path_method::any_angle}) {
        const auto path = nav::find_path(view, start, goal, {.method = method});
        CHECK(path.status == (view.is_free(goal) ? path_status::unreachable : path_status::goal_blocked));
        REQUIRE_FALSE(path.points.empty());
        CHECK(path.points.front() == start);
        CHECK((path.points.back() - goal).norm() == Approx(least).margin(1e-9));
        for (std::size_t j = 1; j < path.points.size(); ++j) CHECK(view.is_free(path.points[j - 1], path.points[j]));
      }
    }
  }
  CHECK(seen[0] > 100);
  CHECK(seen[1] > 30);
}

TEST_CASE("An enclosed goal or start is found to be so without a look at the whole world") {
  // A hollow box in a world of which nothing else is known, and which is free.
  map_type map{cell};
  for (int z = 0; z != 12; ++z)
    for (int y = 0; y != 12; ++y)
      for (int x = 0; x != 12; ++x) set(map, x, y, z, std::min({x, y, z}) == 0 || std::max({x, y, z}) == 11);
  const nav::distance_field field{map, {.reach = 0.8, .unknown = occupancy::free}};
  const nav::planning_view view{map, field, 0.15};
  const vec3 inside{0.6, 0.6, 0.6}, outside{-3.0, 0.6, 0.6};
  for (const path_method method : {path_method::grid, path_method::any_angle})
    for (const double weight : {1.0, 1.1}) {
      const nav::path_options options{.method = method, .heuristic_weight = weight};
      const auto in = nav::find_path(view, outside, inside, options);
      CHECK(in.status == path_status::unreachable);
      CHECK(in.expanded < 5'000);
      CHECK((in.points.back() - inside).norm() < 0.9);  // in front of a face
      const auto out = nav::find_path(view, inside, outside, options);
      CHECK(out.status == path_status::unreachable);
      CHECK(out.expanded < 2'000);
      CHECK(out.points.back().x() == Approx(0.35));
    }
  for (int z = 4; z != 8; ++z)
    for (int y = 4; y != 8; ++y) set(map, 11, y, z, false);
  const nav::distance_field after{map, {.reach = 0.8, .unknown = occupancy::free}};
  for (const path_method method : {path_method::grid, path_method::any_angle})
    CHECK(nav::find_path(nav::planning_view{map, after, 0.15}, outside, inside, {.method = method}).status ==
          path_status::found);
}

TEST_CASE("Why there is no path, and how near one comes") {
  // Two rooms of 2 m with a wall between them, and a hole in the wall that only a small robot passes.
  map_type map{cell};
  for (int z = 0; z != 10; ++z)
    for (int y = 0; y != 20; ++y)
      for (int x = 0; x != 40; ++x) {
        const bool hole = y >= 8 && y < 12 && z >= 3 && z < 7;
        set(map, x, y, z, x == 20 && !hole);
      }
  const nav::distance_field field{map, {.reach = 0.8}};
  const vec3 start{0.5, 0.4, 0.5}, goal{3.5, 0.4, 0.5};
  const auto plan = [&](double radius, const vec3& from, const vec3& to, const nav::path_options& options = {}) {
    return nav::find_path(nav::planning_view{map, field, radius}, from, to, options);
  };
  const auto through = plan(0.15, start, goal);
  CHECK(through.status == path_status::found);
  CHECK(through.points.size() > 2);
  CHECK(through.length < 1.2 * (goal - start).norm());
  // Checked again every millimetre, against the cubes of all obstacles near.
  for (std::size_t i = 1; i != through.points.size(); ++i) {
    const vec3 a = through.points[i - 1], b = through.points[i];
    for (double t = 0.0; t < (b - a).norm(); t += 0.001)
      REQUIRE_FALSE(
          overlaps(map, octree::sphere{a + t * (b - a).normalized(), 0.15}, {.unknown = occupancy::occupied}));
  }
  const auto too_wide = plan(0.21, start, goal);
  CHECK(too_wide.status == path_status::unreachable);
  CHECK(nav::to_string(too_wide.status) == "unreachable");
  REQUIRE(too_wide.points.size() >= 2);
  CHECK(too_wide.points.back().x() == Approx(1.85));  // in front of the hole
  CHECK(too_wide.length > 0.0);
  CHECK(plan(0.15, vec3{2.05, 0.2, 0.2}, goal).status == path_status::start_blocked);
  CHECK(plan(0.15, vec3{1e7, 0.2, 0.2}, goal).status == path_status::start_outside);
  CHECK(plan(0.15, vec3{std::nan(""), 0.2, 0.2}, goal).status == path_status::start_outside);
  const auto blocked = plan(0.15, start, vec3{2.05, 0.3, 0.5});
  CHECK(blocked.status == path_status::goal_blocked);
  CHECK((blocked.points.back() - vec3{2.05, 0.3, 0.5}).norm() < 0.35);
  CHECK(plan(0.15, start, vec3{1e7, 0.0, 0.0}).status == path_status::goal_outside);
  CHECK(plan(0.15, start, vec3{0.0, std::nan(""), 0.0}).status == path_status::goal_outside);
  CHECK(plan(0.15, start, goal, {.max_expanded = 10}).status == path_status::gave_up);
  const auto far = plan(0.15, start, vec3{1e200, 0.0, 0.0});
  CHECK(far.status == path_status::goal_outside);
  CHECK(far.points.back().x() > 3.5);  // as near as it gets
  const nav::planning_view view{map, field, 0.15};
  CHECK_FALSE(view.is_free(start, vec3{1e200, 0.4, 0.5}));
  CHECK_FALSE(view.is_free(start, vec3{1e12, 0.4, 0.5}));
  CHECK(plan(0.15, start, start).status == path_status::found);
  CHECK(plan(0.15, start, start).length == 0.0);
}

TEST_CASE("What is ahead on the grid is never overrated, and never falls by more than a step costs") {
  random_bits random{3};
  for (int i = 0; i != 2000; ++i) {
    const vec3 a = random_point(random, {20, 20, 20}), b = random_point(random, {20, 20, 20});
    const vec3 c = random_point(random, {20, 20, 20});
    const double ab = nav::detail::length_in_steps(a - b);
    CHECK(ab <= nav::detail::length_in_steps(a - c) + nav::detail::length_in_steps(c - b) + 1e-12);
    CHECK(ab >= (a - b).norm() - 1e-12);
    CHECK(ab == nav::detail::length_in_steps(b - a));
  }
  for (int x = -1; x <= 1; ++x)
    for (int y = -1; y <= 1; ++y)
      for (int z = -1; z <= 1; ++z) {
        const vec3 step{cell * x, cell * y, cell * z};
        CHECK(nav::detail::length_in_steps(step) == Approx(step.norm()));
      }
}

TEST_CASE("A path that keeps its distance is as cheap as Dijkstra's, and shortening does not undo it") {
  random_bits random{4};
  const std::array<int, 3> size{15, 13, 9};
  int found = 0, dearer = 0;
  for (int round = 0; round != 8; ++round) {
    const map_type map = maze(random, size, 14, round % 2 == 0 ? 0.0 : 0.1);
    const occupancy unknown = round % 2 == 0 ? occupancy::occupied : occupancy::free;
    const nav::distance_field field{map, {.reach = 0.7, .unknown = unknown}};
    const double radius = 0.08, wanted = 0.3, weight = 4.0, unknown_cost = round % 2 == 0 ? 1.0 : 2.0;
    const octree::bounding_box inside{{0.0, 0.0, 0.0}, {cell * size[0], cell * size[1], cell * size[2]}};
    const nav::planning_view view{
        map,
        field,
        radius,
        {.region = inside, .clearance_weight = weight, .preferred_clearance = wanted, .unknown_cost = unknown_cost}};
    CHECK_FALSE(view.is_uniform());
    const auto middle = [&](const std::array<int, 3>& p) { return map.grid().center(key(p[0], p[1], p[2])); };
    std::map<std::array<int, 3>, double> known;
    const auto density = [&](const std::array<int, 3>& p) {  // from all obstacles there are
      if (const auto at = known.find(p); at != known.end()) return at->second;
      double nearest = field.reach();
      for (int z = p[2] - 7; z <= p[2] + 7; ++z)
        for (int y = p[1] - 7; y <= p[1] + 7; ++y)
          for (int x = p[0] - 7; x <= p[0] + 7; ++x) {
            const occupancy s = map.state(key(x, y, z));
            if (s == occupancy::occupied || (s == occupancy::unknown && unknown == occupancy::occupied))
              nearest = std::min(nearest, (middle({x, y, z}) - middle(p)).norm());
          }
      const double lacking = std::max(0.0, 1.0 - std::max(0.0, nearest - radius) / wanted);
      const bool is_known = map.state(key(p[0], p[1], p[2])) != occupancy::unknown;
      return known[p] = (1.0 + weight * lacking * lacking) * (is_known ? 1.0 : unknown_cost);
    };
    for (int i = 0; i != 6; ++i) {
      const auto draw = [&] {
        for (;;) {
          const vec3 p = map.grid().center(*map.grid().key(random_point(random, size)));
          if (view.is_free(p)) return p;
        }
      };
      const vec3 start = draw(), goal = draw();
      CAPTURE(round, i);
      const auto grid = nav::find_path(view, start, goal, {.method = path_method::grid, .shorten = false});
      const double expected = test::cheapest_on_grid(
          size, middle, [&](const vec3& a, const vec3& b) { return is_free(map, a, b, radius, unknown); }, density,
          cell, start, goal);
      if (std::isinf(expected)) {
        CHECK(grid.status == path_status::unreachable);
        continue;
      }
      ++found;
      REQUIRE(grid.status == path_status::found);
      CHECK(grid.cost == Approx(expected).epsilon(1e-9));
      const auto shortened = nav::find_path(view, start, goal, {.method = path_method::grid});
      const auto path = nav::find_path(view, start, goal);
      CHECK(shortened.cost <= grid.cost * (1.0 + 1e-9));
      for (const auto* p : {&grid, &shortened, &path}) {
        CHECK(p->status == path_status::found);
        CHECK(p->points.front() == start);
        CHECK(p->points.back() == goal);
        CHECK(p->cost >= p->length * (1.0 - 1e-9));
        CHECK(p->cost == Approx(nav::path_cost(view, p->points)));
        for (std::size_t j = 1; j < p->points.size(); ++j)
          CHECK(is_free(map, p->points[j - 1], p->points[j], radius, unknown));
      }
      dearer += path.cost > 1.2 * path.length ? 1 : 0;
      // The integral along the path, sampled.
      double sum = 0.0;
      constexpr int samples = 4000;
      for (std::size_t j = 1; j < path.points.size(); ++j)
        for (int s = 0; s != samples; ++s) {
          const vec3 way = path.points[j] - path.points[j - 1];
          sum += view.density(*view.key(path.points[j - 1] + (s + 0.5) / samples * way)) * way.norm() / samples;
        }
      CHECK(path.cost == Approx(sum).epsilon(1e-3));
    }
  }
  CHECK(found > 25);
  CHECK(dearer > 10);
}

TEST_CASE("A robot finds its way with costs from places where the middle of its own cell is blocked") {
  random_bits random{7};
  map_type map = maze(random, {20, 20, 12}, 0);
  for (int i = 0; i != 60; ++i) {
    const auto below = [&](std::uint32_t n) { return static_cast<int>(random.below(n)); };
    set(map, below(20), below(20), below(12), true);
  }
  const nav::distance_field field{map, {.reach = 0.8}};
  const nav::planning_view view{map, field, 0.12, {.clearance_weight = 4.0, .preferred_clearance = 0.4}};
  const nav::planning_view plain{map, field, 0.12};
  int found = 0;
  for (int i = 0; i != 40; ++i) {
    const auto draw = [&](bool off_middle) {
      for (;;)
        if (const vec3 p = random_point(random, {20, 20, 12});
            view.is_free(p) && !(off_middle && view.is_free(p, view.center(*view.key(p)))))
          return p;
    };
    const vec3 start = draw(true), goal = draw(i % 2 == 0);
    for (const path_method method : {path_method::any_angle, path_method::grid}) {
      const auto path = nav::find_path(view, start, goal, {.method = method});
      CHECK(path.status == nav::find_path(plain, start, goal, {.method = method, .shorten = false}).status);
      CHECK(path.points.front() == start);
      for (std::size_t j = 1; j < path.points.size(); ++j)
        CHECK(is_free(map, path.points[j - 1], path.points[j], 0.12, occupancy::occupied));
      found += path.status == path_status::found && path.points.size() > 2 ? 1 : 0;
    }
  }
  CHECK(found > 40);
}

TEST_CASE("Leaves that are too large for the field are not gone through") {
  map_type map{cell};
  map.set_unknown_node({32768, 32768, 32768}, 1, 1.0F);  // an eighth of the grid, occupied
  const nav::distance_field field{map, {.reach = 1.0, .unknown = occupancy::free}};
  REQUIRE_FALSE(field.is_complete());
  const nav::planning_view view{map, field, 0.3};
  CHECK_FALSE(view.is_free(vec3{1, 1, 1}));
  CHECK_FALSE(view.is_surely_free(vec3{1, 1, 1}, vec3{1, 1, 2}));
  CHECK(view.is_free(vec3{-1, -1, -1}));
  CHECK_FALSE(view.is_free(vec3{-1, 2, 2}, vec3{2, -1, 2}));
  const auto path = nav::find_path(view, {-0.5, 1, 2}, {1, -0.5, 2});  // round its edge
  REQUIRE(path.status == path_status::found);
  CHECK(path.points.size() > 2);
  for (std::size_t j = 1; j < path.points.size(); ++j)
    CHECK(is_free(map, path.points[j - 1], path.points[j], 0.3, occupancy::free));
}

TEST_CASE("Between the middles of cells the straight way is taken whatever it costs") {
  // A corridor of 2 x 2 voxels, in the middle of which alone the robot fits.
  map_type map{cell};
  for (int i = 0; i != 80; ++i) set(map, i / 4, i % 2, i / 2 % 2, false);
  const nav::distance_field field{map, {.reach = 0.6}};
  const nav::planning_view view{map, field, 0.07, {.clearance_weight = 1.0}};
  const vec3 start{0.25, 0.1, 0.1}, goal{1.65, 0.11, 0.1};
  for (const path_method method : {path_method::grid, path_method::any_angle}) {
    const auto path = nav::find_path(view, start, goal, {.method = method});
    REQUIRE(path.status == path_status::found);
    CHECK(path.points == std::vector{start, goal});
    CHECK(path.length == Approx((goal - start).norm()));
    CHECK(path.cost > 1.2 * path.length);
    CHECK(nav::find_path(view, start, goal, {.method = method, .shorten = false}).status == path_status::unreachable);
  }
}

TEST_CASE("A path keeps away from a wall if that is worth the way") {
  map_type map{cell};
  for (int x = 0; x != 30; ++x)
    for (int y = 0; y != 20; ++y)
      for (int z = 0; z != 10; ++z) set(map, x, y, z, y >= 9 && y < 11 && x < 20);
  const nav::distance_field field{map, {.reach = 1.0}};
  const vec3 start{0.55, 0.45, 0.55}, goal{0.55, 1.55, 0.55};  // round the end of the wall
  const auto nearest = [&](const nav::found_path& path) {
    double least = 1.0;
    for (std::size_t i = 1; i < path.points.size(); ++i)
      for (int s = 0; s <= 100; ++s)
        least = std::min(least,
                         field.distance(vec3{path.points[i - 1] + 0.01 * s * (path.points[i] - path.points[i - 1])}));
    return least;
  };
  const auto direct = nav::find_path(nav::planning_view{map, field, 0.12}, start, goal);
  const nav::planning_view wary{map, field, 0.12, {.clearance_weight = 10.0, .preferred_clearance = 0.25}};
  const auto wide = nav::find_path(wary, start, goal);
  REQUIRE(direct.status == path_status::found);
  REQUIRE(wide.status == path_status::found);
  CHECK(wide.length > direct.length);
  CHECK(wide.cost < nav::path_cost(wary, direct.points));
  CHECK(nearest(direct) < 0.25);
  CHECK(nearest(wide) > 0.25);
}

TEST_CASE("Through what is unknown, at a price, and within a region") {
  // A room with a wall of unknown space, and a way round it.
  map_type map{cell};
  for (int x = 0; x != 40; ++x)
    for (int y = 0; y != 20; ++y)
      for (int z = 0; z != 8; ++z)
        if (x < 18 || x >= 22 || y >= 16) set(map, x, y, z, x == 0 || y == 0 || z == 0 || x == 39 || y == 19 || z == 7);
  const nav::distance_field field{map, {.reach = 0.6, .unknown = occupancy::free}};
  const octree::bounding_box room{{0.0, 0.0, 0.0}, {4.0, 2.0, 0.8}};
  const vec3 start{1.0, 0.4, 0.4}, goal{3.0, 0.4, 0.4};
  const auto plan = [&](double price, const octree::bounding_box& region) {
    return nav::find_path(nav::planning_view{map, field, 0.12, {.region = region, .unknown_cost = price}}, start, goal);
  };
  const auto cheap = plan(1.5, room);
  REQUIRE(cheap.status == path_status::found);
  CHECK(cheap.length < 2.0 + 1e-6);
  CHECK(cheap.cost == Approx(1.6 + 0.4 * 1.5));
  const auto dear = plan(20.0, room);
  REQUIRE(dear.status == path_status::found);
  CHECK(dear.cost == Approx(dear.length));  // all round it
  CHECK(dear.length > 2.8);
  const auto low = plan(20.0, {{0.0, 0.0, 0.0}, {4.0, 1.5, 0.8}});  // the way round lies outside
  REQUIRE(low.status == path_status::found);
  CHECK(low.cost > 20.0 * 0.4);
  for (const vec3& p : low.points) CHECK(p.y() <= 1.5);
  const octree::bounding_box left{{0.0, 0.0, 0.0}, {1.5, 2.0, 0.8}};
  CHECK(plan(1.0, left).status == path_status::goal_outside);
  const nav::planning_view view{map, field, 0.12, {.region = left}};
  CHECK_FALSE(view.is_free(goal));
  CHECK(nav::find_path(view, goal, start).status == path_status::start_outside);
  CHECK(nav::find_path(view, goal, start).points.empty());
}

namespace {

/// A space of one's own: it counts what it is asked.
struct counting_view : nav::planning_view<map_type> {
  using base = nav::planning_view<map_type>;
  using base::base;
  using base::is_free;
  [[nodiscard]] bool is_free(const vec3& a, const vec3& b) const {
    ++asked;
    return base::is_free(a, b);
  }
  mutable std::size_t asked = 0;
};
static_assert(nav::planning_space<counting_view>);

}  // namespace

TEST_CASE("Shortening ends after as many checks as it may do") {
  random_bits random{5};
  const map_type map = maze(random, {40, 40, 16}, 120);
  const nav::distance_field field{map, {.reach = 0.8}};
  const counting_view view{map, field, 0.12};
  int shorter = 0, bounded = 0;
  for (int i = 0; i != 30; ++i) {
    const auto draw = [&] {
      for (;;)
        if (const vec3 p = random_point(random, {40, 40, 16}); view.is_free(p)) return p;
    };
    const auto grid = nav::find_path(view, draw(), draw(), {.method = path_method::grid, .shorten = false});
    if (grid.status != path_status::found) continue;
    double before = grid.length;
    for (const std::size_t checks : {0U, 3U, 30U, 2000U}) {
      auto points = grid.points;
      view.asked = 0;
      nav::shorten_path(view, points, checks);
      CHECK(view.asked <= checks);
      bounded += checks == 30 && view.asked == checks ? 1 : 0;
      CHECK(nav::path_length(points) <= grid.length + 1e-12);
      CHECK(points.front() == grid.points.front());
      CHECK(points.back() == grid.points.back());
      for (std::size_t j = 1; j < points.size(); ++j)
        CHECK(is_free(map, points[j - 1], points[j], 0.12, occupancy::occupied));
      shorter += checks == 2000 && nav::path_length(points) < before - 1e-6 ? 1 : 0;
      before = nav::path_length(points);
    }
  }
  CHECK(bounded > 10);
  CHECK(shorter > 10);
}
