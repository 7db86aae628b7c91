// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The next best view of an exploring robot.
///
/// @code
///   const auto places = orbis::nav::candidate_viewpoints(frontiers.clusters({.min_size = 20}), map.grid());
///   const auto next = orbis::nav::next_best_view(view, places, camera, position);
///   if (next.status == orbis::nav::next_view_status::found) go(next.path.points), look(next.T_world_camera);
/// @endcode
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/detail/path/cell_floods.hpp>
#include <orbis/nav/detail/path/voxel_search.hpp>
#include <orbis/nav/frontiers.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/nav/view_gain.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav {

/// Returns points on a frontier for the camera to look at (metres): clusters are split by a lattice of cubes, and each
/// point is the mean of the frontier voxels in one cube. The points are in the order of `clusters`. `spacing`: edge
/// length of the cubes, metres, rounded to a power of two of voxels, at least 4 voxels.
[[nodiscard]] inline std::vector<vec3> candidate_viewpoints(std::span<const frontier_cluster> clusters,
                                                            const octree::voxel_grid& grid, double spacing = 0.8) {
  const double levels = std::round(std::log2(std::max(4.0, spacing / grid.resolution())));
  const int level = static_cast<int>(std::clamp(levels, 2.0, static_cast<double>(grid.depth())));
  std::vector<vec3> places;
  for (const frontier_cluster& c : clusters) {
    // Octants are in Morton order, so the octants of a cube are consecutive.
    for (std::size_t i = 0; i != c.octants.size();) {
      const octree::voxel_key cube = octree::node_key(c.octants[i].octant, level);
      vec3 sum = zeros<vec3>();
      double count = 0.0;
      for (; i != c.octants.size() && octree::node_key(c.octants[i].octant, level) == cube; ++i)
        for (std::uint64_t rest = c.octants[i].mask; rest != 0; rest &= rest - 1) {
          const octree::voxel_key low = c.octants[i].octant;
          const octree::voxel_key in = octree::morton_key(static_cast<std::uint64_t>(std::countr_zero(rest)));
          sum += grid.center(octree::voxel_key{low.x + in.x, low.y + in.y, low.z + in.z});
          count += 1.0;
        }
      places.push_back(sum / count);
    }
  }
  return places;
}
[[deprecated("use candidate_viewpoints")]] [[nodiscard]] inline std::vector<vec3> places_of(
    std::span<const frontier_cluster> clusters, const octree::voxel_grid& grid, double spacing = 0.8) {
  return candidate_viewpoints(clusters, grid, spacing);
}

struct next_view_options {
  view_gain_options gain{};
  int candidates = 12;         ///< number of poses for each place
  double min_distance = 0.5;   ///< minimum distance of the camera from the place, metres
  double max_distance = 2.0;   ///< maximum distance of the camera from the place, metres
  double max_elevation = 0.5;  ///< maximum angle of the camera's axis above or below the horizontal, radians
  double min_gain = 0.0;       ///< minimum unknown space that a view must see, cubic metres
  /// Penalty for path length, 1 / metres: the utility of a view is its gain times exp(-lambda * length).
  double lambda = 0.2;
  path_options path{};
  std::uint64_t seed = 1;  ///< seed of the random candidates
};

enum class next_view_status : std::uint8_t {
  found,
  /// No candidate pose at which the robot is free sees enough unknown space. Candidates are random: if little is left
  /// to see or the robot barely fits, another seed may find a view.
  nothing_to_see,
  start_outside,  ///< the robot is outside the grid or the region, or its position is not finite
  start_blocked,  ///< the robot touches an obstacle
  unreachable,    ///< no path leads to any of the candidates
  gave_up         ///< no path was found after path.max_expanded cells; one may exist
};

[[nodiscard]] constexpr std::string_view to_string(next_view_status s) noexcept {
  switch (s) {
    case next_view_status::found: return "found";
    case next_view_status::nothing_to_see: return "nothing to see";
    case next_view_status::start_outside: return "start outside";
    case next_view_status::start_blocked: return "start blocked";
    case next_view_status::unreachable: return "unreachable";
    case next_view_status::gave_up: return "gave up";
  }
  return "unknown";
}

/// A view and the path to it, or the reason why there is none.
struct next_view {
  next_view_status status = next_view_status::nothing_to_see;
  se3 T_world_camera{};        ///< the camera's axes: x right, y down, z forward; x is horizontal
  vec3 place = zeros<vec3>();  ///< the point that the camera looks at, metres
  double gain = 0.0;           ///< unknown space that the camera would see, cubic metres
  double utility = 0.0;        ///< gain * exp(-lambda * length of the path); 0 if that is too small for a double
  found_path path{};
};

