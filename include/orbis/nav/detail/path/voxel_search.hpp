// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Cheapest paths over cell centres.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/core/types.hpp>
#include <orbis/nav/detail/path/segments.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::nav::detail {

enum class search_end : std::uint8_t {
  found,
  exhausted,  ///< all reachable cells have been expanded
  stopped     ///< stopped at the limit
};

/// Length of the shortest path in steps along axes and diagonals without obstacles; `d`: vector from one end to the
/// other, metres. The length is a metric.
[[nodiscard]] inline double length_in_steps(const vec3& d) noexcept {
  std::array<double, 3> s{std::abs(d.x()), std::abs(d.y()), std::abs(d.z())};
  std::sort(s.begin(), s.end());
  return 1.73205080756887729 * s[0] + 1.41421356237309505 * (s[1] - s[0]) + (s[2] - s[1]);
}

/// Search for the cheapest path between two points over cell centres, with steps to all 26 (on a floor, 8) neighbours.
///
/// - On the grid: A*, P. Hart, N. Nilsson, B. Raphael, "A formal basis for the heuristic determination of minimum cost
///   paths", IEEE Transactions on Systems Science and Cybernetics 4(2), 1968. The result is optimal on the grid.
/// - At any angle: lazy Theta*, A. Nash, S. Koenig, C. Tovey, "Lazy Theta*: any-angle path planning and path length
///   analysis in 3D", AAAI 2010. A cell is first connected to its predecessor's parent, as if the straight line
///   between them were free.
///
/// Both methods test whether a step is possible, and compute the cost of a line, only when the cell is expanded; until
/// then, costs are lower bounds. A cell whose cost increases is put back into the queue. (Lazy evaluation of edges, as
/// in C. Dellin, S. Srinivasa, "A unifying formalism for shortest path problems with expensive edge evaluations via
/// lazy best-first search over paths with edge selectors", ICAPS 2016.)
///
/// The heuristic is the length of the remaining path without obstacles, in steps or along a straight line. It is
/// admissible, because no path costs less than its length, and consistent, because it is a metric. At any angle, where
/// the optimum is not guaranteed anyway, it may have a weight greater than 1 (I. Pohl, "First results on the effect of
/// error in heuristic search", Machine Intelligence 5, 1970).
template <class Space>
class voxel_search {
 public:
  using key = octree::voxel_key;

  /// `weight`: weight of the heuristic at any angle, >= 1.
  explicit voxel_search(const Space& space, bool any_angle = false, double weight = 1.0)
      : space_{space}, any_angle_{any_angle}, is_uniform_{space.is_uniform()}, weight_{any_angle ? weight : 1.0} {}

  /// The cells at which a path from `p` may begin: the cell of `p` if the straight segment from `p` to its centre is
  /// free, otherwise the neighbours of that cell for which the corresponding segment is free. @pre `p` lies in the
  /// space
  [[nodiscard]] std::vector<key> doors(const vec3& p) const {
    const key own = *space_.key(p);
    const auto is_door = [&](const key& k) { return space_.contains(k) && space_.is_free(p, space_.center(k)); };
    if (is_door(own)) return {own};
    std::vector<key> found;
    for_each_direction([&](unsigned direction) {
      if (const key k = neighbor(own, direction); is_door(k)) found.push_back(k);
    });
    return found;
  }

