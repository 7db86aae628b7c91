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
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/nav/detail/map_follower.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/overlap.hpp>

namespace orbis::nav {

/// Watches whether a path stays free while the map changes. By the map's change log it looks only at what has changed:
/// the segments along which the robot sweeps over an octant (4x4x4 voxels) with a change are tested again, exactly. If
/// the log does not know, all are. Obstacles that vanish elsewhere are not its business: a shorter way that opens is
/// not seen.
class path_monitor {
 public:
  /// Watches nothing.
  path_monitor() = default;
  /// @pre `points` is free in the map as `view` has it: each of its segments
  template <planning_map Map, robot_shape Shape>
  path_monitor(const planning_view<Map, Shape>& view, std::vector<vec3> points) : points_{std::move(points)} {
    follower_.see(view.map());
  }

  /// The first segment that is not free any more (that from points()[i] to points()[i + 1]), since the path was given
  /// or last checked. Once one is blocked, it is tested each time. O(changed octants x segments), few operations for
  /// each, and what `is_free` costs for the segments that are tested.
  /// @pre the same map every time, and a view of it as it is
  template <planning_map Map, robot_shape Shape>
  [[nodiscard]] std::optional<std::size_t> first_blocked(const planning_view<Map, Shape>& view) {
    const std::size_t segments = points_.empty() ? 0 : points_.size() - 1;
    is_suspect_.resize(segments);
    follower_.follow(
        view.map(),
        [&](const octree::change_log& log, std::uint64_t since) {
          sweeps_.clear();
          for (std::size_t i = 0; i != segments; ++i)
            sweeps_.push_back(bounds_of(swept(view.shape(), points_[i], points_[i + 1])));
          log.for_each_since(since, [&](const octree::voxel_key& k, std::uint64_t) {
            const octree::bounding_box octant = octree::cube_of(view.grid(), k, 2);
            for (std::size_t i = 0; i != segments; ++i)
              if (!is_suspect_[i] && touches(sweeps_[i], octant) &&
                  touches(swept(view.shape(), points_[i], points_[i + 1]), octant))
                is_suspect_[i] = true;
          });
        },
        [&] { is_suspect_.assign(segments, true); });
    tested_ = 0;
    for (std::size_t i = 0; i != segments; ++i) {
      if (!is_suspect_[i]) continue;
      ++tested_;
      if (!view.is_free(points_[i], points_[i + 1])) return i;
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
      const double squared = along.squaredNorm();
      const double t = squared > 0.0 ? std::clamp((position - points_[i]).dot(along) / squared, 0.0, 1.0) : 0.0;
      const double away = (points_[i] + t * along - position).squaredNorm();
      if (least < 0.0 || away < least) least = away, nearest = i;
    }
    const auto passed = static_cast<std::ptrdiff_t>(nearest);
    points_.erase(points_.begin(), points_.begin() + passed);
    is_suspect_.erase(is_suspect_.begin(), is_suspect_.begin() + passed);
    points_.front() = position;
    is_suspect_.front() = true;
  }

 private:
  std::vector<vec3> points_;
  detail::map_follower follower_;
  std::vector<bool> is_suspect_;  ///< segments that changes touch and that are not known to be free
  std::vector<octree::bounding_box> sweeps_;
  std::size_t tested_ = 0;
};

/// Keeps a path to a goal while the map changes and the robot goes. It plans once, and again only when what is left of
/// the path is blocked, from where the robot is then. While there is no path, it tries again whenever the map has
/// changed or the robot has moved.
class replanner {
 public:
  /// `goal`: metres.
  explicit replanner(const vec3& goal, const path_options& options = {}) : goal_{goal}, options_{options} {}

  /// The path from `position` (metres) to the goal, as find_path has it: the one there was, without what lies behind,
  /// or a new one. Valid until the next call. @pre those of path_monitor::first_blocked
  template <planning_map Map, robot_shape Shape>
  const found_path& update(const planning_view<Map, Shape>& view, const vec3& position) {
    if (path_.status == path_status::found && planned_ != 0) {
      monitor_.advance(position);
      if (!monitor_.first_blocked(view)) {
        path_.points = monitor_.points();
        path_.length = length_of(path_.points);
        path_.cost = cost_of(view, path_.points);
        return path_;
      }
    } else if (planned_ != 0 && position == position_) {
      bool changed = false;
      tried_.follow(
          view.map(), [&](const octree::change_log&, std::uint64_t) { changed = true; }, [&] { changed = true; });
      if (!changed) return path_;
    }
    path_ = find_path(view, position, goal_, options_);
    monitor_ = {view, path_.points};
    tried_.see(view.map());
    position_ = position;
    ++planned_;
    return path_;
  }
  /// How many times it has looked for a path.
  [[nodiscard]] std::size_t planned() const noexcept { return planned_; }
  [[nodiscard]] const found_path& path() const noexcept { return path_; }
  [[nodiscard]] const vec3& goal() const noexcept { return goal_; }

 private:
  vec3 goal_;
  path_options options_;
  found_path path_;
  path_monitor monitor_;
  detail::map_follower tried_;
  vec3 position_ = vec3::Zero();
  std::size_t planned_ = 0;
};

}  // namespace orbis::nav
