// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/frontiers.hpp>
#include <orbis/nav/next_view.hpp>
#include <orbis/octree/occupancy_octree.hpp>

#include "support/catch.hpp"

using namespace orbis;
using nav::next_view_status;

namespace elsewhere {

/// A ball that counts how often the map is asked.
struct counted {
  double radius = 0.25;
  std::size_t* asked = nullptr;
};
[[nodiscard]] octree::capsule swept(const counted& s, const vec3& a, const vec3& b) {
  ++*s.asked;
  return {a, b, s.radius};
}
[[nodiscard]] nav::ball_cover covering_balls(const counted& s) { return {0.0, 0.0, 1, s.radius, s.radius}; }

}  // namespace elsewhere

namespace {

using map_type = octree::occupancy_octree<>;

void fill(map_type& map, const vec3& low, const vec3& high, float log_odds) {
  const auto box = *octree::keys_between(map.grid(), low.array() + 0.01, high.array() - 0.01);
  for (auto z = box.low.z; z <= box.high.z; ++z)
    for (auto y = box.low.y; y <= box.high.y; ++y)
      for (auto x = box.low.x; x <= box.high.x; ++x)
        map.edit_octant({x, y, z}, [&](auto& voxels) {
          const auto i = octree::morton_code({x, y, z}) & 63U;
          voxels.known |= std::uint64_t{1} << i;
          voxels.value[i] = log_odds;
        });
}

/// A room of 4 m x 4 m x 2 m with walls; two doors lead into the unknown: at x = 0, and at x = 4.
map_type room() {
  map_type map{0.1};
  fill(map, {-0.1, -0.1, -0.1}, {4.1, 4.1, 2.1}, 1.0F);
  fill(map, {0.0, 0.0, 0.0}, {4.0, 4.0, 2.0}, -1.0F);
  fill(map, {-0.1, 1.0, 0.0}, {0.0, 2.0, 2.0}, -1.0F);
  fill(map, {4.0, 1.0, 0.0}, {4.1, 2.0, 2.0}, -1.0F);
  return map;
}

}  // namespace

TEST_CASE("Places of a frontier: means of its voxels in the cubes of a lattice") {
  map_type map{0.1};
  fill(map, {0.0, 0.0, 0.0}, {3.2, 0.8, 0.1}, -1.0F);  // all of it is frontier
  const nav::frontiers f{map};
  REQUIRE(f.size() == 32 * 8);
  const auto places = nav::candidate_viewpoints(f.clusters(), map.grid(), 0.8);
  REQUIRE(places.size() == 4);
  for (std::size_t i = 0; i != 4; ++i)
    CHECK((places[i] - vec3{0.4 + 0.8 * static_cast<double>(i), 0.4, 0.05}).norm() < 1e-9);
  for (const double whole : {100.0, 1e300, std::numeric_limits<double>::infinity()})
    CHECK(nav::candidate_viewpoints(f.clusters(), map.grid(), whole).size() == 1);
  CHECK(nav::candidate_viewpoints({}, map.grid()).empty());
}

TEST_CASE("A camera that looks at a place has it in its middle, and is level") {
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  const vec3 from{1.0, 2.0, 3.0}, to{-1.0, 2.5, 2.0};
  const se3 T = nav::looking_at(from, to);
  const vec3 seen = T.inverse() * to;
  CHECK(seen.head<2>().norm() < 1e-12);
  CHECK(seen.z() == Approx((to - from).norm()));
  CHECK(std::abs((T.rotation() * vec3::UnitX()).z()) < 1e-12);
  CHECK((T.rotation() * vec3::UnitY()).z() < 0.0);
}

