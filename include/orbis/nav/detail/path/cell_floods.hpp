// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Connectivity test for free cells.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav::detail {

/// Tests whether cells are connected to the robot's start cells by a chain of free cells that are 26-neighbours (on a
/// floor, 8-neighbours) of each other. A search over cells cannot reach unconnected cells. Connected cells are not
/// always reachable, because a step between two free cells may be blocked.
///
/// Alternates between two floods, from the start and from the other cell, each growing towards the origin of the other,
/// until they meet or one runs out of cells. Detecting that either side is enclosed is therefore cheap, regardless of
/// the size of the other side.
template <class Space>
class cell_floods {
 public:
  using key = octree::voxel_key;

  /// `doors`: the start cells. @pre `goal` is finite
  cell_floods(const Space& space, const vec3& start, const std::vector<key>& doors, const vec3& goal)
      : space_{space}, start_{start}, goal_{space.clamped(goal)} {
    for (const key& k : doors) begin(k, mark::near);
  }

  /// Returns true if the free cell `k` is connected to the start, or if that is undecided after each flood has examined
  /// `max_cells` cells. Results of earlier calls are reused.
  [[nodiscard]] bool may_reach(const key& k, std::size_t max_cells) {
    far_.clear();
    seen_far_.clear();
    bool is_met = begin(k, mark::far);
    for (std::size_t n = 0; !is_met && n != max_cells && !far_.empty() && !near_.empty(); ++n)
      is_met = grow(far_, mark::far) || grow(near_, mark::near);
    if (is_met) {
      for (const entry& e : far_) push(e.cell, mark::near);
      for (const key& seen : seen_far_) mark_at(seen) = mark::near, update_nearest(seen);
      return true;
    }
    if (far_.empty() || near_.empty()) return false;
    for (const key& seen : seen_far_) mark_at(seen) = mark::free;
    return true;
  }
  /// Returns true if `may_reach` is true for one of the cells.
  [[nodiscard]] bool may_reach_any(const std::vector<key>& cells, std::size_t max_cells) {
    return std::any_of(cells.begin(), cells.end(), [&](const key& k) { return may_reach(k, max_cells); });
  }
  /// Returns the cell nearest to the goal that is connected to the start; empty if there are no doors. Each flood
  /// examines at most `max_cells` cells. Free cells are tried in order of their distance from the goal, up to about
  /// 10^6 cells around it; if none of them is connected, the result is the nearest cell that the flood from the start
  /// has reached.
  [[nodiscard]] std::optional<key> nearest(std::size_t max_cells) {
    // Visit cells around the goal in order of distance, as long as there are fewer of them than cells in a flood.
    constexpr double most = std::size_t{1} << 20U;
    std::array<std::int64_t, 3> middle{};
    const vec3 from_first = (goal_ - space_.center(key{})) / space_.resolution();
    for (std::size_t i = 0; i != 3; ++i)
      middle[i] = std::max<std::int64_t>(0, std::llround(from_first[static_cast<Eigen::Index>(i)]));
    std::vector<std::pair<double, key>> open;
    const auto is_later = [](const auto& a, const auto& b) { return a.first > b.first; };
    for (std::int64_t r = 0; std::pow(static_cast<double>(2 * r + 1), Space::dimensions) <= most; ++r) {
      for_each_in_shell(middle, r, [&](const key& k) {
        if (!is_free(k)) return;
        open.emplace_back(squared_norm(space_.center(k) - goal_), k);
        std::push_heap(open.begin(), open.end(), is_later);
      });
      const double seen = (static_cast<double>(r) + 0.499) * space_.resolution();
      for (; !open.empty() && open.front().first <= seen * seen; open.pop_back()) {
        const key k = open.front().second;
        if (mark_at(k) == mark::near || (mark_at(k) != mark::far && may_reach(k, max_cells))) return k;
        if (near_.empty()) return nearest_;
        std::pop_heap(open.begin(), open.end(), is_later);
      }
    }
    for (std::size_t n = 0; n != max_cells && !near_.empty(); ++n) static_cast<void>(grow(near_, mark::near));
    return nearest_;
  }

 private:
  enum class mark : std::uint8_t { none, blocked, free, near, far };
  struct entry {
    double away;
    key cell;
    friend bool operator<(const entry& a, const entry& b) noexcept { return a.away > b.away; }
  };
  static constexpr bool is_flat = Space::dimensions == 2;
  static constexpr std::uint32_t brick_bits = is_flat ? 6 : 9;
  using brick = std::array<mark, std::size_t{1} << brick_bits>;

