// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Paths while the map changes: whether a change touches the path, and a new path only then.
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
/// On a floor the same with a `floor_view` of the new floor map each time.
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
/// A view of a map that records its changes, for a robot of a shape.
template <class Space>
concept follows_changes = requires(const Space& space) {
  requires has_change_log<std::remove_cvref_t<decltype(space.map())>>;
  requires robot_shape<std::remove_cvref_t<decltype(space.shape())>>;
  { space.grid() } -> std::convertible_to<const octree::voxel_grid&>;
};
}  // namespace detail

/// Watches whether a path stays free while the map changes. By the map's change log it looks only at what has changed:
/// the segments along which the robot sweeps over an octant (4x4x4 voxels) with a change are tested again, exactly. If
/// the log does not know, all are, as on floors and on maps that have no log. Obstacles that vanish elsewhere are not
/// its business: a shorter way that opens is not seen.
class path_monitor {
 public:
  /// Watches nothing.
  path_monitor() = default;
  /// @pre `points` is free in the map as `space` has it: each of its segments
  template <planning_space Space>
  path_monitor(const Space& space, std::vector<vec3> points) : points_{std::move(points)} {
    if constexpr (detail::follows_changes<Space>) follower_.see(space.map());
  }

  /// The first segment that is not free any more (that from points()[i] to points()[i + 1]), since the path was given
  /// or last checked. Once one is blocked, it is tested each time. O(changed octants x segments), few operations for
  /// each, and what `is_free` costs for the segments that are tested.
  /// @pre the same map every time (of floors: one of the same world), and a view of it as it is
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
  /// How many segments the last call of first_blocked tested.
  [[nodiscard]] std::size_t tested() const noexcept { return tested_; }
  [[nodiscard]] const std::vector<vec3>& points() const noexcept { return points_; }

  /// The robot is at `position` (metres): what lies behind it on the path is not watched any more, and the path begins
  /// with `position` now. The way from there to the next point is tested again, unless `position` is the path's point.
  void advance(const vec3& position) {
    if (points_.size() < 2 || position == points_.front()) return;
    is_suspect_.resize(points_.size() - 1);
    // The nearest place on the path; of equal ones, the first.
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
  /// Marks the segments along which the robot sweeps over an octant that has changed.
  template <class Space>
  void suspect(const Space& space, const octree::change_log& log, std::uint64_t since) {
    sweeps_.clear();
    for (std::size_t i = 0; i != is_suspect_.size(); ++i)
      sweeps_.push_back(bounds_of(swept(space.shape(), points_[i], points_[i + 1])));
    log.for_each_since(since, [&](const octree::voxel_key& k, std::uint64_t) {
      const octree::bounding_box octant = octree::cube_of(space.grid(), k, 2);
      for (std::size_t i = 0; i != is_suspect_.size(); ++i)
        if (!is_suspect_[i] && touches(sweeps_[i], octant) &&
            touches(swept(space.shape(), points_[i], points_[i + 1]), octant))
          is_suspect_[i] = true;
    });
  }

  std::vector<vec3> points_;
  detail::map_follower follower_;
  std::vector<bool> is_suspect_;  ///< segments that changes touch and that are not known to be free
  std::vector<octree::bounding_box> sweeps_;
  std::size_t tested_ = 0;
};

/// Keeps a path to a goal while the map changes and the robot goes. It plans once, and again only when what is left of
/// the path is blocked, from where the robot is then. While there is no path, it tries again whenever the map has
/// changed or the robot has moved; of a map that is not ours and has no log, that is each time.
class replanner {
 public:
  /// `goal`: metres.
  explicit replanner(const vec3& goal, const path_options& options = {}) : goal_{goal}, options_{options} {}

  /// The path from `position` (metres) to the goal, as find_path has it: the one there was, without what lies behind,
  /// or a new one; on a floor at its present height. Valid until the next call.
  /// @pre those of path_monitor::first_blocked
  template <planning_space Space>
  const found_path& update(const Space& space, const vec3& position) {
    if (path_.status == path_status::found && planned_ != 0) {
      monitor_.advance(space.on_ground(position));
      if (!monitor_.first_blocked(space)) {
        path_.points = monitor_.points();
        for (vec3& p : path_.points) p = space.on_ground(p);
        path_.length = length_of(path_.points);
        path_.cost = cost_of(space, path_.points);
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
  /// How many times it has looked for a path.
  [[nodiscard]] std::size_t planned() const noexcept { return planned_; }
  [[nodiscard]] const found_path& path() const noexcept { return path_; }
  [[nodiscard]] const vec3& goal() const noexcept { return goal_; }

 private:
  /// What is an obstacle on a floor, and where.
  struct floor_obstacles {
    double resolution = 0.0;
    vec2 origin = zeros<vec2>();
    image<float> squared{};
    friend bool operator==(const floor_obstacles&, const floor_obstacles&) = default;
  };
  [[nodiscard]] static floor_obstacles obstacles_of(const floor_view& floor) {
    return {floor.resolution(), floor.map().origin, floor.squared_distances()};
  }
  /// Whether the map may be another than when a path was looked for last.
  template <class Space>
  [[nodiscard]] bool has_changed(const Space& space) {
    bool changed = true;
    if constexpr (detail::follows_changes<Space>) {
      changed = false;
      tried_.follow(
          space.map(), [&](const octree::change_log&, std::uint64_t) { changed = true; }, [&] { changed = true; });
    } else if constexpr (std::derived_from<Space, floor_view>) {
      changed = !(obstacles_of(space) == tried_floor_);
    }
    return changed;
  }
  template <class Space>
  void see(const Space& space) {
    if constexpr (detail::follows_changes<Space>)
      tried_.see(space.map());
    else if constexpr (std::derived_from<Space, floor_view>)
      tried_floor_ = path_.status == path_status::found ? floor_obstacles{} : obstacles_of(space);
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
