// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::path_method;
using nav::path_status;
using octree::occupancy;
using octree::voxel_key;

namespace {

using map_type = octree::occupancy_octree<>;

constexpr double cell = 0.1;

voxel_key key(int x, int y, int z) {
  const auto along = [](int c) { return static_cast<std::uint32_t>(c + 32768); };
  return {along(x), along(y), along(z)};
}
void set(map_type& map, int x, int y, int z, bool occupied) {
  map.edit_octant(key(x, y, z), [&](octree::block<float>& b) {
    const auto i = octree::morton_code(key(x, y, z)) & 63U;
    b.known |= std::uint64_t{1} << i;
    b.value[i] = occupied ? 1.0F : -1.0F;
  });
}
/// Free space of `size` voxels from the origin on, with boxes of obstacles in it.
map_type maze(random_bits& random, std::array<int, 3> size, int boxes) {
  map_type map{cell};
  for (int z = 0; z != size[2]; ++z)
    for (int y = 0; y != size[1]; ++y)
      for (int x = 0; x != size[0]; ++x) set(map, x, y, z, false);
  const auto below = [&](int n) { return static_cast<int>(random.below(static_cast<std::uint32_t>(n))); };
  for (int i = 0; i != boxes; ++i) {
    std::array<int, 3> low{}, high{};
    for (std::size_t j = 0; j != 3; ++j) {
      low[j] = below(size[j]);
      high[j] = std::min(size[j], low[j] + 1 + below(4));
    }
    for (int z = low[2]; z < high[2]; ++z)
      for (int y = low[1]; y < high[1]; ++y)
        for (int x = low[0]; x < high[0]; ++x) set(map, x, y, z, true);
  }
  return map;
}
vec3 random_point(random_bits& random, std::array<int, 3> size) {
  return {cell * size[0] * random.uniform(), cell * size[1] * random.uniform(), cell * size[2] * random.uniform()};
}
bool is_free(const map_type& map, const vec3& a, const vec3& b, double radius, occupancy unknown) {
  return !overlaps(map, octree::capsule{a, b, radius}, {.unknown = unknown});
}

/// The shortest way over the middles of voxels, by Dijkstra's algorithm and the exact capsule test. Infinite: none.
double shortest(const map_type& map, std::array<int, 3> size, const vec3& start, const vec3& goal, double radius) {
  const auto index = [&](const std::array<int, 3>& p) {
    return static_cast<std::size_t>((p[2] * size[1] + p[1]) * size[0] + p[0]);
  };
  const auto middle = [&](const std::array<int, 3>& p) { return map.grid().center(key(p[0], p[1], p[2])); };
  const auto is_inside = [&](const std::array<int, 3>& p) {
    for (std::size_t i = 0; i != 3; ++i)
      if (p[i] < 0 || p[i] >= size[i]) return false;
    return true;
  };
  const auto free = [&](const vec3& a, const vec3& b) { return is_free(map, a, b, radius, occupancy::occupied); };
  const auto for_each_near = [&](const std::array<int, 3>& p, auto&& visit) {
    for (int z = -1; z <= 1; ++z)
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x)
          if (const std::array<int, 3> q{p[0] + x, p[1] + y, p[2] + z}; is_inside(q)) visit(q);
  };
  const auto doors = [&](const vec3& p) {
    const std::array<int, 3> own{static_cast<int>(std::floor(p.x() / cell)), static_cast<int>(std::floor(p.y() / cell)),
                                 static_cast<int>(std::floor(p.z() / cell))};
    std::vector<std::array<int, 3>> found;
    if (free(p, middle(own))) return std::vector{own};
    for_each_near(own, [&](const std::array<int, 3>& q) {
      if (q != own && free(p, middle(q))) found.push_back(q);
    });
    return found;
  };
  std::vector<double> cost(static_cast<std::size_t>(size[0] * size[1] * size[2]),
                           std::numeric_limits<double>::infinity());
  using entry = std::pair<double, std::array<int, 3>>;
  std::priority_queue<entry, std::vector<entry>, std::greater<>> open;
  const auto offer = [&](const std::array<int, 3>& p, double c) {
    if (c >= cost[index(p)]) return;
    cost[index(p)] = c;
    open.push({c, p});
  };
  for (const auto& p : doors(start)) offer(p, (middle(p) - start).norm());
  while (!open.empty()) {
    const auto [c, p] = open.top();
    open.pop();
    if (c > cost[index(p)]) continue;
    for_each_near(p, [&](const std::array<int, 3>& q) {
      if (q != p && free(middle(p), middle(q))) offer(q, c + (middle(q) - middle(p)).norm());
    });
  }
  double best = std::numeric_limits<double>::infinity();
  for (const auto& p : doors(goal)) best = std::min(best, cost[index(p)] + (middle(p) - goal).norm());
  return best;
}

}  // namespace

TEST_CASE("Whether a ball is free is what the exact tests of the map say") {
  const occupancy unknown = GENERATE(occupancy::occupied, occupancy::free);
  const double reach = GENERATE(0.15, 1.0);
  random_bits random{1};
  const map_type map = maze(random, {40, 40, 24}, 60);
  const nav::distance_field field{map, {.reach = reach, .unknown = unknown}};
  std::array<int, 2> seen{};
  for (const double radius : {0.03, 0.12, 0.25}) {
    const nav::planning_view view{map, field, radius};
    for (int i = 0; i != 1500; ++i) {
      const vec3 a = random_point(random, {44, 44, 26}) - vec3::Constant(0.1);
      const vec3 b = i % 3 == 0   ? a
                     : i % 3 == 1 ? vec3{a + 0.1 * random_point(random, {10, 10, 10})}
                                  : vec3{random_point(random, {40, 40, 24})};
      const bool expected = is_free(map, a, b, radius, unknown);
      ++seen[expected ? 1 : 0];
      CHECK(view.is_free(a, b) == expected);
      const voxel_key k = *map.grid().key(a);
      const vec3 middle = map.grid().center(k);
      CHECK(view.is_free(k) == is_free(map, middle, middle, radius, unknown));
    }
  }
  CHECK(seen[0] > 500);
  CHECK(seen[1] > 500);
  const nav::planning_view view{map, field, 0.1};
  CHECK_FALSE(view.is_free(vec3{std::nan(""), 0.0, 0.0}));
  CHECK(view.is_free(vec3{0.0, 0.0, 1e6}) == (unknown == occupancy::free));
}

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
      CHECK(path.length == Approx(nav::length_of(path.points)));
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
