// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Paths in a changing map: tests whether a change blocks a path, and replans only if it does.
///
/// @code
///   orbis::nav::replanner planner{goal};
///   for (;;) {
///     map.integrate(...), field.update(map);
///     const auto& path = planner.update(orbis::nav::planning_view{map, field, 0.2}, position());
///     if (path.status != orbis::nav::path_status::found) stop();
///     else go_on_along(path.points);
///   }
/// @endcode
///
/// On a floor, pass a `floor_view` of the new floor map each time.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/image.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/detail/map_follower.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/overlap.hpp>

namespace orbis::nav {

namespace detail {
/// A view of a map that records its changes, with a swept robot shape.
template <class Space>
concept follows_changes = requires(const Space& space) {
  requires has_change_log<std::remove_cvref_t<decltype(space.map())>>;
  requires robot_shape<std::remove_cvref_t<decltype(space.shape())>>;
  { space.grid() } -> std::convertible_to<const octree::voxel_grid&>;
};
}  // namespace detail

/// Monitors whether a path stays free while the map changes. Uses the map's change log to retest exactly those segments
/// along which the robot sweeps over a changed octant (4x4x4 voxels). Tests all segments if the log does not reach back
/// far enough, on floors, and on maps without a log. Does not detect shorter paths that open up when obstacles
/// disappear.
class path_monitor {
 public:
  /// A monitor without a path.
  path_monitor() = default;
  /// @pre each segment of `points` is free in the map of `space`
  template <planning_space Space>
  path_monitor(const Space& space, std::vector<vec3> points) : points_{std::move(points)} {
    if constexpr (detail::follows_changes<Space>) follower_.mark_read(space.map());
  }

  /// Index of the first segment (from points()[i] to points()[i + 1]) that has become blocked since the path was set or
  /// last checked; empty if all are free. A blocked segment is tested again each time. O(changed octants x segments)
  /// with few operations each, plus the cost of `is_free` for the segments that are tested. @pre every call passes a
  /// view of the current state of the same map (for floors: of a map of the same world)
  template <planning_space Space>
  [[nodiscard]] std::optional<std::size_t> first_blocked(const Space& space) {
    const std::size_t segments = points_.empty() ? 0 : points_.size() - 1;
    is_suspect_.resize(segments);
    if constexpr (detail::follows_changes<Space>)
      follower_.follow(
          space.map(), [&](const octree::change_log& log, std::uint64_t since) { suspect(space, log, since); },
          [&] { is_suspect_.assign(segments, true); });
    else
      is_suspect_.assign(segments, true);
    tested_ = 0;
    for (std::size_t i = 0; i != segments; ++i) {
      if (!is_suspect_[i]) continue;
      ++tested_;
      if (!space.is_free(points_[i], points_[i + 1])) return i;
      is_suspect_[i] = false;
    }
    return std::nullopt;
  }
  /// Number of segments tested by the last call to first_blocked.
  [[nodiscard]] std::size_t tested() const noexcept { return tested_; }
  [[nodiscard]] const std::vector<vec3>& points() const noexcept { return points_; }

  /// Sets the robot's position (metres): drops the part of the path that the robot has passed; the path then begins at
  /// `position`. The segment from `position` to the next point is tested again, unless `position` is already the first
  /// point of the path.
  void advance(const vec3& position) {
    if (points_.size() < 2 || position == points_.front()) return;
    is_suspect_.resize(points_.size() - 1);
    // The segment nearest to the position; on ties, the first.
    std::size_t nearest = 0;
    double least = -1.0;
    for (std::size_t i = 0; i + 1 != points_.size(); ++i) {
      const vec3 along = points_[i + 1] - points_[i];
      const double squared = squared_norm(along);
      const double t = squared > 0.0 ? std::clamp(dot(position - points_[i], along) / squared, 0.0, 1.0) : 0.0;
      const double away = squared_norm(points_[i] + t * along - position);
      if (least < 0.0 || away < least) least = away, nearest = i;
    }
    const auto passed = static_cast<std::ptrdiff_t>(nearest);
    points_.erase(points_.begin(), points_.begin() + passed);
    is_suspect_.erase(is_suspect_.begin(), is_suspect_.begin() + passed);
    points_.front() = position;
    is_suspect_.front() = true;
  }

