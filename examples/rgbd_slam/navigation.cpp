// SPDX-License-Identifier: BSD-3-Clause
#include "navigation.hpp"

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_file.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>

#include "formatted_text.hpp"
#include "navigation_picture.hpp"
#include "summary.hpp"

namespace app {
namespace {

namespace nav = orbis::nav;
using orbis::vec3;
using octree = orbis::octree::occupancy_octree<>;

struct way {
  vec3 from = vec3::Zero(), to = vec3::Zero();
  nav::found_path path;
};

/// Positions where the robot fits, on the camera's path and along the optical axis; for a driving robot, on the floor.
template <nav::planning_space View>
std::vector<vec3> free_places(const View& view, const orbis::trajectory& cameras) {
  std::vector<vec3> places;
  for (const auto& pose : cameras)
    for (const double ahead : {0.0, 0.5, 1.0, 1.5, 2.0, 2.5}) {
      const vec3 p = view.placed(pose.T_world_camera * vec3(0, 0, ahead));
      if (view.key(p) && view.is_free(p)) places.push_back(p);
    }
  return places;
}

/// A path from the first place to the farthest of a few reachable places; prefers a path that is not straight.
template <nav::planning_space View>
std::optional<way> plan_through(const View& view, const std::vector<vec3>& places) {
  if (places.size() < 2) return std::nullopt;
  const vec3 from = places.front();
  std::vector<vec3> goals{places.begin() + 1, places.end()};
  const auto distance = [&](const vec3& p) { return (p - from).norm(); };
  std::ranges::sort(goals, std::greater{}, distance);
  const auto straight = std::ranges::stable_partition(goals, [&](const vec3& p) { return !view.is_free(from, p); });
  const auto attempts = std::min<std::ptrdiff_t>(8, std::ranges::distance(goals.begin(), straight.begin()));
  way found{.from = from, .path = {}};
  for (std::ptrdiff_t i = 0; i != attempts; ++i) {
    found.to = goals[static_cast<std::size_t>(i)];
    found.path = nav::find_path(view, from, found.to);
    if (found.path.status == nav::path_status::found) return found;
  }
  if (!straight.empty()) {
    found.to = straight.front();
    found.path = nav::find_path(view, from, found.to);
  }
  return found;
}

}  // namespace

orbis::result<navigation_results> navigate(const octree& map, const orbis::trajectory& cameras, const settings& s,
                                           const std::filesystem::path& folder, const std::filesystem::path& floor_file,
                                           console& console) {
  console.stage("planning");
  navigation_results r;
  r.robot_radius = s.robot_radius;

  const nav::ground_robot robot{.radius = s.robot_radius, .height = s.robot_height, .step = s.resolution};
  const auto floor = nav::make_floor_map(map, robot);
  if (floor) {
    r.floor_m = floor->floor;
    r.free_m2 = static_cast<double>(std::ranges::count(floor->states.pixels(), nav::floor_state::free)) *
                floor->resolution * floor->resolution;
  }
  if (!s.floor_map.empty()) {
    const auto saved = floor ? nav::save_floor_map(floor_file, *floor) : orbis::fail(floor.error());
    if (!saved) {
      r.unsaved = {saved.error().code, s.floor_map.string(),
                   (floor ? "" : "there is no floor map to write: ") + saved.error().message};
      std::error_code ignored;  // the image is useless without the file
      std::filesystem::remove(std::filesystem::path{floor_file}.replace_extension(".pgm"), ignored);
    }
  }

  const nav::distance_field field{map, {.reach = field_reach(s.robot_radius, s.resolution)}};
  const auto start = console::clock::now();
  const auto note = [&](const std::optional<way>& found, bool drives) {
    if (!found) {
      r.path_status = "the camera saw fewer than two positions that are known to be free";
      return;
    }
    r.path_status = to_string(found->path.status);
    if (found->path.status != nav::path_status::found) return;
    r.drives = drives;
    r.path = found->path.points;
    r.path_m = found->path.length;
    r.straight_m = (found->to - found->from).norm();
  };
  if (floor && r.free_m2 > 0.0) {  // a path on the floor if it is longer than a few steps, otherwise a flight
    const nav::floor_view on_floor{*floor, s.robot_radius};
    const auto found = plan_through(on_floor, free_places(on_floor, cameras));
    if (found && (found->to - found->from).norm() >= 5.0 * s.robot_radius) note(found, true);
  }
  if (r.path.empty()) {
    const nav::planning_view<octree> ball{map, field, s.robot_radius};
    note(plan_through(ball, free_places(ball, cameras)), false);
  }
  r.planning_ms = std::chrono::duration<double, std::milli>(console::clock::now() - start).count();

  const std::string outcome = r.path.empty() ? "no path: " + r.path_status
                                             : text("path of a %s: %.2f m, straight line %.2f m", robot_text(r).c_str(),
                                                    r.path_m, r.straight_m);
  if (floor || !cameras.empty()) {
    const double height = !r.path.empty() && !r.drives ? r.path.front().z()
                          : floor                      ? floor->floor + 0.5 * s.robot_height
                                                       : 0.0;
    const auto drawn = write_navigation_picture({.title = "Floor and distances",
                                                 .subtitle = outcome,
                                                 .map = map,
                                                 .field = &field,
                                                 .height = height,
                                                 .floor = floor ? &*floor : nullptr,
                                                 .radius = s.robot_radius,
                                                 .path = r.path,
                                                 .drives = r.drives},
                                                folder / "navigation.png");
    if (!drawn) return orbis::fail(drawn.error());
  }
  console.finish(outcome);
  return r;
}

}  // namespace app
