// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of floor_map.hpp.
#pragma once

#include <algorithm>
#include <bit>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <vector>

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/nav/detail/floor/columns.hpp>
#include <orbis/nav/detail/floor/plane_sums.hpp>
#include <orbis/nav/floor_map.hpp>

namespace orbis::nav {

namespace detail {

/// Maximum number of octants in the highest layers of large leaves that find_floor examines; this takes about a second.
inline constexpr std::uint64_t most_octants_on_leaves = std::uint64_t{1} << 24U;

}  // namespace detail

template <planning_map Map>
std::optional<double> find_floor(const Map& map) {
  const octree::voxel_grid& grid = map_access<Map>::grid(map);
  std::vector<std::size_t> surface(grid.cells());  // surface area of each layer
  auto read = map_access<Map>::octants(map);
  std::uint64_t of_leaves = 0;
  map_access<Map>::for_each_octant(map, [&](const octree::voxel_key& k, int level, const octree::octant_states& s) {
    if (s.occupied == 0) return;
    // Only the highest layer of a large cube can have free space above it.
    const std::uint32_t size = octree::node_cells(level);
    if (level > 3 && (of_leaves += std::uint64_t{size / 4} * (size / 4)) > detail::most_octants_on_leaves) return;
    const auto& layers = detail::octant_layers;
    for (std::uint32_t y = 0; y != size; y += 4)
      for (std::uint32_t x = 0; x != size; x += 4) {
        const octree::voxel_key top{k.x + x, k.y + y, k.z + size - 4};
        const std::uint64_t above = top.z + 4 < grid.cells() ? read({top.x, top.y, top.z + 4}).free() : 0;
        const std::uint64_t free = s.free();
        const std::uint64_t free_above =
            (free & (layers[1] | layers[3])) >> 4U | (free & layers[2]) >> 28U | (above & layers[0]) << 36U;
        for (std::size_t z = 0; z != 4; ++z)
          surface[top.z + z] += static_cast<std::size_t>(std::popcount(s.occupied & free_above & layers[z]));
      }
  });
  const auto two = [&](std::size_t z) { return surface[z] + surface[z + 1]; };
  std::size_t most = 0;
  for (std::size_t z = 0; z + 1 != surface.size(); ++z) most = std::max(most, two(z));
  if (most == 0) return std::nullopt;
  std::size_t at = 0;
  while (2 * two(at) < most) ++at;
  while (at + 1 != surface.size() && surface[at + 1] > surface[at]) ++at;
  return grid.center(static_cast<std::uint32_t>(at)) + grid.resolution() / 2;
}

namespace detail {

/// Replaces each value by the extreme of the values at most `radius` away along both axes: combines ranges whose
/// lengths double, and finally two overlapping ranges. The value `nothing` means "no value". O(values x log radius).
template <class Extreme>
void spread_extremes(image<int>& values, int radius, int nothing, const Extreme& extreme) {
  std::vector<int> line;
  const auto along = [&](int* first, std::ptrdiff_t stride, int count) {
    const int reach = std::min(radius, count);
    const auto n = static_cast<std::size_t>(count), wide = static_cast<std::size_t>(2 * reach + 1);
    line.assign(n + wide - 1, nothing);
    int* const from = line.data() + reach;
    for (std::ptrdiff_t i = 0; i != count; ++i) from[i] = first[i * stride];
    std::size_t length = 1;
    for (; 2 * length <= wide; length *= 2)
      for (std::size_t i = 0; i + length < line.size(); ++i) line[i] = extreme(line[i], line[i + length]);
    for (std::size_t i = 0; i != n; ++i)
      first[static_cast<std::ptrdiff_t>(i) * stride] = extreme(line[i], line[i + wide - length]);
  };
  for (int y = 0; y != values.height(); ++y) along(&values(0, y), 1, values.width());
  for (int x = 0; x != values.width(); ++x) along(&values(x, 0), &values(0, 1) - &values(0, 0), values.height());
}

/// The surfaces in all columns, and those that a robot can reach.
template <class = void>
class basic_floor_search {
 public:
  static constexpr int none = no_level;

  /// Levels are relative to `columns`; `lowest` and `highest`: range of the surface levels; `clear` and `step`: in
  /// voxels.
  basic_floor_search(const voxel_columns& columns, int lowest, int highest, int clear, int step,
                     octree::occupancy unknown)
      : columns_{columns},
        lowest_{lowest},
        highest_{highest},
        clear_{clear},
        step_{step},
        unknown_{unknown},
        levels_(columns.width(), columns.height(), none) {
    find_surfaces();
  }