  /// Searches for the cheapest path from `start` to `goal` through one of the cells `exits` (see doors), expanding at
  /// most `max_expanded` cells. Without exits, it expands all reachable cells. Call it once.
  [[nodiscard]] search_end run(const vec3& start, const vec3& goal, const std::vector<key>& exits,
                               std::size_t max_expanded) {
    places_ = {start, goal};
    goal_ = space_.clamped(goal);  // a goal outside is replaced by the nearest point of the grid
    exits_ = exits;
    for (const key& exit : exits_) exit_costs_.push_back(segment_cost(space_, space_.center(exit), goal));
    doors_ = doors(start);
    ends_[0].cost = 0.0;
    ends_[0].is_closed = true;
    for (const key& k : doors_) {
      const std::uint32_t n = find_or_add(k);
      offer(n, from, segment_cost(space_, start, space_.center(k)), trust::sure);
    }
    return resume(max_expanded);
  }
  /// Resumes a stopped search, with a limit on the total number of expanded cells.
  [[nodiscard]] search_end resume(std::size_t max_expanded) {
    while (!open_.empty()) {
      std::pop_heap(open_.begin(), open_.end());
      const entry e = open_.back();
      open_.pop_back();
      if (at(e.number).is_closed || at(e.number).cost != e.cost) continue;  // superseded by a later offer
      if (!confirm_cost(e.number)) continue;
      if (e.number != to && expanded_ >= max_expanded) {
        open_.push_back(e);
        std::push_heap(open_.begin(), open_.end());
        return search_end::stopped;
      }
      at(e.number).is_closed = true;
      if (e.number == to) return search_end::found;
      ++expanded_;
      expand(e.number);
    }
    return search_end::exhausted;
  }
  [[nodiscard]] std::size_t expanded() const noexcept { return expanded_; }
  /// Cost of the path that was found.
  [[nodiscard]] double cost() const noexcept { return ends_[1].cost; }
  /// The path from the start to the goal or, if the goal was not reached, to the centre of the nearest reached cell.
  /// Consecutive points differ.
  [[nodiscard]] std::vector<vec3> path() {
    std::vector<vec3> points;
    const auto add = [&](const vec3& p) {
      if (points.empty() || p != points.back()) points.push_back(p);
    };
    for (std::uint32_t n = ends_[1].is_closed ? to : nearest_; n != from; n = at(n).parent) add(position(n));
    add(places_[0]);
    std::reverse(points.begin(), points.end());
    return points;
  }

 private:
  static constexpr double infinity = std::numeric_limits<double>::infinity();
  static constexpr bool is_flat = Space::dimensions == 2;
  static constexpr std::uint32_t brick_bits = is_flat ? 6 : 9;  ///< bits of an index in a brick (8x8 or 8x8x8 cells)
  static constexpr std::uint32_t from = ~std::uint32_t{1}, to = ~std::uint32_t{0};  ///< indices of start and goal

  /// Certainty of a cell's cost.
  enum class trust : std::uint8_t {
    bound,  ///< a lower bound on the cost from the parent
    exact,  ///< the cost if the segment is free
    sure    ///< the segment is free
  };
  struct node {
    double cost = infinity;
    double density = 0.0;  ///< 0: not computed
    std::uint32_t parent = from;
    std::uint32_t tried = to;  ///< the last parent whose line to this cell was blocked or cost more than expected
    std::uint32_t barred = 0;  ///< bit mask of neighbours (for the goal: exits) whose step to this cell is blocked
    std::uint8_t free = 0;     ///< 0: not tested, 1: no, 2: yes
    trust known = trust::bound;
    bool is_closed = false;
  };
  struct entry {
    double total, cost;
    std::uint32_t number;
    friend bool operator<(const entry& a, const entry& b) noexcept { return a.total > b.total; }
  };
  using brick = std::array<node, std::size_t{1} << brick_bits>;

  // -- cells and their neighbours

