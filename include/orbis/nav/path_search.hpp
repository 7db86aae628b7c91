// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cheapest paths of a robot through a map or over a floor.
///
/// @code
///   const orbis::nav::planning_view view{map, field, 0.2};
///   const orbis::nav::found_path path = orbis::nav::find_path(view, start, goal);
///   if (path.status == orbis::nav::path_status::found) follow(path.points);
/// @endcode
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/nav/detail/path/cell_floods.hpp>
#include <orbis/nav/detail/path/segments.hpp>
#include <orbis/nav/detail/path/voxel_search.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav {

enum class path_status : std::uint8_t {
  found,
  start_outside,  ///< the start is outside the grid or the region, or not finite
  start_blocked,  ///< the robot touches an obstacle at the start
  goal_outside,
  goal_blocked,
  unreachable,  ///< both ends are free, but no path on the grid connects them
  gave_up       ///< `max_expanded` cells were expanded without a result
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

/// Method of the path search.
enum class path_method : std::uint8_t {
  /// Lazy Theta*: straight segments across many cells where no obstacle is in the way. Paths are shorter, but not
  /// guaranteed to be optimal. If costs other than length apply (see planning_options), costs are integrated along each
  /// segment, which takes several times as long as `grid` for a marginally better path.
  any_angle,
  grid  ///< A*: optimal among paths in steps from cell to neighbouring cell
};

struct path_options {
  path_method method = path_method::any_angle;
  /// Weight of the heuristic for `any_angle`; finite and >= 1. With 1, the search expands ten times as many cells for
  /// paths that are typically less than 0.1 % shorter.
  double heuristic_weight = 1.1;
  bool shorten = true;  ///< true to straighten the path; otherwise it runs from cell centre to cell centre
  /// Maximum number of expanded cells. The limit applies separately to the test of whether the goal is reachable, to
  /// the search for the nearest reachable cell, and to the search for a path to it.
  std::size_t max_expanded = 2'000'000;
  std::size_t max_checks = 2'000;  ///< maximum number of segments checked by shortening
};

/// A path, or the reason why no path was found.
struct found_path {
  path_status status = path_status::unreachable;
  /// Points of the path from the start to the goal, metres. If no path leads to the goal but the start is free, the
  /// path ends at the centre of the reached cell nearest to the goal (empty if the goal is not finite).
  std::vector<vec3> points{};
  double length = 0.0;       ///< length of the path, metres
  double cost = 0.0;         ///< see planning_options; in a uniform space, the length (on a floor, horizontal length)
  std::size_t expanded = 0;  ///< number of expanded cells; 0 if the straight segment was used without a search
};

/// The length of a polyline, in the unit of its points.
[[nodiscard]] inline double path_length(const std::vector<vec3>& points) noexcept {
  double sum = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += norm(points[i] - points[i - 1]);
  return sum;
}
[[deprecated("use path_length")]] [[nodiscard]] inline double length_of(const std::vector<vec3>& points) noexcept {
  return path_length(points);
}

/// Cost of a polyline, see planning_options. O(cells on the polyline), or O(points) if the space is uniform.
/// @pre the points lie in the space
template <planning_space Space>
[[nodiscard]] double path_cost(const Space& space, const std::vector<vec3>& points) {
  double sum = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i)
    sum += detail::segment_cost(space, space.placed(points[i - 1]), space.placed(points[i]));
  return sum;
}
template <planning_space Space>
[[deprecated("use path_cost")]] [[nodiscard]] double cost_of(const Space& space, const std::vector<vec3>& points) {
  return path_cost(space, points);
}