  /// Floods from all surfaces within a step of level `floor`, and keeps the lowest reached surface of each column.
  void flood(int floor) {
    std::vector<std::uint32_t> waiting;
    const auto get_to = [&](std::size_t surface) {
      if (reached_[surface]) return;
      reached_[surface] = true;
      waiting.push_back(static_cast<std::uint32_t>(surface));
    };
    for (std::size_t i = 0; i != surfaces_.size(); ++i)
      if (std::abs(surfaces_[i].level - floor) <= step_) get_to(i);
    while (!waiting.empty()) {
      const surface from = surfaces_[waiting.back()];
      waiting.pop_back();
      int& level = levels_.data()[from.column];
      if (level == none || from.level < level) level = from.level;
      const auto x = static_cast<int>(from.column % static_cast<std::uint32_t>(columns_.width()));
      const auto y = static_cast<int>(from.column / static_cast<std::uint32_t>(columns_.width()));
      for_each_neighbor(x, y, [&](int u, int v) {
        const std::size_t column = place(u, v);
        for (std::size_t i = first_[column]; i != first_[column + 1]; ++i)
          if (std::abs(surfaces_[i].level - from.level) <= step_) get_to(i);
      });
    }
  }
  /// The lowest reachable surface of each column, or `none`.
  [[nodiscard]] const image<int>& levels() const noexcept { return levels_; }

  [[nodiscard]] floor_state judge_surface(int x, int y, double steepest) const {
    const int level = levels_(x, y);
    bool is_edge = false;
    for_each_neighbor(x, y, [&](int u, int v) {
      const int other = levels_(u, v);
      is_edge = is_edge || (other != none && other < level - step_);
    });
    if (is_edge || is_steep(x, y, steepest)) return floor_state::occupied;
    return columns_.next_unknown(x, y, level) > level + clear_ ? floor_state::free : in_doubt();
  }
  /// State of a column without a reachable surface, next to a floor at `level`.
  [[nodiscard]] floor_state judge_other(int x, int y, int level) const {
    const int from = std::max(level + step_ + 1, 0);
    if (columns_.next_occupied(x, y, from) <= level + step_ + clear_) return floor_state::occupied;
    // Below level 0 and above the last level, everything is unknown, unless the grid ends there.
    const int deepest = columns_.low().z == 0 ? std::max(level - step_, 0) : level - step_;
    if (deepest >= 0 && columns_.next_occupied(x, y, deepest) > level && columns_.next_unknown(x, y, deepest) > level)
      return floor_state::occupied;
    return in_doubt();
  }
  /// Sets the radius within which is_steep fits a plane, in cells. Call it after `flood` and before `judge_surface`.
  void set_radius(int radius) {
    radius_ = std::min(radius, std::max(levels_.width(), levels_.height()));
    // Integer sums are faster if they fit.
    const double r = radius_, rise = std::min(static_cast<double>(step_) * r, static_cast<double>(columns_.levels()));
    if ((2.0 * r + 1.0) * (2.0 * r + 1.0) * r * std::max(r, rise) < std::numeric_limits<std::int32_t>::max())
      sums_ = simd::kernel<plane_sums_kernel<std::int32_t>, plane_sums(const level_window&)>();
    else
      sums_ = simd::kernel<plane_sums_kernel<double>, plane_sums(const level_window&)>();
    constexpr int most = std::numeric_limits<int>::max();
    low_ = high_ = levels_;
    for (int& level : low_.pixels())
      if (level == none) level = most;
    spread_extremes(low_, radius_, most, [](int a, int b) { return std::min(a, b); });
    spread_extremes(high_, radius_, none, [](int a, int b) { return std::max(a, b); });
  }