  template <class Visit>
  static void for_each_direction(Visit&& visit) {
    for (unsigned d = is_flat ? 9 : 0; d != (is_flat ? 18U : 27U); ++d)
      if (d != 13) visit(d);
  }
  [[nodiscard]] static key neighbor(const key& k, unsigned direction) noexcept {
    return {k.x + direction % 3 - 1, k.y + direction / 3 % 3 - 1, k.z + direction / 9 - 1};
  }
  [[nodiscard]] double step_length(unsigned direction) const noexcept {
    static constexpr std::array<double, 4> lengths{0.0, 1.0, 1.41421356237309505, 1.73205080756887729};
    const auto is_along = [](unsigned part) { return part != 1 ? 1U : 0U; };
    const unsigned axes = is_along(direction % 3) + is_along(direction / 3 % 3) + is_along(direction / 9);
    return space_.resolution() * lengths[axes];
  }
  [[nodiscard]] std::uint32_t find_or_add(const key& k) {
    const std::uint64_t name = octree::morton_code(k) >> 9U;
    if (name != last_name_) {
      last_name_ = name;
      last_brick_ = index_.find(name);
      if (last_brick_ == hash_index::none) {
        last_brick_ = static_cast<std::uint32_t>(bricks_.size());
        index_.set(name, last_brick_);
        bricks_.push_back(std::make_unique<brick>());
        corners_.push_back(octree::node_key(k, 3));
      }
    }
    return last_brick_ << brick_bits | (is_flat ? 0U : (k.z & 7U) << 6U) | (k.y & 7U) << 3U | (k.x & 7U);
  }
  [[nodiscard]] key cell_key(std::uint32_t number) const {
    const key& low = corners_[number >> brick_bits];
    return {low.x + (number & 7U), low.y + (number >> 3U & 7U), is_flat ? low.z : low.z + (number >> 6U & 7U)};
  }
  [[nodiscard]] node& at(std::uint32_t number) {
    if (number >= from) return ends_[number - from];
    return (*bricks_[number >> brick_bits])[number & ((1U << brick_bits) - 1)];
  }
  [[nodiscard]] vec3 position(std::uint32_t number) const {
    return number >= from ? places_[number - from] : space_.center(cell_key(number));
  }
  [[nodiscard]] bool is_free(node& n, const key& k) const {
    if (n.free == 0) n.free = space_.is_free(k) ? 2 : 1;
    return n.free == 2;
  }
  [[nodiscard]] double density(node& n, const key& k) const {
    if (n.density == 0.0) n.density = space_.density(k);
    return n.density;
  }
  /// Cost of the step from the centre of a cell to the centre of its neighbour; half of it lies in each cell.
  [[nodiscard]] double step_cost(node& a, const key& from_key, node& b, const key& to_key, unsigned direction) const {
    const double length = step_length(direction);
    return is_uniform_ ? length : length * (0.5 * (density(a, from_key) + density(b, to_key)));
  }

  // -- costs

  /// Lower bound on the cost from a cell to the goal or, on the grid, to an exit and from there to the goal.
  [[nodiscard]] double ahead(std::uint32_t number) const {
    if (number == to) return 0.0;
    const vec3 p = position(number);
    if (any_angle_) return norm(p - goal_);
    if (exits_.empty()) return length_in_steps(p - goal_);
    double least = infinity;
    for (std::size_t i = 0; i != exits_.size(); ++i)
      least = std::min(least, length_in_steps(p - space_.center(exits_[i])) + exit_costs_[i]);
    return least;
  }
  void offer(std::uint32_t number, std::uint32_t parent, double cost, trust known) {
    node& n = at(number);
    if (cost >= n.cost) return;
    n.parent = parent;
    n.cost = cost;
    n.known = known;
    open_.push_back({cost + weight_ * ahead(number), cost, number});
    std::push_heap(open_.begin(), open_.end());
  }

  void expand(std::uint32_t number) {
    const key k = cell_key(number);
    if (const double away = squared_norm(space_.center(k) - goal_); away < nearest_away_)
      nearest_away_ = away, nearest_ = number;
    node& n = at(number);
    // Assume that the cells are visible from the parent; a line costs at least its length.
    const std::uint32_t above = any_angle_ ? n.parent : number;
    const double above_cost = at(above).cost;
    const vec3 above_position = position(above);
    // A line costs at least its length and, in the half cells at its ends, their densities.
    const auto half_cell = [&](node& end, const key& end_key) {
      return is_uniform_ ? 0.0 : 0.5 * space_.resolution() * (density(end, end_key) - 1.0);
    };
    const double line_begin = above_cost + (any_angle_ && above != from ? half_cell(at(above), cell_key(above)) : 0.0);
    const trust known = any_angle_ && !is_uniform_ ? trust::bound : trust::exact;
    for (std::size_t i = 0; i != exits_.size(); ++i)
      if (exits_[i] == k)
        offer(to, above, any_angle_ ? above_cost + norm(places_[1] - above_position) : n.cost + exit_costs_[i], known);
    for_each_direction([&](unsigned direction) {
      const key beside = neighbor(k, direction);
      if (!space_.contains(beside)) return;
      const std::uint32_t other = find_or_add(beside);
      node& m = at(other);
      if (m.is_closed || m.free == 1) return;
      if (any_angle_ && !is_uniform_ && m.tried == above) {  // the cost of the line is known; only the step may be new
        if ((m.barred >> (26 - direction) & 1U) != 0) return;
        const double cost = n.cost + step_cost(n, k, m, beside, direction);
        if (cost < m.cost && is_free(m, beside)) offer(other, number, cost, trust::exact);
        return;
      }
      const double cost = any_angle_ ? line_begin + norm(space_.center(beside) - above_position) + half_cell(m, beside)
                                     : n.cost + step_cost(n, k, m, beside, direction);
      if (cost < m.cost && is_free(m, beside)) offer(other, above, cost, known);
    });
  }