/// The pose of a level camera at `from` that looks at `to` (metres).
/// @pre `to` is not `from`, and neither above nor below it
[[nodiscard]] inline se3 looking_at(const vec3& from, const vec3& to) {
  const vec3 ahead = normalized(to - from), right = normalized(cross(ahead, vec3(0.0, 0.0, 1.0)));
  return {so3{columns(right, cross(ahead, right), ahead)}, from};
}

/// Selects the best among random views of the places. A view qualifies if its gain is greater than 0 and at least
/// `min_gain`, and the robot (whose camera is at its reference point) is free there and can reach it. The best view has
/// the greatest utility, gain * exp(-lambda * length of the path): H. H. Gonzalez-Banos, J.-C. Latombe, "Navigation
/// strategies for exploring indoor environments", International Journal of Robotics Research 21, 2002. A path is
/// searched for only while a straight path could still be the best, and only if the straight segment is free or free
/// cells connect both ends. The z axis of the world points up.
///
/// All failed searches together expand fewer than 2 * `path.max_expanded` cells, regardless of the number of
/// candidates: each search expands at most half of the remaining number. If more cells than that are reachable, for
/// example because unknown space is free and no region is given, some searches may give up; the result is then the best
/// of the views to which a path was found, if any.
///
/// Deterministic. Typically takes a millisecond per candidate, plus the cost of find_path.
/// @pre 0 < min_distance <= max_distance; 0 <= max_elevation < pi / 2; lambda >= 0
template <planning_map Map, robot_shape Shape, camera::camera_model Camera>
[[nodiscard]] next_view next_best_view(const planning_view<Map, Shape>& view, std::span<const vec3> places,
                                       const Camera& camera, const vec3& position,
                                       const next_view_options& options = {}) {
  assert(options.min_distance > 0.0 && options.min_distance <= options.max_distance && options.lambda >= 0.0);
  assert(options.max_elevation >= 0.0 && options.max_elevation < 1.5707963267948966);
  struct candidate {
    next_view view;
    double bound = 0.0;  ///< upper bound of the logarithm of its utility, reached if the straight segment is free
  };
  if (!view.key(position)) return {.status = next_view_status::start_outside};
  if (!view.is_free(position)) return {.status = next_view_status::start_blocked};
  const octree::voxel_grid& grid = view.grid();
  const double voxel = grid.resolution() * grid.resolution() * grid.resolution();
  view_gain gain{view.map(), camera, options.gain};
  random_bits random{options.seed};
  std::vector<candidate> candidates;
  for (const vec3& place : places)
    for (int i = 0; i < options.candidates; ++i) {
      const double azimuth = random.uniform(0.0, 6.283185307179586);
      const double elevation = random.uniform(-options.max_elevation, options.max_elevation);
      const double distance = random.uniform(options.min_distance, options.max_distance);
      const vec3 ahead{std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
                       std::sin(elevation)};
      const vec3 from = place - distance * ahead;
      if (!view.key(from) || !view.is_free(from)) continue;
      const se3 pose = looking_at(from, place);
      const double seen = voxel * static_cast<double>(gain(pose));
      if (!(seen > 0.0 && seen >= options.min_gain)) continue;
      candidate& c = candidates.emplace_back();
      c.view.status = next_view_status::found;
      c.view.T_world_camera = pose;
      c.view.place = place;
      c.view.gain = seen;
      c.bound = std::log(seen) - options.lambda * norm(from - position);
    }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const candidate& a, const candidate& b) { return a.bound > b.bound; });
  next_view best{.status = candidates.empty() ? next_view_status::nothing_to_see : next_view_status::unreachable};
  const detail::voxel_search doors{view};
  detail::cell_floods floods{view, position, doors.doors(position), position};
  path_options how = options.path;
  std::size_t left = 2 * std::min(options.path.max_expanded, std::numeric_limits<std::size_t>::max() / 2);
  double most = -std::numeric_limits<double>::infinity();  // the logarithm of a utility that may itself round to 0
  for (candidate& c : candidates) {
    if (most >= c.bound) break;
    const vec3 goal = c.view.T_world_camera.translation();
    how.max_expanded = left / 2;
    const bool is_straight = how.shorten && view.is_free(position, goal);
    if (!is_straight && !floods.may_reach_any(doors.doors(goal), how.max_expanded)) continue;
    c.view.path = find_path(view, position, goal, how);
    if (c.view.path.status != path_status::found) left -= std::min(left, c.view.path.expanded);
    if (c.view.path.status == path_status::gave_up && best.status != next_view_status::found)
      best.status = next_view_status::gave_up;
    if (c.view.path.status != path_status::found) continue;
    c.view.utility = c.view.gain * std::exp(-options.lambda * c.view.path.length);
    const double worth = std::log(c.view.gain) - options.lambda * c.view.path.length;
    if (worth > most) most = worth, best = std::move(c.view);
  }
  return best;
}

}  // namespace orbis::nav