TEST_CASE("The next best view is the one of the greatest utility, and can be reached") {
  const map_type map = room();
  const nav::frontiers f{map};
  const auto clusters = f.clusters();
  REQUIRE(clusters.size() == 2);
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  const nav::distance_field field{map, {.reach = 0.6}};
  const nav::planning_view view{map, field, 0.25};
  const auto places = nav::candidate_viewpoints(clusters, map.grid());
  nav::next_view_options options{.gain = {.max_range = 3.0, .pixel_step = 4}, .lambda = 3.0};
  for (const double x : {0.6, 3.4}) {  // ways are dear: the nearer door
    const vec3 position{x, 2.5, 1.0};
    const auto next = nav::next_best_view(view, places, camera, position, options);
    REQUIRE(next.status == next_view_status::found);
    CHECK(std::abs(next.place.x() - x) < 1.0);
    CHECK(next.path.status == nav::path_status::found);
    CHECK(next.path.points.front() == position);
    CHECK(next.path.points.back() == next.T_world_camera.translation());
    CHECK(view.is_free(next.T_world_camera.translation()));
    CHECK(next.utility == Approx(next.gain * std::exp(-3.0 * next.path.length)));
    nav::view_gain gain{map, camera, options.gain};
    CHECK(next.gain == Approx(1e-3 * static_cast<double>(gain(next.T_world_camera))));
    const vec3 seen = next.T_world_camera.inverse() * next.place;
    CHECK(seen.head<2>().norm() < 1e-9);
    CHECK((seen.z() >= options.min_distance && seen.z() <= options.max_distance));
    const auto again = nav::next_best_view(view, places, camera, position, options);
    CHECK(again.T_world_camera.translation() == next.T_world_camera.translation());
    CHECK(again.utility == next.utility);
    // Fewer candidates that begin with the same ones are no better.
    auto one = options;
    for (const vec3& place : places) {
      const auto alone = nav::next_best_view(view, std::vector<vec3>{place}, camera, position, one);
      if (place == places.front()) CHECK(alone.utility <= next.utility);
    }
  }
  const auto status_at = [&](const vec3& position, const std::vector<vec3>& at) {
    return nav::next_best_view(view, at, camera, position, options).status;
  };
  const vec3 middle{2.0, 2.0, 1.0};
  CHECK(status_at(vec3{2.0, 2.0, 0.1}, places) == next_view_status::start_blocked);
  CHECK(status_at(vec3{2.0, 2.0, 1e9}, places) == next_view_status::start_outside);
  CHECK(status_at(vec3{2.0, std::nan(""), 1.0}, places) == next_view_status::start_outside);
  CHECK(status_at(middle, {}) == next_view_status::nothing_to_see);
  options.min_gain = 1e6;
  CHECK(status_at(middle, places) == next_view_status::nothing_to_see);
  options.min_gain = 0.0;
  options.gain.bounds = octree::bounding_box{vec3::Zero(), vec3{4.0, 4.0, 2.0}};  // all of it is known
  CHECK(status_at(middle, places) == next_view_status::nothing_to_see);
  CHECK(nav::to_string(next_view_status::nothing_to_see) == "nothing to see");
}

TEST_CASE("Where ways are very dear the nearest view is taken, though its utility rounds to zero") {
  const map_type map = room();
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  const nav::distance_field field{map, {.reach = 0.6}};
  const nav::planning_view view{map, field, 0.25};
  const auto places = nav::candidate_viewpoints(nav::frontiers{map}.clusters(), map.grid());
  nav::next_view_options options{.gain = {.max_range = 3.0, .pixel_step = 4}, .lambda = 1e5};
  for (const double x : {0.6, 3.4}) {
    const vec3 position{x, 2.5, 1.0};
    const auto next = nav::next_best_view(view, places, camera, position, options);
    REQUIRE(next.status == next_view_status::found);
    CHECK(next.utility == 0.0);
    CHECK(next.gain > 0.0);
    CHECK(std::abs(next.T_world_camera.translation().x() - x) < 2.0);
    for (std::size_t i = 1; i <= places.size(); ++i) {  // the first of the same candidates: none of them is nearer
      const auto fewer = nav::next_best_view(view, std::span{places}.first(i), camera, position, options);
      if (fewer.status == next_view_status::found) CHECK(next.path.length <= fewer.path.length + 1e-3);
    }
  }
}

TEST_CASE("A view to which only the straight way leads is found whatever that costs") {
  // A corridor in the middle of which alone the robot fits, between the middles of voxels.
  map_type map{0.1};
  fill(map, {0.0, 0.0, 0.0}, {2.0, 0.2, 0.2}, -1.0F);
  const nav::distance_field field{map, {.reach = 0.6}};
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  const vec3 place{1.0, 0.1, 0.1}, position{0.3, 0.1, 0.1};
  for (const double weight : {0.0, 1.0}) {
    const nav::planning_view view{map, field, 0.07, {.clearance_weight = weight}};
    const auto next =
        nav::next_best_view(view, std::vector{place}, camera, position,
                            {.candidates = 100, .min_distance = 0.05, .max_distance = 0.3, .max_elevation = 0.1});
    CHECK(next.status == next_view_status::found);
    CHECK(next.path.points.size() == 2);
  }
}