  /// Returns true if the stored cost of the cell is correct. Otherwise puts it back into the queue with its cheapest
  /// path.
  [[nodiscard]] bool confirm_cost(std::uint32_t number) {
    node& n = at(number);
    if (n.known == trust::sure) return true;
    const std::uint32_t parent = n.parent;
    // Spending much time on testing a line over several cells is not worthwhile: if the line is barely free, the search
    // finds steps along it, and shortening finds the line afterwards.
    const unsigned direction = direction_between(parent, number);
    double cost = infinity;
    const auto is_line_free = [&] {
      const vec3 a = position(parent), b = position(number);
      if (direction != none) return space_.is_free(a, b);
      return !(is_uniform_ && n.tried == parent) && space_.is_surely_free(a, b);
    };
    if (is_line_free()) {
      cost =
          n.known == trust::exact ? n.cost : at(parent).cost + segment_cost(space_, position(parent), position(number));
      if (cost <= n.cost) {
        n.known = trust::sure;
        return true;
      }
    } else if (direction != none) {
      n.barred |= 1U << direction;
    }
    if (direction == none) n.tried = parent;
    n.cost = infinity;
    offer_steps(number);
    offer(number, parent, cost, trust::sure);
    return false;
  }
  /// Index of `parent` among the neighbours (for the goal: among the exits); `none` if it is not one of them.
  [[nodiscard]] unsigned direction_between(std::uint32_t parent, std::uint32_t number) const {
    if (parent == from) return none;
    const key p = cell_key(parent);
    if (number == to) {
      for (unsigned i = 0; i != exits_.size(); ++i)
        if (exits_[i] == p) return i;
      return none;
    }
    const key k = cell_key(number);
    const std::uint32_t x = p.x - k.x + 1, y = p.y - k.y + 1, z = p.z - k.z + 1;
    return std::max({x, y, z}) <= 2 ? z * 9 + y * 3 + x : none;
  }
  /// Offers a cell the cheapest step from a closed cell.
  void offer_steps(std::uint32_t number) {
    node& n = at(number);
    std::uint32_t best = from;
    double least = infinity;
    const auto consider = [&](std::uint32_t other, double cost) {
      if (cost < least) least = cost, best = other;
    };
    if (number == to) {
      for (std::size_t i = 0; i != exits_.size(); ++i)
        if (const std::uint32_t other = find_or_add(exits_[i]); at(other).is_closed && (n.barred >> i & 1U) == 0)
          consider(other, at(other).cost + exit_costs_[i]);
    } else {
      const key k = cell_key(number);
      for_each_direction([&](unsigned direction) {
        const key beside = neighbor(k, direction);
        if ((n.barred >> direction & 1U) != 0 || !space_.contains(beside)) return;
        const std::uint32_t other = find_or_add(beside);
        if (node& m = at(other); m.is_closed) consider(other, m.cost + step_cost(m, beside, n, k, direction));
      });
      if (std::find(doors_.begin(), doors_.end(), k) != doors_.end())
        consider(from, segment_cost(space_, places_[0], space_.center(k)));
    }
    offer(number, best, least, best == from ? trust::sure : trust::exact);  // doors are known to be free
  }

  static constexpr unsigned none = 31;  ///< no direction

  const Space& space_;
  bool any_angle_, is_uniform_;
  double weight_;
  std::array<vec3, 2> places_{};  ///< start and goal
  vec3 goal_ = zeros<vec3>();
  std::vector<key> doors_, exits_;
  std::vector<double> exit_costs_;
  std::array<node, 2> ends_{};
  std::vector<entry> open_;
  std::vector<std::unique_ptr<brick>> bricks_;
  std::vector<key> corners_;
  hash_index index_;
  std::uint64_t last_name_ = ~std::uint64_t{0};
  std::uint32_t last_brick_ = 0;
  std::size_t expanded_ = 0;
  std::uint32_t nearest_ = from;
  double nearest_away_ = infinity;
};

}  // namespace orbis::nav::detail
