// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cheapest ways of a robot through a map or over a floor.
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
  start_outside,  ///< of the grid or the region, or not finite
  start_blocked,  ///< the robot touches an obstacle where it starts
  goal_outside,
  goal_blocked,
  unreachable,  ///< both are free, and no way leads from one to the other on the grid
  gave_up       ///< after `max_expanded` cells
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

/// How a path is searched.
enum class path_method : std::uint8_t {
  /// Lazy Theta*: straight over many cells where nothing is in between; shorter, but no optimum is proven. Where more
  /// than the length counts (see planning_options), it adds up costs along each of these ways, and takes several times
  /// as long as `grid` for a path that is hardly better.
  any_angle,
  grid  ///< A*: no way in steps from cell to neighbouring cell is cheaper
};

struct path_options {
  path_method method = path_method::any_angle;
  /// Of `any_angle`: how many times as much what is left of the way counts as what lies behind; finite and >= 1. At 1
  /// it looks at ten times as many cells, for paths that are mostly shorter by less than a tenth of a percent.
  double heuristic_weight = 1.1;
  bool shorten = true;  ///< pull the path straight; else it goes from middle to middle of cells
  /// Cells to look at before giving up. Whether the goal can be reached at all, the nearest place that can, and the way
  /// there are looked for with as many each.
  std::size_t max_expanded = 2'000'000;
  std::size_t max_checks = 2'000;  ///< straight ways to check in shortening
};

/// A path, or why there is none.
struct found_path {
  path_status status = path_status::unreachable;
  /// From the start to the goal, metres. If there is no way to the goal, but the start is free: to the middle of the
  /// cell nearest to the goal of all that were reached (nothing if the goal is not finite).
  std::vector<vec3> points{};
  double length = 0.0;       ///< of the points, metres
  double cost = 0.0;         ///< see planning_options: the length where nothing else counts; heights of floors do not
  std::size_t expanded = 0;  ///< cells that were looked at in searches; 0 if the straight way was taken at once
};

/// The length of a polyline, in the unit of its points.
[[nodiscard]] inline double length_of(const std::vector<vec3>& points) noexcept {
  double sum = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i) sum += norm(points[i] - points[i - 1]);
  return sum;
}

/// What a polyline costs, see planning_options. O(cells on the way), or O(points) if the space is uniform.
/// @pre the points lie in the space
template <planning_space Space>
[[nodiscard]] double cost_of(const Space& space, const std::vector<vec3>& points) {
  double sum = 0.0;
  for (std::size_t i = 1; i < points.size(); ++i)
    sum += detail::cost_of(space, space.placed(points[i - 1]), space.placed(points[i]));
  return sum;
}

/// Makes a path cheaper as long as the robot fits: leaves points out that are not needed, and cuts corners. Both ends
/// stay. The result never costs more (see cost_of) and, in a uniform space, is never longer; each of its segments is
/// free (`space.is_free`). It ends after `max_checks` segments have been checked, or when little is gained.
/// O(max_checks) checks of segments and, where the space is not uniform, as many times the costs of the way between the
/// ends of a segment.
/// @pre each segment of `points` is free
template <planning_space Space>
void shorten_path(const Space& space, std::vector<vec3>& points, std::size_t max_checks = 2'000) {
  const auto is_free = [&](const vec3& a, const vec3& b) {
    if (max_checks == 0) return false;
    --max_checks;
    return space.is_free(a, b);
  };
  const auto cost = [&](const vec3& a, const vec3& b) {
    return detail::cost_of(space, space.placed(a), space.placed(b));
  };
  // Whether one can go straight from a point to a later one, for no more than over those between them.
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
  // One check for each point first: a path over the middles of cells has many.
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
    const double before = cost_of(space, points);
    for (std::size_t i = 0; i + 2 < points.size(); ++i) {
      std::size_t farthest = points.size() - 1;
      while (farthest > i + 1 && !is_shortcut(i, farthest)) --farthest;
      erase_between(i, farthest);
    }
    for (std::size_t i = 1; i + 1 < points.size(); ++i) {  // a corner, cut equally far on both sides
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
    if (cost_of(space, points) > before - 1e-3 * space.resolution()) return;
  }
}

namespace detail {

/// Whether the straight way, which is free, costs no more than its length: no other one is cheaper.
template <planning_space Space>
[[nodiscard]] bool costs_its_length(const Space& space, const vec3& a, const vec3& b) {
  return space.is_uniform() || cost_of(space, a, b) <= norm(b - a) * (1.0 + 1e-9);
}

/// Searches over the middles of cells, from a start that is free to a goal (finite) or, where none of `exits` can be
/// reached and `or_near`, to the cell nearest to it of those that can. Sets the points, and what was expanded.
template <planning_space Space>
[[nodiscard]] search_end search_cells(const Space& space, const vec3& start, const vec3& goal,
                                      const std::vector<octree::voxel_key>& exits, const path_options& options,
                                      bool or_near, found_path& out) {
  const auto make_search = [&] {
    return voxel_search{space, options.method == path_method::any_angle, options.heuristic_weight};
  };
  const auto ended = [&](auto& search, search_end how) {
    out.expanded += search.expanded();
    out.points = search.way();
    return how;
  };
  // Most ways are found soon. What takes longer may be a goal that is enclosed: without a look from its side, all that
  // can be reached would be searched for it.
  const std::size_t most = options.max_expanded, soon = std::min<std::size_t>(1'000, most);
  auto search = make_search();
  search_end end = search.run(start, goal, exits, exits.empty() ? 0 : soon);
  if (!exits.empty() && (end != search_end::stopped || soon == most)) return ended(search, end);
  cell_floods floods{space, start, search.doors(start), goal};
  if (!exits.empty() && floods.may_reach_any(exits, most)) return ended(search, search.go_on(most));
  out.expanded += search.expanded();
  if (!or_near) return search_end::exhausted;
  if (const auto nearest = floods.nearest(most)) {
    auto to_nearest = make_search();
    end = to_nearest.run(start, space.center(*nearest), {*nearest}, most);
    if (end == search_end::found) return ended(to_nearest, search_end::exhausted);
    out.expanded += to_nearest.expanded();
  }
  auto all = make_search();  // free cells between which steps are blocked
  static_cast<void>(all.run(start, goal, {}, most));
  return ended(all, search_end::exhausted);
}

}  // namespace detail

/// A way of the robot `from` a start `to` a goal (metres): the straight one if that is free and costs its length; else
/// a cheap one over the middles of cells (see path_method), made shorter in continuous space afterwards, or the
/// straight one if no other one leads there. Without `shorten` always one over the middles of cells. Every
/// segment is free by `space.is_free`: the robot touches no obstacle anywhere on it. Where it cannot go, `status` says
/// why
/// (also a passage between two middles of cells is not seen that is wide enough for the robot only off the grid), and
/// the path leads to the nearest point that is reached.
///
/// O(n log n) for n cells expanded, 16 kB for each 8x8x8 voxels (2 kB for each 8x8 cells of a floor) looked at, and
/// `max_checks` ways to check in shortening. A goal that cannot be reached costs little if it, or the start, is in a
/// small enclosure, or if it lies in an obstacle. If not, as where unknown space is free and no region is named, it is
/// looked for until `max_expanded` cells have been seen.
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
  out.cost = cost_of(space, out.points);
  for (vec3& p : out.points) p = space.on_ground(p);
  out.length = length_of(out.points);
  return out;
}

}  // namespace orbis::nav
