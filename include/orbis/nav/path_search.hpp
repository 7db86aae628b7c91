// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Shortest ways of a round robot through a map.
///
/// @code
///   const orbis::nav::planning_view view{map, field, 0.2};
///   const orbis::nav::found_path path = orbis::nav::find_path(view, start, goal);
///   if (path.status == orbis::nav::path_status::found) follow(path.points);
/// @endcode
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/nav/detail/path/voxel_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav {

enum class path_status : std::uint8_t {
  found,
  start_outside,  ///< of the grid, or not finite
  start_blocked,  ///< the robot touches an obstacle where it starts
  goal_outside,
  goal_blocked,
  unreachable,  ///< both are free, and no way leads from one to the other on the grid
  gave_up       ///< after `max_expanded` voxels
};

[[nodiscard]] constexpr std::string_view to_string(path_status s) noexcept {
  switch (s) {
    case path_status::found: return "found";
    case path_status::start_outside: return "start outside";
    case path_status::start_blocked: return "start blocked";
    case path_status::goal_outside: return "goal outside";
    case path_status::goal_blocked: return "goal blocked";
    case path_status::unreachable: return "unreachable";
    case path_status::gave_up: return "gave up";
  }
  return "unknown";
}

struct path_options {
  bool shorten = true;                   ///< pull the path straight; else it goes from voxel to voxel
  std::size_t max_expanded = 2'000'000;  ///< voxels to look at before giving up
};

/// A path, or why there is none.
struct found_path {
  path_status status = path_status::unreachable;
  /// From the start to the goal, metres. If there is no way to the goal, but the start is free: to the middle of the
  /// voxel nearest to the goal of all that were reached (nothing if the goal is not finite).
  std::vector<vec3> points{};
  double length = 0.0;       ///< metres
  std::size_t expanded = 0;  ///< voxels that were looked at; 0 if the straight way is free
};

/// The length of a polyline, in the unit of its points.
[[nodiscard]] inline double length_of(const std::vector<vec3>& points) noexcept {
  double sum = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += (points[i] - points[i - 1]).norm();
  return sum;
}

/// Makes a path shorter as long as the robot fits: leaves points out that are not needed, and cuts corners. Both ends
/// stay. The result is never longer, and each of its segments is free (`view.is_free`).
/// @pre each segment of `points` is free
template <octree::octree_map Map>
void shorten_path(const planning_view<Map>& view, std::vector<vec3>& points) {
  const double cell = view.field().grid().resolution();
  for (int round = 0; round != 4; ++round) {
    const double before = length_of(points);
    for (std::size_t i = 0; i + 2 < points.size(); ++i) {
      std::size_t farthest = points.size() - 1;
      while (farthest > i + 1 && !view.is_free(points[i], points[farthest])) --farthest;
      points.erase(points.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                   points.begin() + static_cast<std::ptrdiff_t>(farthest));
    }
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {  // a corner, cut equally far on both sides
      const vec3 a = points[i - 1], b = points[i], c = points[i + 1];
      const auto on = [](const vec3& from, const vec3& to, double share) -> vec3 { return from + share * (to - from); };
      double low = 0.0, high = 1.0;
      for (int k = 0; k != 6; ++k) {
        const double share = (low + high) / 2;
        (view.is_free(on(b, a, share), on(b, c, share)) ? low : high) = share;
      }
      if (low == 0.0) continue;
      points[i] = on(b, a, low);
      points.insert(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, on(b, c, low));
      ++i;
    }
    if (length_of(points) > before - 1e-3 * cell) return;
  }
}

/// A way of the robot from `start` to `goal` (metres): the straight one if that is free; else the shortest one over the
/// middles of voxels, with steps to the 26 neighbours, made shorter in continuous space afterwards. Every segment is
/// free by `view.is_free`: the robot's ball touches no obstacle anywhere on it. Where it cannot go, `status` says why
/// (also a passage between two middles of voxels is not seen that is wide enough for the robot only off the grid), and
/// the path leads to the nearest point that is reached.
///
/// O(n log n) for n voxels expanded, 8 kB for each 8x8x8 voxels looked at. Where unknown space is free, the search for
/// a goal that cannot be reached ends at `max_expanded` only.
template <octree::octree_map Map>
[[nodiscard]] found_path find_path(const planning_view<Map>& view, const vec3& start, const vec3& goal,
                                   const path_options& options = {}) {
  const octree::voxel_grid& grid = view.field().grid();
  found_path out;
  if (!start.allFinite() || !grid.key(start)) {
    out.status = path_status::start_outside;
    return out;
  }
  if (!view.is_free(start)) {
    out.status = path_status::start_blocked;
    return out;
  }
  const bool is_inside = goal.allFinite() && grid.key(goal);
  const bool is_free = is_inside && view.is_free(goal);
  if (is_free && options.shorten && view.is_free(start, goal)) {
    out = {path_status::found, {start, goal}, (goal - start).norm(), 0};
    return out;
  }
  if (!goal.allFinite()) {
    out.status = path_status::goal_outside;
    return out;
  }
  detail::voxel_search search{view, options.max_expanded};
  const auto exits = is_free ? search.doors(goal) : std::vector<octree::voxel_key>{};
  switch (search.run(start, goal, exits)) {
    case detail::search_end::found: out.status = path_status::found; break;
    case detail::search_end::exhausted: out.status = path_status::unreachable; break;
    case detail::search_end::stopped: out.status = path_status::gave_up; break;
  }
  out.expanded = search.expanded();
  out.points = search.way();
  out.points.insert(out.points.begin(), start);
  if (out.status == path_status::found) out.points.push_back(goal);
  if (!is_inside) out.status = path_status::goal_outside;
  if (is_inside && !is_free) out.status = path_status::goal_blocked;
  if (options.shorten) shorten_path(view, out.points);
  out.length = length_of(out.points);
  return out;
}

}  // namespace orbis::nav
