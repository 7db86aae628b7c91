// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Shortest ways over the middles of voxels.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav::detail {

enum class search_end : std::uint8_t {
  found,
  exhausted,  ///< all that can be reached has been looked at
  stopped     ///< at the limit
};

/// A* over the middles of voxels, with steps to the 26 neighbours. P. Hart, N. Nilsson, B. Raphael, "A formal basis for
/// the heuristic determination of minimum cost paths", IEEE Transactions on Systems Science and Cybernetics 4(2), 1968.
template <class View>
class voxel_search {
 public:
  using key = octree::voxel_key;

  voxel_search(const View& view, std::size_t max_expanded)
      : view_{view}, grid_{view.field().grid()}, max_expanded_{max_expanded} {}

  /// The middles of voxels to which there is a free straight way from `p`: that of its own, or else of its neighbours.
  [[nodiscard]] std::vector<key> doors(const vec3& p) const {
    const key own = *grid_.key(p);
    if (view_.is_free(p, grid_.center(own))) return {own};
    std::vector<key> found;
    for_each_neighbor(own, [&](const key& k, int) {
      if (view_.is_free(p, grid_.center(k))) found.push_back(k);
    });
    return found;
  }

  /// Looks for the shortest way from `start` to `goal` through one of the voxels `exits` (see doors). Without any, it
  /// looks at all that can be reached.
  [[nodiscard]] search_end run(const vec3& start, const vec3& goal, const std::vector<key>& exits) {
    const double half = 0.5 * grid_.resolution();
    const vec3 lowest = vec3::Constant(grid_.center(0U) - half);
    const vec3 highest = vec3::Constant(grid_.center(grid_.cells() - 1) + half);
    goal_ = goal.cwiseMax(lowest).cwiseMin(highest);  // outside, the nearest point of the grid stands for it
    exits_ = exits;
    for (const key& k : doors(start)) offer(k, (grid_.center(k) - start).norm(), from_start);
    double best = std::numeric_limits<double>::infinity();  // through the exits so far
    while (!open_.empty()) {
      std::pop_heap(open_.begin(), open_.end());
      const entry e = open_.back();
      open_.pop_back();
      if (e.total >= best) break;
      const double cost = at(e.at).cost;
      if (at(e.at).closed) continue;
      if (expanded_ == max_expanded_) return last_ ? search_end::found : search_end::stopped;
      at(e.at).closed = true;
      ++expanded_;
      const double away = (grid_.center(e.at) - goal_).squaredNorm();
      if (away < nearest_away_) nearest_away_ = away, nearest_ = e.at;
      for (const key& exit : exits_)
        if (const double all = cost + (grid_.center(exit) - goal_).norm(); exit == e.at && all < best)
          best = all, last_ = exit;
      for_each_neighbor(e.at, [&](const key& k, int direction) {
        const double step = step_length(direction);
        if (const node& n = at(k); n.closed || cost + step >= n.cost) return;
        if (is_passable(e.at, k)) offer(k, cost + step, direction);
      });
    }
    return last_ ? search_end::found : search_end::exhausted;
  }
  [[nodiscard]] std::size_t expanded() const noexcept { return expanded_; }
  /// Middles of voxels, from the start's to the last one before the goal or to the one nearest to it.
  [[nodiscard]] std::vector<vec3> way() {
    std::vector<vec3> points;
    const std::optional<key> end = last_ ? last_ : nearest_;
    if (!end) return points;
    for (key k = *end;;) {
      points.push_back(grid_.center(k));
      const int direction = at(k).direction;
      if (direction == from_start) break;
      const auto [x, y, z] = offset(direction);
      k = {k.x - static_cast<std::uint32_t>(x), k.y - static_cast<std::uint32_t>(y),
           k.z - static_cast<std::uint32_t>(z)};
    }
    std::reverse(points.begin(), points.end());
    return points;
  }

 private:
  static constexpr int from_start = 13;  ///< the direction of no step

  struct node {
    double cost = std::numeric_limits<double>::infinity();
    std::int8_t direction = from_start;  ///< of the step that leads here
    std::uint8_t free = 0;               ///< 0: not asked, 1: no, 2: yes
    bool closed = false;
  };
  struct entry {
    double total;
    key at;
    friend bool operator<(const entry& a, const entry& b) noexcept { return a.total > b.total; }
  };
  using brick = std::array<node, 512>;

