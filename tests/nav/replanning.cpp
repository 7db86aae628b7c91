// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/replanning.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::path_status;

namespace {

using map_type = octree::occupancy_octree<>;

void fill(map_type& map, const vec3& low, const vec3& high, float log_odds) {
  const auto box = *octree::keys_between(map.grid(), low.array() + 0.01, high.array() - 0.01);
  std::vector<octree::voxel_key> keys;
  for (auto z = box.low.z; z <= box.high.z; ++z)
    for (auto y = box.low.y; y <= box.high.y; ++y)
      for (auto x = box.low.x; x <= box.high.x; ++x) keys.push_back({x, y, z});
  map.edit_octants(keys, [&](const octree::voxel_key& k, auto& voxels) {
    const auto i = octree::morton_code(k) & 63U;
    voxels.known |= std::uint64_t{1} << i;
    voxels.value[i] = log_odds;
  });
}

/// 6 m x 4 m x 1 m of free space with a wall across at x = 3 m that has two doors: at y = 0.5 ... 1.3 and 2.7 ... 3.5.
map_type two_doors() {
  map_type map{0.1};
  map.track_changes();
  fill(map, {0.0, 0.0, 0.0}, {6.0, 4.0, 1.0}, -1.0F);
  fill(map, {3.0, 0.0, 0.0}, {3.1, 4.0, 1.0}, 1.0F);
  fill(map, {3.0, 0.5, 0.0}, {3.1, 1.3, 1.0}, -1.0F);
  fill(map, {3.0, 2.7, 0.0}, {3.1, 3.5, 1.0}, -1.0F);
  return map;
}

}  // namespace

TEST_CASE("A monitor tests only what changes touch, and finds every path that is blocked") {
  std::size_t blocked = 0, spared = 0;
  for (std::uint64_t seed = 1; seed != 60; ++seed) {
    random_bits random{seed};
    map_type map = two_doors();
    nav::distance_field field{map, {.reach = 0.5}};
    const nav::planning_view view{map, field, 0.2};
    const auto path = nav::find_path(view, vec3{1.0, 2.0, 0.5}, vec3{5.0, 2.0, 0.5});
    REQUIRE(path.status == path_status::found);
    REQUIRE(path.points.size() > 3);
    nav::path_monitor monitor{view, path.points};
    CHECK_FALSE(monitor.first_blocked(view));
    CHECK(monitor.tested() == 0);
    for (int i = 0; i != 12; ++i) {
      const vec3 low{6.0 * random.uniform(), 4.0 * random.uniform(), 0.9 * random.uniform()};
      fill(map, low, low.array() + 0.1, random.below(3) == 0 ? -1.0F : 1.0F);
      if (i == 7) map.changes().forget_before(map.changes().revision());
      if (random.below(3) == 0) continue;  // several changes at once
      field.update(map);
      std::size_t first = 0;
      while (first + 1 != path.points.size() && view.is_free(path.points[first], path.points[first + 1])) ++first;
      const auto found = monitor.first_blocked(view);
      REQUIRE(found.has_value() == (first + 1 != path.points.size()));
      if (found) {
        CHECK(*found == first);
        ++blocked;
      } else if (monitor.tested() == 0) {
        ++spared;
      }
    }
  }
  CHECK(blocked > 20);
  CHECK(spared > 50);
}