/// Makes a path cheaper where the robot fits: removes unnecessary points and cuts corners. Both ends are kept. The
/// result never costs more (see path_cost) and, in a uniform space, is never longer; each of its segments is free
/// (`space.is_free`). Stops after `max_checks` segments have been checked, or when the gain becomes small.
/// O(max_checks) segment checks and, if the space is not uniform, O(max_checks) cost evaluations of the path between
/// the ends of a segment.
/// @pre each segment of `points` is free
template <planning_space Space>
void shorten_path(const Space& space, std::vector<vec3>& points, std::size_t max_checks = 2'000) {
  const auto is_free = [&](const vec3& a, const vec3& b) {
    if (max_checks == 0) return false;
    --max_checks;
    return space.is_free(a, b);
  };
  const auto cost = [&](const vec3& a, const vec3& b) {
    return detail::segment_cost(space, space.placed(a), space.placed(b));
  };
  // True if the segment from a point to a later one is free and costs no more than the path between them.
  const auto is_shortcut = [&](std::size_t i, std::size_t j) {
    if (!is_free(points[i], points[j])) return false;
    if (space.is_uniform()) return true;
    double along = 0.0;
    for (std::size_t k = i; k != j; ++k) along += cost(points[k], points[k + 1]);
    return cost(points[i], points[j]) <= along;
  };
  const auto erase_between = [&](std::size_t i, std::size_t j) {
    points.erase(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, points.begin() + static_cast<std::ptrdiff_t>(j));
  };
  // First, check each point once: a path over cell centres has many points.
  std::size_t last = 0;
  for (std::size_t i = 2; i < points.size(); ++i) {
    if (is_free(points[last], points[i]) &&
        (space.is_uniform() ||
         cost(points[last], points[i]) <= cost(points[last], points[last + 1]) + cost(points[last + 1], points[i])))
      points[last + 1] = points[i];
    else
      points[++last + 1] = points[i];
  }
  if (points.size() > 2) points.resize(last + 2);
  for (int round = 0; round != 4 && max_checks != 0; ++round) {
    const double before = path_cost(space, points);
    for (std::size_t i = 0; i + 2 < points.size(); ++i) {
      std::size_t farthest = points.size() - 1;
      while (farthest > i + 1 && !is_shortcut(i, farthest)) --farthest;
      erase_between(i, farthest);
    }
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {  // cuts a corner equally far on both sides
      const vec3 a = points[i - 1], b = points[i], c = points[i + 1];
      const auto on = [](const vec3& p, const vec3& q, double share) -> vec3 { return p + share * (q - p); };
      const double around = space.is_uniform() ? 0.0 : cost(a, b) + cost(b, c);
      double low = 0.0, high = 1.0;
      for (int k = 0; k != 6; ++k) {
        const double share = (low + high) / 2;
        const vec3 p = on(b, a, share), q = on(b, c, share);
        const bool is_better = is_free(p, q) && (space.is_uniform() || cost(a, p) + cost(p, q) + cost(q, c) <= around);
        (is_better ? low : high) = share;
      }
      if (low == 0.0) continue;
      points[i] = on(b, a, low);
      points.insert(points.begin() + static_cast<std::ptrdiff_t>(i) + 1, on(b, c, low));
      ++i;
    }
    if (path_cost(space, points) > before - 1e-3 * space.resolution()) return;
  }
}