  /// For each column, the level of the nearest column that has one, where distance is the number of steps between
  /// four-connected neighbours; on ties, the lowest level. `otherwise` if no column has a level.
  [[nodiscard]] image<int> spread_levels(int otherwise) const {
    image<int> spread = levels_;
    std::vector<std::array<int, 2>> border, next;
    for (int y = 0; y != spread.height(); ++y)
      for (int x = 0; x != spread.width(); ++x) {
        if (levels_(x, y) == none) continue;
        bool is_border = false;
        for_each_neighbor(x, y, [&](int u, int v) { is_border = is_border || levels_(u, v) == none; });
        if (is_border) border.push_back({x, y});
      }
    image<std::uint32_t> round(spread.width(), spread.height(), 0);
    for (std::uint32_t n = 1; !border.empty(); ++n, border.swap(next)) {
      next.clear();
      for (const auto& [x, y] : border) {
        const int level = spread(x, y);
        for_each_neighbor(x, y, [&](int u, int v) {
          int& other = spread(u, v);
          if (other == none) {
            round(u, v) = n;
            next.push_back({u, v});
            other = level;
          } else if (round(u, v) == n) {
            other = std::min(other, level);
          }
        });
      }
    }
    for (int& level : spread.pixels())
      if (level == none) level = otherwise;
    return spread;
  }

 private:
  struct surface {
    int level;
    std::uint32_t column;
  };

  [[nodiscard]] std::size_t place(int x, int y) const noexcept {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_.width()) + static_cast<std::size_t>(x);
  }
  template <class Visit>
  void for_each_neighbor(int x, int y, Visit&& visit) const {
    if (x != 0) visit(x - 1, y);
    if (x + 1 != columns_.width()) visit(x + 1, y);
    if (y != 0) visit(x, y - 1);
    if (y + 1 != columns_.height()) visit(x, y + 1);
  }
  [[nodiscard]] floor_state in_doubt() const noexcept {
    return unknown_ == octree::occupancy::free       ? floor_state::free
           : unknown_ == octree::occupancy::occupied ? floor_state::occupied
                                                     : floor_state::unknown;
  }
  void find_surfaces() {
    first_.reserve(levels_.pixels().size() + 1);
    for (int y = 0; y != columns_.height(); ++y)
      for (int x = 0; x != columns_.width(); ++x) {
        first_.push_back(static_cast<std::uint32_t>(surfaces_.size()));
        for (int z = columns_.next_occupied(x, y, std::max(lowest_, 0)); z <= highest_;) {
          if (clear_ != 0) z = std::min(columns_.end_of_run(x, y, z), highest_);
          const int next = columns_.next_occupied(x, y, z + 1);
          if (next > z + clear_ &&
              (unknown_ != octree::occupancy::occupied || columns_.next_unknown(x, y, z) > z + clear_))
            surfaces_.push_back({z, static_cast<std::uint32_t>(place(x, y))});
          z = next;
        }
      }
    first_.push_back(static_cast<std::uint32_t>(surfaces_.size()));
    reached_.resize(surfaces_.size());
  }
  /// Returns true if the floor around a cell rises by more than a step, and its least-squares plane is steeper than
  /// `steepest` (tangent). Only columns that differ by at most a step per cell of distance count, which excludes
  /// ledges.
  [[nodiscard]] bool is_steep(int x, int y, double steepest) const {
    const int level = levels_(x, y);
    if (high_(x, y) - low_(x, y) <= step_ || step_ == 0) return false;
    level_window w;
    w.x = -std::min(radius_, x);
    w.y = -std::min(radius_, y);
    w.width = std::min(radius_, columns_.width() - 1 - x) - w.x + 1;
    w.height = std::min(radius_, columns_.height() - 1 - y) - w.y + 1;
    w.levels = levels_.data() + place(x + w.x, y + w.y);
    w.stride = levels_.width();
    w.level = level;
    w.step = std::min(step_, columns_.levels());  // no two levels differ by more
    w.enough = columns_.levels() / w.step + 1;
    const plane_sums s = sums_(w);
    if (s.highest - s.lowest <= step_) return false;
    const double xx = s.xx - s.x * s.x / s.n, xy = s.xy - s.x * s.y / s.n, yy = s.yy - s.y * s.y / s.n,
                 xz = s.xz - s.x * s.z / s.n, yz = s.yz - s.y * s.z / s.n;
    const double determinant = xx * yy - xy * xy;
    if (determinant < 1e-9 * xx * yy || determinant <= 0.0) {  // all columns are in one row: use the slope along it
      const double along = xx + yy, rise = std::hypot(xz, yz);
      return along > 0.0 && rise > steepest * along;
    }
    const double a = (xz * yy - yz * xy) / determinant, b = (yz * xx - xz * xy) / determinant;
    return a * a + b * b > steepest * steepest;
  }

