// SPDX-License-Identifier: BSD-3-Clause
//
// A way through a map file: for a ball, for a cylinder that stands upright, or for a robot that drives on the floor.
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <orbis/core/file.hpp>
#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/octree/files.hpp>

#include "commands.hpp"
#include "navigation.hpp"
#include "navigation_picture.hpp"
#include "result_files.hpp"

namespace app {
namespace {

namespace nav = orbis::nav;
using octree = orbis::octree::occupancy_octree<>;
using orbis::octree::occupancy;

/// A map of either kind, by what it begins with.
orbis::result<octree> read_map(const std::filesystem::path& path) {
  const auto bytes = orbis::read_file(path);
  if (!bytes) return orbis::fail(bytes.error());
  const auto view = std::as_bytes(std::span{*bytes});
  const auto begins_with = [&](std::string_view magic) { return bytes->starts_with(magic); };
  if (begins_with("# Octomap OcTree binary file")) return orbis::octree::read_bt<octree::model>(view, path.string());
  if (begins_with("# Octomap OcTree file")) return orbis::octree::read_ot<octree::model>(view, path.string());
  return orbis::fail(orbis::errc::unsupported, path.string(), "is no octree map: neither .bt nor .ot");
}

orbis::result<void> write_path(const std::filesystem::path& path, const std::vector<orbis::vec3>& points) {
  return orbis::write_file_atomically(path, [&](std::ostream& out) {
    out << "# x y z, metres\n";
    char line[128];
    for (const orbis::vec3& p : points) {
      std::snprintf(line, sizeof line, "%.6f %.6f %.6f\n", p.x(), p.y(), p.z());
      out << line;
    }
  });
}

/// What would be written over, if anything: the map, or one result by the other.
std::optional<orbis::error> find_conflict(const settings& s) {
  const auto are_one = [](const std::filesystem::path& a, const std::filesystem::path& b) {
    std::error_code ignored;
    return std::filesystem::equivalent(a, b, ignored) ||
           std::filesystem::absolute(a).lexically_normal() == std::filesystem::absolute(b).lexically_normal();
  };
  if (!s.out.empty() && !s.picture.empty() && are_one(s.out, s.picture))
    return orbis::error{orbis::errc::invalid_argument, s.out.string(), "would be both the path and the picture"};
  return find_overwritten({s.out, s.picture}, {s.input});
}

/// Around all that is known and the ends of the way: a search for what cannot be reached ends there.
orbis::octree::bounding_box box_to_search(const octree& map, const settings& s) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  orbis::octree::bounding_box box{orbis::vec3::Constant(inf), orbis::vec3::Constant(-inf)};
  const auto take = [&](const orbis::vec3& p, double half) {
    box.min = box.min.cwiseMin((p.array() - half).matrix());
    box.max = box.max.cwiseMax((p.array() + half).matrix());
  };
  map.for_each_leaf([&](const octree::leaf& leaf) { take(leaf.center, 0.5 * leaf.size); });
  for (const orbis::vec3& p : {s.from, s.to})
    if (map.grid().key(p)) take(p, 0.0);
  const double margin = 1.0 + 2 * s.robot_radius;
  return {(box.min.array() - margin).matrix(), (box.max.array() + margin).matrix()};
}

/// Whether it is only what nobody has seen that is in the robot's way there.
bool is_only_unknown(const octree& map, const settings& s, const orbis::vec3& p) {
  const orbis::octree::overlap_options known{.unknown = occupancy::free};
  if (s.unknown_is_free || s.on_floor) return false;
  using standing = nav::swept_shape<nav::vertical_cylinder>;
  return s.stands ? !overlaps(map, standing{p, p, {s.robot_radius, 0.0, s.robot_height}}, known)
                  : !overlaps(map, orbis::octree::capsule{p, p, s.robot_radius}, known);
}

}  // namespace

exit_code plan(const settings& s, console& console) {
  const auto give_up = [&](const orbis::error& e) { return console.error(e), bad_input; };
  if (const auto lost = find_conflict(s)) return console.error(*lost), bad_usage;
  console.stage("reading");
  const auto map = read_map(s.input);
  if (!map) return give_up(map.error());
  if (map->empty()) return give_up({orbis::errc::no_data, s.input.string(), "the map is empty"});
  const double cell = map->resolution();
  char text[256];
  std::snprintf(text, sizeof text, "%s: voxels of %g cm", s.input.filename().string().c_str(), 100 * cell);
  console.finish(text);

  console.stage("preparing");
  const occupancy unknown = s.unknown_is_free ? occupancy::free : occupancy::occupied;
  std::optional<nav::floor_map> floor;
  if (s.on_floor) {
    auto made = nav::make_floor_map(
        *map, {.radius = s.robot_radius, .height = s.robot_height, .step = s.robot_step.value_or(cell)});
    if (!made) return give_up({made.error().code, s.input.string(), made.error().message});
    floor = *std::move(made);
  }
  std::optional<nav::distance_field> field;
  if (!floor)
    field.emplace(*map, nav::distance_field_options{.reach = field_reach(s.robot_radius, cell), .unknown = unknown});
  console.finish(floor ? "floor map" : "distance field");

  console.stage("planning");
  const auto start = console::clock::now();
  const auto planned_in = [&](const auto& space) { return nav::find_path(space, s.from, s.to); };
  const nav::planning_options within{.region = box_to_search(*map, s)};
  const nav::found_path path =
      floor      ? planned_in(nav::floor_view{*floor, s.robot_radius, {}, unknown})
      : s.stands ? planned_in(nav::planning_view{*map, *field,
                                                 nav::vertical_cylinder{s.robot_radius, 0.0, s.robot_height}, within})
                 : planned_in(nav::planning_view{*map, *field, nav::ball{s.robot_radius}, within});
  const double ms = std::chrono::duration<double, std::milli>(console::clock::now() - start).count();
  const bool found = path.status == nav::path_status::found;
  const double straight = (s.to - s.from).norm();
  if (found)
    std::snprintf(text, sizeof text, "way of %.3f m over %zu points, straight %.3f m, found in %.1f ms", path.length,
                  path.points.size(), straight, ms);
  else
    std::snprintf(text, sizeof text, "no way: %s", std::string{to_string(path.status)}.c_str());
  console.finish(text);

  if (!s.picture.empty()) {
    const auto drawn = write_navigation_picture({.title = s.input.filename().string(),
                                                 .subtitle = text,
                                                 .map = *map,
                                                 .field = field ? &*field : nullptr,
                                                 .height = s.from.z(),
                                                 .floor = floor ? &*floor : nullptr,
                                                 .radius = s.robot_radius,
                                                 .path = path.points},
                                                s.picture);
    if (!drawn) return give_up(drawn.error());
  }
  if (!found) {
    std::string why{to_string(path.status)};
    if ((path.status == nav::path_status::start_blocked && is_only_unknown(*map, s, s.from)) ||
        (path.status == nav::path_status::goal_blocked && is_only_unknown(*map, s, s.to)))
      why += " by unknown space alone (--unknown free)";
    if (path.points.size() > 1) {
      const orbis::vec3& p = path.points.back();
      std::snprintf(text, sizeof text, "; the nearest place that is reached is %.3f,%.3f,%.3f", p.x(), p.y(), p.z());
      why += text;
    }
    console.error({orbis::errc::degenerate, s.input.string(), "no way: " + why});
    return no_path;
  }
  if (!s.out.empty())
    if (auto written = write_path(s.out, path.points); !written) return give_up(written.error());
  if (!console.print(text)) return give_up({orbis::errc::write_failed, "standard output", "cannot be written"});
  return done;
}

}  // namespace app