TEST_CASE("What cannot be reached is found out once, and what can be is found all the same") {
  map_type map = room();
  fill(map, {0.0, 3.0, 0.0}, {4.0, 3.1, 2.0}, 1.0F);    // a wall across
  fill(map, {3.0, 5.0, 0.0}, {12.0, 9.0, 2.0}, -1.0F);  // and another room, which cannot be reached
  const nav::frontiers f{map};
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  const nav::distance_field field{map, {.reach = 0.6}};
  std::size_t asked = 0;
  const nav::planning_view view{map, field, elsewhere::counted{.asked = &asked}};
  const vec3 position{2.0, 1.5, 1.0};
  REQUIRE(view.is_free(position));
  nav::next_view_options options{.gain = {.max_range = 3.0, .pixel_step = 4}, .max_distance = 1.0, .lambda = 0.0};
  std::vector<vec3> far;
  for (const vec3& p : nav::candidate_viewpoints(f.clusters(), map.grid()))
    if (p.y() > 5.0) far.push_back(p);
  REQUIRE(far.size() > 20);
  options.candidates = 1;
  const auto asked_for = [&](const std::vector<vec3>& places) {
    asked = 0;
    const auto status = nav::next_best_view(view, places, camera, position, options).status;
    CHECK((status == next_view_status::unreachable ||
           (places.size() == 1 && status == next_view_status::nothing_to_see)));
    return asked;
  };
  std::size_t most = 0;  // for a place
  for (const vec3& p : far) most = std::max(most, asked_for({p}));
  REQUIRE(most > 1000);
  CHECK(asked_for(far) < 2 * most);
  // A door that can be looked through, after all those.
  far.push_back({3.95, 1.5, 1.0});
  options.candidates = 20;
  const auto next = nav::next_best_view(view, far, camera, position, options);
  REQUIRE(next.status == next_view_status::found);
  CHECK(next.place == far.back());
}

TEST_CASE("Where more can be reached than is looked at it says so, and does not look for each view as long") {
  map_type map = room();
  fill(map, {0.0, 3.0, 0.0}, {4.0, 3.1, 2.0}, 1.0F);                                       // a wall across
  for (const double x : {-0.1, 4.0}) fill(map, {x, 1.0, 0.0}, {x + 0.1, 3.0, 2.0}, 1.0F);  // and both doors are closed
  fill(map, {1.0, 1.0, 2.0}, {2.0, 2.0, 2.1}, -1.0F);  // but a hole in the ceiling leads outside
  const camera::pinhole camera{40, 30, 25.0, 25.0, 19.5, 14.5};
  std::size_t asked = 0;
  const vec3 position{3.0, 1.5, 1.0};
  nav::next_view_options options{.gain = {.max_range = 3.0, .pixel_step = 4},
                                 .candidates = 1,
                                 .max_distance = 0.6,
                                 .lambda = 0.0,
                                 .path = {.shorten = false, .max_expanded = 20'000}};
  // In a box that is closed, somewhere in unknown space, through which the robot could go on for ever.
  fill(map, {19.0, 19.0, -1.0}, {23.0, 23.0, 3.0}, 1.0F);
  fill(map, {19.1, 19.1, -0.9}, {22.9, 22.9, 2.9}, -1.0F);
  std::vector<vec3> places;
  for (int i = 0; i != 24; ++i) {
    // A single unknown voxel in the box is to be seen from near it.
    const vec3 p{20.5 + 0.5 * (i % 4), 20.5 + 0.5 * (i / 4 % 3), 0.55 + 0.8 * (i / 12)};
    map.edit_octant(*map.grid().key(p), [&](auto& voxels) {
      voxels.known &= ~(std::uint64_t{1} << (octree::morton_code(*map.grid().key(p)) & 63U));
    });
    places.push_back(p);
  }
  const nav::distance_field field{map, {.reach = 0.6, .unknown = octree::occupancy::free}};
  const nav::planning_view view{map, field, elsewhere::counted{.asked = &asked}};
  REQUIRE(view.is_free(position));
  const auto look_at = [&](const std::vector<vec3>& at) {
    asked = 0;
    return nav::next_best_view(view, at, camera, position, options);
  };
  std::size_t alone = 0, most_alone = 0, gave_up = 0;
  for (const vec3& p : places) {
    const auto status = look_at({p}).status;
    CHECK((status == next_view_status::gave_up || status == next_view_status::nothing_to_see));
    gave_up += status == next_view_status::gave_up ? 1U : 0U;
    alone += asked;
    most_alone = std::max(most_alone, asked);
  }
  REQUIRE(gave_up > 15);
  CHECK(look_at(places).status == next_view_status::gave_up);
  CHECK(5 * asked < alone);
  CHECK(asked < 3 * most_alone);
  // Where it may look at so many that the box is seen to be closed, no way leads there.
  options.path.max_expanded = 200'000;
  CHECK(look_at(places).status == next_view_status::unreachable);
  options.path.max_expanded = 20'000;
  // What is near is found all the same.
  places.push_back({1.5, 1.5, 2.05});
  options.candidates = 20;
  options.max_distance = 1.0;
  options.max_elevation = 1.2;
  const auto next = look_at(places);
  REQUIRE(next.status == next_view_status::found);
  CHECK(next.place == places.back());
}