TEST_CASE("Changes away from the path never lead to a new one, a wall across it does, from where the robot is") {
  map_type map = two_doors();
  nav::distance_field field{map, {.reach = 0.5}};
  const nav::planning_view view{map, field, 0.2};
  nav::replanner planner{vec3{5.0, 1.5, 0.5}};
  const auto update = [&](const vec3& position) {
    field.update(map);
    return planner.update(view, position);
  };
  vec3 position{1.0, 1.5, 0.5};
  const auto first = update(position);
  REQUIRE(first.status == path_status::found);
  CHECK(planner.planned() == 1);
  const auto passes = [](const nav::found_path& path, double low, double high) {
    for (std::size_t i = 1; i != path.points.size(); ++i) {
      const vec3& a = path.points[i - 1];
      const vec3& b = path.points[i];
      if (a.x() > 3.0 || b.x() < 3.0 || a.x() == b.x()) continue;
      const double y = a.y() + (3.0 - a.x()) / (b.x() - a.x()) * (b.y() - a.y());
      return y > low && y < high;
    }
    return false;
  };
  CHECK(passes(first, 0.5, 1.3));

  // Things come and go elsewhere, while the robot goes along the path.
  random_bits random{1};
  for (int i = 0; i != 50; ++i) {
    const vec3 low{6.0 * random.uniform(), 2.2 + 1.7 * random.uniform(), 0.9 * random.uniform()};
    if (low.x() < 2.7 || low.x() > 3.3) fill(map, low, low.array() + 0.1, random.below(2) == 0 ? 1.0F : -1.0F);
    if (position.x() < 2.0) position += 0.02 * (planner.path().points[1] - position).normalized();
    const auto& path = update(position);
    CHECK(path.points.front() == position);
    CHECK(path.points.back() == vec3{5.0, 1.5, 0.5});
    CHECK(path.length <= first.length + 1e-9);
    CHECK(path.length == Approx(nav::path_length(path.points)));
  }
  CHECK(planner.planned() == 1);
  CHECK(position.x() > 1.8);

  // What lies behind the robot does not matter.
  fill(map, {1.2, 1.3, 0.4}, {1.3, 1.6, 0.6}, 1.0F);
  update(position);
  CHECK(planner.planned() == 1);

  fill(map, {0.0, 2.0, 0.0}, {6.0, 4.0, 1.0}, -1.0F);  // nothing stands near the other door
  fill(map, {3.0, 2.0, 0.0}, {3.1, 2.7, 1.0}, 1.0F);
  fill(map, {3.0, 3.5, 0.0}, {3.1, 4.0, 1.0}, 1.0F);
  update(position);
  CHECK(planner.planned() == 1);
  fill(map, {3.0, 0.5, 0.0}, {3.1, 1.3, 1.0}, 1.0F);  // the door is closed
  const auto second = update(position);
  CHECK(planner.planned() == 2);
  REQUIRE(second.status == path_status::found);
  CHECK(second.points.front() == position);
  CHECK(passes(second, 2.7, 3.5));

  // An open door that makes it shorter is not looked for.
  fill(map, {3.0, 0.5, 0.0}, {3.1, 1.3, 1.0}, -1.0F);
  update(position);
  CHECK(planner.planned() == 2);

  // Both closed: no way, and it is not looked for again until something changes or the robot moves.
  fill(map, {3.0, 0.0, 0.0}, {3.1, 4.0, 1.0}, 1.0F);
  CHECK(update(position).status == path_status::unreachable);
  CHECK(planner.planned() == 3);
  CHECK(update(position).status == path_status::unreachable);
  CHECK(planner.planned() == 3);
  fill(map, {3.0, 0.5, 0.0}, {3.1, 1.3, 1.0}, -1.0F);
  CHECK(update(position).status == path_status::found);
  CHECK(planner.planned() == 4);
  // The robot is beside its path: what is left begins where it is, and is tested.
  const auto& beside = update(position + vec3{0.0, 0.1, 0.0});
  CHECK(planner.planned() == 4);
  CHECK(beside.points.front() == vec3{position + vec3{0.0, 0.1, 0.0}});
  for (std::size_t i = 1; i != beside.points.size(); ++i) CHECK(view.is_free(beside.points[i - 1], beside.points[i]));
  CHECK(planner.goal() == vec3{5.0, 1.5, 0.5});
}

namespace {

/// 6 m x 4 m of floor at 0.2 m with a wall across at x = 3 m, with the doors of `two_doors`.
nav::floor_map floor_with_two_doors() {
  nav::floor_map map{.resolution = 0.1, .floor = 0.2};
  map.states = image<nav::floor_state>(60, 40, nav::floor_state::free);
  map.heights = image<float>(60, 40, 0.2F);
  for (int y = 0; y != 40; ++y)
    if (y < 5 || (y >= 13 && y < 27) || y >= 35) map.states(30, y) = nav::floor_state::occupied;
  return map;
}
void fill(nav::floor_map& map, int left, int low, int right, int high, nav::floor_state state) {
  for (int y = low; y != high; ++y)
    for (int x = left; x != right; ++x) map.states(x, y) = state;
}
/// The same with more known around it, as a map that has grown.
nav::floor_map grown(const nav::floor_map& map, int by) {
  nav::floor_map out{
      .resolution = map.resolution, .origin = map.origin.array() - by * map.resolution, .floor = map.floor};
  const int width = map.states.width() + 2 * by, height = map.states.height() + 2 * by;
  out.states = image<nav::floor_state>(width, height, nav::floor_state::unknown);
  out.heights = image<float>(width, height, 0.2F);
  for (int y = 0; y != map.states.height(); ++y)
    for (int x = 0; x != map.states.width(); ++x) {
      out.states(x + by, y + by) = map.states(x, y);
      out.heights(x + by, y + by) = map.heights(x, y);
    }
  return out;
}

}  // namespace