  [[nodiscard]] static std::array<int, 3> offset(int direction) noexcept {
    return {direction % 3 - 1, direction / 3 % 3 - 1, direction / 9 - 1};
  }
  [[nodiscard]] double step_length(int direction) const noexcept {
    static const std::array<double, 4> lengths{0.0, 1.0, std::sqrt(2.0), std::sqrt(3.0)};
    const auto [x, y, z] = offset(direction);
    return grid_.resolution() * lengths[static_cast<std::size_t>(x * x + y * y + z * z)];
  }
  template <class Visit>
  void for_each_neighbor(const key& k, Visit&& visit) const {
    for (int direction = 0; direction != 27; ++direction) {
      if (direction == from_start) continue;
      const auto [x, y, z] = offset(direction);
      const key n{k.x + static_cast<std::uint32_t>(x), k.y + static_cast<std::uint32_t>(y),
                  k.z + static_cast<std::uint32_t>(z)};
      if (std::max({n.x, n.y, n.z}) < grid_.cells()) visit(n, direction);
    }
  }
  [[nodiscard]] node& at(const key& k) {
    const std::uint64_t name = octree::morton_code(k) >> 9U;
    if (name != last_name_) {
      last_name_ = name;
      last_brick_ = index_.find(name);
      if (last_brick_ == hash_index::none) {
        last_brick_ = static_cast<std::uint32_t>(bricks_.size());
        index_.set(name, last_brick_);
        bricks_.emplace_back();
      }
    }
    return bricks_[last_brick_][(k.z & 7U) << 6U | (k.y & 7U) << 3U | (k.x & 7U)];
  }
  [[nodiscard]] bool is_free(const key& k) {
    node& n = at(k);
    if (n.free == 0) n.free = view_.is_free(k) ? 2 : 1;
    return n.free == 2;
  }
  [[nodiscard]] bool is_passable(const key& a, const key& b) {
    return is_free(b) && view_.is_free(grid_.center(a), grid_.center(b));
  }
  /// The length of the shortest way in steps to 26 neighbours where nothing is in between; `d`: along the axes, metres.
  [[nodiscard]] static double length_in_steps(std::array<double, 3> d) {
    std::sort(d.begin(), d.end());
    return std::sqrt(3.0) * d[0] + std::sqrt(2.0) * (d[1] - d[0]) + (d[2] - d[1]);
  }
  /// No way on the grid is shorter, to an exit and from there to the goal; without exits, to where the goal is.
  [[nodiscard]] double ahead(const key& k) const noexcept {
    if (exits_.empty()) {
      const vec3 d = (grid_.center(k) - goal_).cwiseAbs();
      return length_in_steps({d.x(), d.y(), d.z()});
    }
    double least = std::numeric_limits<double>::infinity();
    for (const key& exit : exits_) {
      const auto along = [&](std::uint32_t a, std::uint32_t b) { return grid_.resolution() * (a > b ? a - b : b - a); };
      least = std::min(least, length_in_steps({along(k.x, exit.x), along(k.y, exit.y), along(k.z, exit.z)}) +
                                  (grid_.center(exit) - goal_).norm());
    }
    return least;
  }
  void offer(const key& k, double cost, int direction) {
    node& n = at(k);
    if (cost >= n.cost) return;
    n.cost = cost;
    n.direction = static_cast<std::int8_t>(direction);
    open_.push_back({cost + ahead(k), k});
    std::push_heap(open_.begin(), open_.end());
  }

  const View& view_;
  const octree::voxel_grid& grid_;
  std::size_t max_expanded_;
  vec3 goal_ = vec3::Zero();
  std::vector<key> exits_;
  std::vector<entry> open_;
  std::deque<brick> bricks_;
  hash_index index_;
  std::uint64_t last_name_ = ~std::uint64_t{0};
  std::uint32_t last_brick_ = 0;
  std::size_t expanded_ = 0;
  std::optional<key> last_, nearest_;
  double nearest_away_ = std::numeric_limits<double>::infinity();
};

}  // namespace orbis::nav::detail