 private:
  /// Marks the segments along which the robot sweeps over a changed octant.
  template <class Space>
  void suspect(const Space& space, const octree::change_log& log, std::uint64_t since) {
    sweeps_.clear();
    for (std::size_t i = 0; i != is_suspect_.size(); ++i)
      sweeps_.push_back(bounds_of(swept(space.shape(), points_[i], points_[i + 1])));
    log.for_each_since(since, [&](const octree::voxel_key& k, std::uint64_t) {
      const octree::bounding_box octant = octree::node_cube(space.grid(), k, 2);
      for (std::size_t i = 0; i != is_suspect_.size(); ++i)
        if (!is_suspect_[i] && touches(sweeps_[i], octant) &&
            touches(swept(space.shape(), points_[i], points_[i + 1]), octant))
          is_suspect_[i] = true;
    });
  }

  std::vector<vec3> points_;
  detail::map_follower follower_;
  std::vector<bool> is_suspect_;  ///< true for segments that are not known to be free
  std::vector<octree::bounding_box> sweeps_;
  std::size_t tested_ = 0;
};

/// Maintains a path to a goal while the map changes and the robot moves. It plans once, and replans from the robot's
/// position only if the rest of the path is blocked. While there is no path, it tries again whenever the map has
/// changed or the robot has moved; for a user-defined map without a log, at every update.
class replanner {
 public:
  /// Sets the goal, in metres.
  explicit replanner(const vec3& goal, const path_options& options = {}) : goal_{goal}, options_{options} {}

  /// The path from `position` (metres) to the goal, as found by find_path: the previous path without the part already
  /// passed, or a new one; on a floor, at the floor's current height. Valid until the next call. @pre same as for
  /// path_monitor::first_blocked
  template <planning_space Space>
  const found_path& update(const Space& space, const vec3& position) {
    if (path_.status == path_status::found && planned_ != 0) {
      monitor_.advance(space.on_ground(position));
      if (!monitor_.first_blocked(space)) {
        path_.points = monitor_.points();
        for (vec3& p : path_.points) p = space.on_ground(p);
        path_.length = path_length(path_.points);
        path_.cost = path_cost(space, path_.points);
        return path_;
      }
    } else if (planned_ != 0 && position == position_ && !has_changed(space)) {
      return path_;
    }
    path_ = find_path(space, position, goal_, options_);
    monitor_ = {space, path_.points};
    see(space);
    position_ = position;
    ++planned_;
    return path_;
  }
  /// Number of path searches so far.
  [[nodiscard]] std::size_t planned() const noexcept { return planned_; }
  [[nodiscard]] const found_path& path() const noexcept { return path_; }
  [[nodiscard]] const vec3& goal() const noexcept { return goal_; }

 private:
  /// Obstacles on a floor, with the map's origin and resolution.
  struct floor_obstacles {
    double resolution = 0.0;
    vec2 origin = zeros<vec2>();
    image<float> squared{};
    friend bool operator==(const floor_obstacles&, const floor_obstacles&) = default;
  };
  [[nodiscard]] static floor_obstacles make_obstacles(const floor_view& floor) {
    return {floor.resolution(), floor.map().origin, floor.squared_distances()};
  }
  /// Returns true if the map may have changed since the last path search.
  template <class Space>
  [[nodiscard]] bool has_changed(const Space& space) {
    bool changed = true;
    if constexpr (detail::follows_changes<Space>) {
      changed = false;
      tried_.follow(
          space.map(), [&](const octree::change_log&, std::uint64_t) { changed = true; }, [&] { changed = true; });
    } else if constexpr (std::derived_from<Space, floor_view>) {
      changed = !(make_obstacles(space) == tried_floor_);
    }
    return changed;
  }
  template <class Space>
  void see(const Space& space) {
    if constexpr (detail::follows_changes<Space>)
      tried_.mark_read(space.map());
    else if constexpr (std::derived_from<Space, floor_view>)
      tried_floor_ = path_.status == path_status::found ? floor_obstacles{} : make_obstacles(space);
  }

  vec3 goal_;
  path_options options_;
  found_path path_;
  path_monitor monitor_;
  detail::map_follower tried_;
  floor_obstacles tried_floor_;
  vec3 position_ = zeros<vec3>();
  std::size_t planned_ = 0;
};

}  // namespace orbis::nav