namespace detail {

/// Returns true if the cost of the free segment equals its length, so that no path is cheaper.
template <planning_space Space>
[[nodiscard]] bool costs_its_length(const Space& space, const vec3& a, const vec3& b) {
  return space.is_uniform() || segment_cost(space, a, b) <= norm(b - a) * (1.0 + 1e-9);
}

/// Searches over cell centres from a free start to a finite goal or, if none of `exits` can be reached and `or_near` is
/// set, to the reachable cell nearest to the goal. Sets the points and the number of expanded cells in the result.
template <planning_space Space>
[[nodiscard]] search_end search_cells(const Space& space, const vec3& start, const vec3& goal,
                                      const std::vector<octree::voxel_key>& exits, const path_options& options,
                                      bool or_near, found_path& out) {
  const auto make_search = [&] {
    return voxel_search{space, options.method == path_method::any_angle, options.heuristic_weight};
  };
  const auto ended = [&](auto& search, search_end how) {
    out.expanded += search.expanded();
    out.points = search.path();
    return how;
  };
  // Most paths are found quickly. If the search takes longer, the goal may be enclosed; without a flood from the goal,
  // the search would then expand all reachable cells.
  const std::size_t most = options.max_expanded, soon = std::min<std::size_t>(1'000, most);
  auto search = make_search();
  search_end end = search.run(start, goal, exits, exits.empty() ? 0 : soon);
  if (!exits.empty() && (end != search_end::stopped || soon == most)) return ended(search, end);
  cell_floods floods{space, start, search.doors(start), goal};
  if (!exits.empty() && floods.may_reach_any(exits, most)) return ended(search, search.resume(most));
  out.expanded += search.expanded();
  if (!or_near) return search_end::exhausted;
  if (const auto nearest = floods.nearest(most)) {
    auto to_nearest = make_search();
    end = to_nearest.run(start, space.center(*nearest), {*nearest}, most);
    if (end == search_end::found) return ended(to_nearest, search_end::exhausted);
    out.expanded += to_nearest.expanded();
  }
  auto all = make_search();  // free cells connect the start to the nearest cell, but steps between them are blocked
  static_cast<void>(all.run(start, goal, {}, most));
  return ended(all, search_end::exhausted);
}

}  // namespace detail

/// Finds a path for the robot from the start `from` to the goal `to` (metres): the straight segment if it is free and
/// its cost equals its length; otherwise a cheap path over cell centres (see path_method), which is then shortened in
/// continuous space, or the straight segment if there is no other path. Without `shorten`, the path always runs over
/// cell centres. Every segment is free according to `space.is_free`: the robot touches no obstacle anywhere on it. If
/// the goal cannot be reached, `status` gives the reason and the path leads to the nearest reachable point. A passage
/// in which the robot fits only between cell centres is not found.
///
/// O(n log n) for n expanded cells, 16 kB per visited block of 8x8x8 voxels (2 kB per 8x8 cells of a floor), and
/// `max_checks` segment checks for shortening. An unreachable goal costs little if it, or the start, is in a small
/// enclosure, or if it is in an obstacle. Otherwise, for example if unknown space is free and no region is given, the
/// search expands `max_expanded` cells.
/// @pre options.heuristic_weight is finite and >= 1
template <planning_space Space>
[[nodiscard]] found_path find_path(const Space& space, const vec3& from, const vec3& to,
                                   const path_options& options = {}) {
  assert(options.heuristic_weight >= 1.0 && std::isfinite(options.heuristic_weight));
  found_path out;
  const vec3 start = space.placed(from), goal = space.placed(to);
  if (!space.key(start)) {
    out.status = path_status::start_outside;
    return out;
  }
  if (!space.is_free(start)) {
    out.status = path_status::start_blocked;
    return out;
  }
  const bool is_inside = space.key(goal).has_value();
  const bool is_free = is_inside && space.is_free(goal);
  if (!all_finite(goal)) {
    out.status = path_status::goal_outside;
    return out;
  }
  const bool is_straight = is_free && options.shorten && space.is_free(start, goal);
  if (is_straight && detail::costs_its_length(space, start, goal)) {
    out.status = path_status::found;
    out.points = {start, goal};
  } else {
    const auto exits = is_free ? detail::voxel_search{space}.doors(goal) : std::vector<octree::voxel_key>{};
    switch (detail::search_cells(space, start, goal, exits, options, !is_straight, out)) {
      case detail::search_end::found: out.status = path_status::found; break;
      case detail::search_end::exhausted: out.status = path_status::unreachable; break;
      case detail::search_end::stopped: out.status = path_status::gave_up; break;
    }
    if (is_straight && out.status == path_status::unreachable) {
      out.status = path_status::found;
      out.points = {start, goal};
    }
    if (!is_inside) out.status = path_status::goal_outside;
    if (is_inside && !is_free) out.status = path_status::goal_blocked;
    if (options.shorten) shorten_path(space, out.points, options.max_checks);
  }
  out.cost = path_cost(space, out.points);
  for (vec3& p : out.points) p = space.on_ground(p);
  out.length = path_length(out.points);
  return out;
}

}  // namespace orbis::nav