  const voxel_columns& columns_;
  int lowest_, highest_, clear_, step_;
  octree::occupancy unknown_;
  int radius_ = 1;
  plane_sums (*sums_)(const level_window&) = nullptr;
  std::vector<surface> surfaces_;     ///< surfaces sorted by column, and from low to high in each column
  std::vector<std::uint32_t> first_;  ///< index of each column's first surface
  std::vector<bool> reached_;
  image<int> levels_;
  image<int> low_{}, high_{};  ///< extremes of the levels within the radius
};
using floor_search = basic_floor_search<>;

}  // namespace detail

template <planning_map Map>
result<floor_map> make_floor_map(const Map& map, const ground_robot& robot, const floor_map_options& options) {
  assert(robot.radius > 0.0 && robot.height > 0.0 && robot.step >= 0.0 && options.below >= 0.0 && options.above >= 0.0);
  assert(robot.max_slope >= 0.0 && robot.max_slope < std::numbers::pi / 2);
  constexpr std::uint64_t most_words = std::uint64_t{1} << 26U;
  const octree::voxel_grid& grid = map_access<Map>::grid(map);
  const double cell = grid.resolution();
  const auto limited = [&](double voxels) {  // at most the size of the grid, because a limit may be infinite
    return static_cast<int>(std::min(voxels, static_cast<double>(std::min(grid.cells(), 1U << 24U))));
  };
  const auto voxels = [&](double metres) { return limited(std::ceil(metres / cell - 1e-6)); };
  const int clear = voxels(robot.height), step = limited(std::floor(robot.step / cell + 1e-6));

  const std::optional<double> floor = options.floor ? options.floor : find_floor(map);
  if (!floor) return fail(errc::no_data, "", "the map has no floor");
  const std::optional<std::uint32_t> floor_key = grid.key(*floor - cell / 2);
  if (!floor_key) return fail(errc::no_data, "", "the floor lies outside the map's grid");
  const auto key_at = [&](int voxels_up) {
    return static_cast<std::uint32_t>(
        std::clamp<std::int64_t>(std::int64_t{*floor_key} + voxels_up, 0, std::int64_t{grid.cells()} - 1));
  };
  octree::key_box box{{0, 0, 0}, {grid.cells() - 1, grid.cells() - 1, grid.cells() - 1}};
  if (options.region) {
    const auto flat = [&](const vec3& corner) { return vec3{corner.x(), corner.y(), *floor - cell / 2}; };
    const vec3 min = flat(options.region->min), max = flat(options.region->max);
    if (!(min.x() <= max.x() && min.y() <= max.y())) return fail(errc::invalid_argument, "region", "min exceeds max");
    const auto named = octree::keys_between(grid, min, max);
    if (!named) return fail(errc::no_data, "", "the region lies outside the map's grid");
    box = *named;
  }
  const std::uint32_t lowest = key_at(-voxels(options.below)), highest = key_at(voxels(options.above));
  box.low.z = key_at(-voxels(options.below) - step);
  box.high.z = key_at(voxels(options.above) + step + clear);
  const result<detail::voxel_columns> columns = detail::read_columns(map, box, most_words);
  if (!columns) return fail(columns.error());
  const auto level_of = [&](std::uint32_t key) { return static_cast<int>(key) - static_cast<int>(columns->low().z); };

  detail::floor_search search{*columns, level_of(lowest), level_of(highest), clear, step, options.unknown};
  search.flood(level_of(*floor_key));
  search.set_radius(std::max(1, limited(std::round(robot.radius / cell))));
  const image<int> beside = search.spread_levels(level_of(*floor_key));

  floor_map out;
  out.resolution = cell;
  out.origin = head<2>(octree::node_cube(grid, columns->low(), 0).min);
  out.floor = *floor;
  out.states = image<floor_state>(columns->width(), columns->height());
  out.heights = image<float>(columns->width(), columns->height(), std::numeric_limits<float>::quiet_NaN());
  const double steepest = std::tan(robot.max_slope);
  for (int y = 0; y != columns->height(); ++y)
    for (int x = 0; x != columns->width(); ++x) {
      const int level = search.levels()(x, y);
      if (level == detail::floor_search::none) {
        out.states(x, y) = search.judge_other(x, y, beside(x, y));
        continue;
      }
      out.states(x, y) = search.judge_surface(x, y, steepest);
      out.heights(x, y) =
          static_cast<float>(grid.center(columns->low().z + static_cast<std::uint32_t>(level)) + cell / 2);
    }
  return out;
}

}  // namespace orbis::nav
