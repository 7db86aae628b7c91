// SPDX-License-Identifier: BSD-3-Clause
//
// Plans a path through a map file for a ball, an upright cylinder, or a robot that drives on the floor.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <optional>
#include <set>
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

#include "../common/memory.hpp"
#include "commands.hpp"
#include "formatted_text.hpp"
#include "navigation.hpp"
#include "navigation_picture.hpp"
#include "result_files.hpp"

namespace app {
namespace {

namespace nav = orbis::nav;
using octree = orbis::octree::occupancy_octree<>;
using orbis::vec3;
using orbis::octree::occupancy;

/// Reads a .bt or .ot map; the first bytes determine the format.
orbis::result<octree> read_map(const std::filesystem::path& path) {
  if (auto folder = needs_file(path, "map.bt")) return orbis::fail(*std::move(folder));
  const auto bytes = orbis::read_file(path);
  if (!bytes) return orbis::fail(bytes.error());
  const auto view = std::as_bytes(std::span{*bytes});
  const auto begins_with = [&](std::string_view magic) { return bytes->starts_with(magic); };
  if (begins_with("# Octomap OcTree binary file")) return orbis::octree::read_bt<octree::model>(view, path.string());
  if (begins_with("# Octomap OcTree file")) return orbis::octree::read_ot<octree::model>(view, path.string());
  return orbis::fail(orbis::errc::unsupported, path.string(), "is not an octree map (.bt or .ot)");
}

orbis::result<void> write_path(const std::filesystem::path& path, const std::vector<vec3>& points) {
  return orbis::write_file_atomically(path, [&](std::ostream& out) {
    out << "# x y z, metres\n";
    char line[128];
    for (const vec3& p : points) {
      std::snprintf(line, sizeof line, "%.6f %.6f %.6f\n", p.x(), p.y(), p.z());
      out << line;
    }
  });
}

/// The error if an output would overwrite the map or the other output; otherwise empty.
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

/// The smallest box around all known space.
orbis::octree::bounding_box known_space(const octree& map) {
  constexpr double inf = std::numeric_limits<double>::infinity();
  orbis::octree::bounding_box box{vec3::Constant(inf), vec3::Constant(-inf)};
  map.for_each_leaf([&](const octree::leaf& leaf) {
    box.min = box.min.cwiseMin((leaf.center.array() - 0.5 * leaf.size).matrix());
    box.max = box.max.cwiseMax((leaf.center.array() + 0.5 * leaf.size).matrix());
  });
  return box;
}

/// Returns true if the distance field may take more than `limit` bytes: the memory of all blocks, with an edge of
/// `reach` metres (at least 16 voxels), that contain the surface of an obstacle or are next to such a block.
/// O(leaves + counted blocks).
bool may_exceed(const octree& map, double reach, double limit) {
  const double edge = std::max(reach / map.resolution(), 16.0), size = edge * map.resolution();
  const double most = limit / (edge * edge * edge * sizeof(std::uint16_t));
  const auto block_of = [&](double x) { return static_cast<std::int64_t>(std::floor(x / size)); };
  std::set<std::array<std::int64_t, 3>> occupied, near;
  const auto is_over = [&](const auto& blocks) { return static_cast<double>(blocks.size()) > most; };
  map.for_each_leaf([&](const octree::leaf& leaf) {
    if (!leaf.occupied || is_over(occupied)) return;
    std::array<std::int64_t, 3> low{}, high{};
    for (int i = 0; i != 3; ++i) {
      low[static_cast<std::size_t>(i)] = block_of(leaf.center[i] - 0.5 * leaf.size);
      high[static_cast<std::size_t>(i)] = block_of(leaf.center[i] + 0.5 * leaf.size);
    }
    for (auto z = low[2]; z <= high[2]; ++z)
      for (auto y = low[1]; y <= high[1] && !is_over(occupied); ++y) {
        const bool is_face = z == low[2] || z == high[2] || y == low[1] || y == high[1];
        const auto step = is_face ? 1 : std::max<std::int64_t>(1, high[0] - low[0]);
        for (auto x = low[0]; x <= high[0]; x += step) occupied.insert({x, y, z});
      }
  });
  for (const auto& [x, y, z] : occupied) {
    if (is_over(occupied) || is_over(near)) return true;
    for (int n = 0; n != 27; ++n) near.insert({x + n % 3 - 1, y + n / 3 % 3 - 1, z + n / 9 - 1});
  }
  return is_over(near);
}

// -- why there is no path

/// Returns true if the robot at `p` touches unknown space and no obstacle.
bool is_only_unknown(const octree& map, const settings& s, const vec3& p) {
  const orbis::octree::overlap_options known{.unknown = occupancy::free};
  if (s.unknown_is_free) return false;
  using standing = nav::swept_shape<nav::vertical_cylinder>;
  return s.is_cylinder ? !overlaps(map, standing{p, p, {s.robot_radius, 0.0, s.robot_height}}, known)
                       : !overlaps(map, orbis::octree::capsule{p, p, s.robot_radius}, known);
}

/// Describes what blocks the robot at `p`: the nearest obstacle, or else unknown space.
std::string describe_blocker(const octree& map, const settings& s, const vec3& p) {
  if (is_only_unknown(map, s, p)) return " only by unknown space (--unknown free treats it as free)";
  double least = std::numeric_limits<double>::infinity();
  vec3 nearest = p;
  map.for_each_leaf([&](const octree::leaf& leaf) {
    if (!leaf.occupied) return;
    const double top = p.z() + (s.is_cylinder ? s.robot_height : 0.0);
    const vec3 body{p.x(), p.y(), std::clamp(leaf.center.z(), p.z(), top)};
    const double distance = ((leaf.center - body).cwiseAbs().array() - 0.5 * leaf.size).max(0.0).matrix().norm();
    if (distance >= least) return;
    least = distance;
    nearest = leaf.center;
  });
  return text(" by an obstacle at %.3f,%.3f,%.3f", nearest.x(), nearest.y(), nearest.z());
}

/// Describes the cell that blocks a driving robot at `p`: an obstacle, unknown space, or space outside the floor map.
std::string describe_blocker(const nav::floor_map& floor, const settings& s, const vec3& p) {
  struct blocker {
    double distance = std::numeric_limits<double>::infinity();  // from `p` to the cell
    orbis::vec2 at = orbis::vec2::Zero();
  } obstacle, unknown;
  for (int y = 0; y != floor.states.height(); ++y)
    for (int x = 0; x != floor.states.width(); ++x) {
      const nav::floor_state state = floor.states(x, y);
      if (state == nav::floor_state::free) continue;
      blocker& nearest = state == nav::floor_state::occupied ? obstacle : unknown;
      const orbis::vec2 center = floor.center(x, y);
      const double dx = std::max(0.0, std::abs(p.x() - center.x()) - 0.5 * floor.resolution);
      const double dy = std::max(0.0, std::abs(p.y() - center.y()) - 0.5 * floor.resolution);
      if (std::hypot(dx, dy) < nearest.distance) nearest = {std::hypot(dx, dy), center};
    }
  constexpr double rounding = 1e-9;
  const auto touches = [&](const blocker& b) { return b.distance <= s.robot_radius + rounding; };
  const char* const remedy = " (--unknown free treats it as free)";
  if (touches(obstacle)) return text(" by an obstacle at %.3f,%.3f", obstacle.at.x(), obstacle.at.y());
  if (touches(unknown)) return text(" only by unknown space at %.3f,%.3f%s", unknown.at.x(), unknown.at.y(), remedy);
  return std::string{" only by unknown space, outside the floor map"} + remedy;
}

/// The free position nearest to `p` among the centres of cells within 2 m; empty if there is none.
template <nav::planning_space Space>
std::optional<vec3> nearest_free(const Space& space, const vec3& p) {
  const auto middle = space.key(space.clamped(p));
  if (!middle) return std::nullopt;
  const double cell = space.resolution();
  const int farthest = std::clamp(static_cast<int>(2.0 / cell), 1, 40);
  double least = std::numeric_limits<double>::infinity();
  std::optional<vec3> nearest;
  const auto shifted = [](std::uint32_t k, int by) { return k + static_cast<std::uint32_t>(by); };
  for (int r = 0; r <= farthest && (r - 0.5) * cell < least; ++r) {  // cells on the surface of a cube around the middle
    const int rz = Space::dimensions == 3 ? r : 0;
    for (int dz = -rz; dz <= rz; ++dz)
      for (int dy = -r; dy <= r; ++dy) {
        const bool is_face = std::abs(dy) == r || (rz != 0 && std::abs(dz) == r);
        for (int dx = -r; dx <= r; dx += is_face ? 1 : 2 * r) {
          const orbis::octree::voxel_key k{shifted(middle->x, dx), shifted(middle->y, dy), shifted(middle->z, dz)};
          if (!space.contains(k)) continue;
          const vec3 center = space.center(k);
          const double distance = (center - space.placed(p)).norm();
          if (distance >= least || !space.is_free(k)) continue;
          least = distance;
          nearest = center;
        }
      }
  }
  return nearest;
}

/// The reason why there is no path, and the distance from the goal to the nearest reachable position.
template <nav::planning_space Space, class Map>
std::string explain(const nav::found_path& path, const Space& space, const Map& map,
                    const orbis::octree::bounding_box& known, const settings& s) {
  using enum nav::path_status;
  const auto distance = [&](const vec3& a, const vec3& b) { return (space.placed(a) - space.placed(b)).norm(); };
  std::string why{to_string(path.status)};
  const bool is_start = path.status == start_blocked;
  if (is_start || path.status == goal_blocked) {
    const vec3& end = is_start ? s.from : s.to;
    why += describe_blocker(map, s, end);
    if (const auto free = nearest_free(space, end)) {
      const vec3 p = space.on_ground(*free);
      why +=
          text("; the nearest free position is %.3f,%.3f,%.3f, %.3f m away", p.x(), p.y(), p.z(), distance(*free, end));
    } else {
      why += "; there is no free position near it";
    }
  }
  if (path.points.size() > 1) {
    const vec3& p = path.points.back();
    why += text("; the nearest reachable position is %.3f,%.3f,%.3f, %.3f m from the goal", p.x(), p.y(), p.z(),
                distance(p, s.to));
  }
  if (path.status == start_outside || path.status == goal_outside) {
    const auto corner = [](const vec3& p) { return text("%.3f,%.3f,%.3f", p.x(), p.y(), p.z()); };
    why += "; the map extends from " + corner(known.min) + " to " + corner(known.max);
  }
  return why;
}

// -- the search

struct planned {
  nav::found_path path;
  double ms = 0.0;
  std::string why;  ///< empty if a path was found
};

template <nav::planning_space Space, class Map>
planned plan_in(const Space& space, const Map& map, const orbis::octree::bounding_box& known, const settings& s) {
  const auto start = console::clock::now();
  planned p{.path = nav::find_path(space, s.from, s.to), .why = {}};
  p.ms = std::chrono::duration<double, std::milli>(console::clock::now() - start).count();
  if (p.path.status != nav::path_status::found) p.why = explain(p.path, space, map, known, s);
  return p;
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
  console.finish(s.input.filename().string() + text(": voxels of %g cm", 100 * cell));

  console.stage("preparing");
  const occupancy unknown = s.unknown_is_free ? occupancy::free : occupancy::occupied;
  std::optional<nav::floor_map> floor;
  std::optional<nav::distance_field> field;
  if (s.on_floor) {
    auto made = nav::make_floor_map(
        *map, {.radius = s.robot_radius, .height = s.robot_height, .step = s.robot_step.value_or(cell)});
    if (!made) return give_up({made.error().code, s.input.string(), made.error().message});
    floor = *std::move(made);
  } else {
    const double reach = field_reach(s.robot_radius, cell);
    const auto memory = examples::free_memory();
    if (memory && may_exceed(*map, reach, static_cast<double>(*memory)))
      return give_up({orbis::errc::invalid_argument, s.input.string(),
                      text("the distance field, up to %.2f m from obstacles in voxels of %g mm, may take more than the "
                           "%.1f GB of available memory",
                           reach, 1000 * cell, 1e-9 * static_cast<double>(*memory))});
    field.emplace(*map, nav::distance_field_options{.reach = reach, .unknown = unknown});
  }
  console.finish(floor ? "floor map" : "distance field");

  console.stage("planning");
  const orbis::octree::bounding_box known = known_space(*map);
  const double margin = 1.0 + 2 * s.robot_radius;
  const nav::planning_options within{
      .region = {{(known.min.array() - margin).matrix(), (known.max.array() + margin).matrix()}}};
  const nav::vertical_cylinder cylinder{s.robot_radius, 0.0, s.robot_height};
  const planned found =
      floor           ? plan_in(nav::floor_view{*floor, s.robot_radius, {}, unknown}, *floor, known, s)
      : s.is_cylinder ? plan_in(nav::planning_view{*map, *field, cylinder, within}, *map, known, s)
                      : plan_in(nav::planning_view{*map, *field, nav::ball{s.robot_radius}, within}, *map, known, s);
  const std::string outcome = found.why.empty()
                                  ? text("path of %.3f m over %zu points, straight line %.3f m, found in %.1f ms",
                                         found.path.length, found.path.points.size(), (s.to - s.from).norm(), found.ms)
                                  : "no path: " + std::string{to_string(found.path.status)};
  console.finish(found.why.empty() ? text("%.1f ms", found.ms) : outcome);

  if (!s.picture.empty()) {
    const auto drawn = write_navigation_picture({.title = s.input.filename().string(),
                                                 .subtitle = outcome,
                                                 .map = *map,
                                                 .field = field ? &*field : nullptr,
                                                 .height = s.from.z(),
                                                 .floor = floor ? &*floor : nullptr,
                                                 .radius = s.robot_radius,
                                                 .path = found.path.points},
                                                s.picture);
    if (!drawn) return give_up(drawn.error());
  }
  if (!found.why.empty())
    return console.error({orbis::errc::degenerate, s.input.string(), "no path: " + found.why}), no_path;
  if (!s.out.empty())
    if (auto written = write_path(s.out, found.path.points); !written) return give_up(written.error());
  if (!console.print(outcome)) return give_up({orbis::errc::write_failed, "standard output", "cannot be written"});
  return done;
}

}  // namespace app