  [[nodiscard]] mark& mark_at(const key& k) {
    const std::uint64_t name = octree::morton_code(k) >> 9U;
    if (name != last_name_) {
      std::uint32_t i = index_.find(name);
      if (i == hash_index::none) {
        i = static_cast<std::uint32_t>(bricks_.size());
        index_.set(name, i);
        bricks_.push_back(std::make_unique<brick>());
      }
      last_name_ = name;
      last_brick_ = bricks_[i].get();
    }
    return (*last_brick_)[(is_flat ? 0U : (k.z & 7U) << 6U) | (k.y & 7U) << 3U | (k.x & 7U)];
  }
  /// @pre in the space
  [[nodiscard]] bool is_free(const key& k) {
    mark& m = mark_at(k);
    if (m == mark::none) m = space_.is_free(k) ? mark::free : mark::blocked;
    return m != mark::blocked;
  }
  /// Like `add`. @pre `k` is in the space and free
  bool begin(const key& k, mark which) {
    if (mark_at(k) <= mark::free) mark_at(k) = mark::free;
    return add(k, which);
  }
  /// Adds a cell to a flood unless it is already in a flood. Returns true if it is in the other flood.
  bool add(const key& k, mark which) {
    if (!space_.contains(k) || !is_free(k)) return false;
    mark& m = mark_at(k);
    if (m != mark::free) return m != which;
    m = which;
    if (which == mark::near)
      update_nearest(k);
    else
      seen_far_.push_back(k);
    push(k, which);
    return false;
  }
  void push(const key& k, mark which) {
    auto& flood = which == mark::near ? near_ : far_;
    flood.push_back({squared_norm(space_.center(k) - (which == mark::near ? goal_ : start_)), k});
    std::push_heap(flood.begin(), flood.end());
  }
  /// Makes `k`, a cell connected to the start, the nearest cell if it is nearer to the goal.
  void update_nearest(const key& k) {
    if (const double away = squared_norm(space_.center(k) - goal_); away < nearest_away_)
      nearest_away_ = away, nearest_ = k;
  }
  /// Adds the neighbours of one more cell to a flood. Returns true if the floods meet at one of them. @pre flood is not
  /// empty
  bool grow(std::vector<entry>& flood, mark which) {
    std::pop_heap(flood.begin(), flood.end());
    const key k = flood.back().cell;
    flood.pop_back();
    bool is_met = false;
    for (unsigned d = is_flat ? 9 : 0; d != (is_flat ? 18U : 27U); ++d)
      is_met = add({k.x + d % 3 - 1, k.y + d / 3 % 3 - 1, k.z + d / 9 - 1}, which) || is_met;
    return is_met;
  }
  /// Calls visit(k) for the cells of the space at Chebyshev distance `r` from `middle`.
  template <class Visit>
  void for_each_in_shell(const std::array<std::int64_t, 3>& middle, std::int64_t r, Visit&& visit) const {
    const auto visit_if_inside = [&](std::int64_t x, std::int64_t y, std::int64_t z) {
      const std::int64_t u = middle[0] + x, v = middle[1] + y, w = middle[2] + z;
      constexpr std::int64_t end = std::int64_t{1} << octree::max_tree_depth;
      if (std::min({u, v, w}) < 0 || std::max({u, v, w}) >= end) return;
      const key k{static_cast<std::uint32_t>(u), static_cast<std::uint32_t>(v), static_cast<std::uint32_t>(w)};
      if (space_.contains(k)) visit(k);
    };
    const std::int64_t high = is_flat ? 0 : r;
    for (std::int64_t z = -high; z <= high; ++z)
      for (std::int64_t y = -r; y <= r; ++y) {
        const bool is_face = std::abs(y) == r || (!is_flat && std::abs(z) == r);
        for (std::int64_t x = -r; x <= r; x += is_face || r == 0 ? 1 : 2 * r) visit_if_inside(x, y, z);
      }
  }

  const Space& space_;
  vec3 start_, goal_;
  std::vector<entry> near_{}, far_{};  ///< cells of each flood whose neighbours have not been visited
  std::vector<key> seen_far_{};        ///< all cells of the flood that does not begin at the start
  std::vector<std::unique_ptr<brick>> bricks_{};
  hash_index index_{};
  std::uint64_t last_name_ = ~std::uint64_t{0};
  brick* last_brick_ = nullptr;
  std::optional<key> nearest_{};  ///< the cell of the flood from the start that is nearest to the goal
  double nearest_away_ = std::numeric_limits<double>::infinity();
};

}  // namespace orbis::nav::detail