TEST_CASE("A monitor finds every path over a floor that is blocked in a new floor map") {
  std::size_t blocked = 0, free = 0;
  for (std::uint64_t seed = 1; seed != 40; ++seed) {
    random_bits random{seed};
    nav::floor_map map = floor_with_two_doors();
    const auto path = nav::find_path(nav::floor_view{map, 0.2}, vec3{1.0, 2.0, 0.5}, vec3{5.0, 2.0, 0.5});
    REQUIRE(path.status == path_status::found);
    REQUIRE(path.points.size() > 3);
    nav::path_monitor monitor{nav::floor_view{map, 0.2}, path.points};
    CHECK_FALSE(monitor.first_blocked(nav::floor_view{map, 0.2}));
    for (int i = 0; i != 12; ++i) {
      const int x = static_cast<int>(random.below(60)), y = static_cast<int>(random.below(40));
      map.states(x, y) = random.below(3) == 0 ? nav::floor_state::free : nav::floor_state::occupied;
      const nav::floor_map next = grown(map, static_cast<int>(random.below(3)));
      const nav::floor_view view{next, 0.2};
      std::size_t first = 0;
      while (first + 1 != path.points.size() && view.is_free(path.points[first], path.points[first + 1])) ++first;
      const auto found = monitor.first_blocked(view);
      REQUIRE(found.has_value() == (first + 1 != path.points.size()));
      if (found) CHECK(*found == first);
      ++(found ? blocked : free);
    }
  }
  CHECK(blocked > 20);
  CHECK(free > 50);
}

TEST_CASE("A robot on the floor plans again only when a new floor map touches its path") {
  nav::floor_map map = floor_with_two_doors();
  nav::replanner planner{vec3{5.0, 1.5, 0.0}};
  int by = 0;  // each time another map, which may have another size
  const auto update = [&](const vec3& position) {
    const nav::floor_map now = grown(map, by);
    return planner.update(nav::floor_view{now, 0.2}, position);
  };
  vec3 position{1.0, 1.5, 0.0};
  const vec3 goal{5.0, 1.5, 0.2F};
  const auto first = update(position);
  REQUIRE(first.status == path_status::found);
  REQUIRE(first.points.size() > 2);
  CHECK(first.points.back() == goal);
  random_bits random{1};
  for (int i = 0; i != 50; ++i) {
    const int x = static_cast<int>(random.below(60)), y = 22 + static_cast<int>(random.below(18));
    if (x < 27 || x > 33)
      map.states(x, y) = random.below(2) == 0 ? nav::floor_state::occupied : nav::floor_state::unknown;
    by = static_cast<int>(random.below(4));
    if (position.x() < 2.0) position += 0.02 * (planner.path().points[1] - position).normalized();
    position.z() = random.uniform();  // does not matter
    const auto path = update(position);
    REQUIRE(path.status == path_status::found);
    CHECK(path.points.front() == vec3{position.x(), position.y(), 0.2F});
    CHECK(path.points.back() == goal);
    CHECK(path.length <= first.length + 1e-9);
    CHECK(path.length == Approx(nav::path_length(path.points)));
  }
  CHECK(planner.planned() == 1);
  CHECK(position.x() > 1.8);

  // The floor is found to be higher: the same path, at its height.
  map.heights = image<float>(60, 40, 0.3F);
  by = 0;
  CHECK(update(position).points.back().z() == 0.3F);
  CHECK(planner.planned() == 1);

  fill(map, 0, 20, 60, 40, nav::floor_state::free);
  fill(map, 30, 0, 31, 27, nav::floor_state::occupied);  // the first door is closed
  fill(map, 30, 35, 31, 40, nav::floor_state::occupied);
  const auto second = update(position);
  CHECK(planner.planned() == 2);
  REQUIRE(second.status == path_status::found);
  CHECK(second.points.front().head<2>() == position.head<2>());
  CHECK(second.length > first.length);

  // Both closed: no way, and it is not looked for again until the map changes or the robot moves.
  fill(map, 30, 0, 31, 40, nav::floor_state::occupied);
  CHECK(update(position).status == path_status::unreachable);
  CHECK(planner.planned() == 3);
  CHECK(update(position).status == path_status::unreachable);
  CHECK(planner.planned() == 3);
  map.heights(3, 3) = 0.2F;  // no obstacle
  CHECK(update(position).status == path_status::unreachable);
  CHECK(planner.planned() == 3);
  map.states(50, 30) = nav::floor_state::occupied;
  CHECK(update(position).status == path_status::unreachable);
  CHECK(planner.planned() == 4);
  by = 2;  // other cells, at other places
  update(position);
  CHECK(planner.planned() == 5);
  update(position - vec3{0.1, 0.0, 0.0});
  CHECK(planner.planned() == 6);
  fill(map, 30, 5, 31, 13, nav::floor_state::free);
  CHECK(update(position).status == path_status::found);
  CHECK(planner.planned() == 7);
}
