// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a ray through the map meets first, as OctoMap's `castRay` answers it.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>

#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/octree/accessor.hpp>
#include <orbis/octree/ray_walk.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

enum class ray_end {
  hit,           ///< an occupied voxel
  unknown,       ///< a voxel nothing is known about
  out_of_range,  ///< the centre of the voxel lies beyond the range
  out_of_grid,   ///< the ray leaves the grid, or starts outside
  no_direction   ///< the direction is zero or not finite
};

/// Where a ray ended.
struct ray_hit {
  ray_end end = ray_end::out_of_grid;
  voxel_key key;              ///< the voxel where it ended
  vec3 point = vec3::Zero();  ///< its centre, metres; both are zero if the ray starts outside the grid

  /// Whether something occupied was hit.
  [[nodiscard]] explicit operator bool() const noexcept { return end == ray_end::hit; }
};

struct ray_options {
  double max_range = std::numeric_limits<double>::infinity();  ///< metres; infinite or <= 0: no limit but the grid
  bool ignore_unknown = false;                                 ///< whether rays go on through unknown space
};

/// Casts rays, one after the other: faster if each passes near the one before. One for each thread;
/// store and grid must outlive it and stay as they are.
template <sensor_model Model>
class ray_caster {
 public:
  using value_type = typename Model::value_type;

  ray_caster(const brick_store<value_type>& store, const voxel_grid& grid, const ray_options& options) noexcept
      : reader_{store}, grid_{grid}, options_{options} {}

  /// Walks from `origin` along `direction` (any length) until a voxel is occupied, or unknown unless
  /// that is ignored, or too far away. O(voxels along the ray), few operations for each.
  [[nodiscard]] ray_hit operator()(const float3& origin, float3 direction) noexcept {
    const auto start = grid_.key(origin);
    if (!start) return {};
    const double norm = length(direction);
    if (norm > 0.0)
      for (float& d : direction) d /= static_cast<float>(norm);
    if (const auto stop = stop_at(*start)) return ended(*stop, *start);

    const double half = grid_.resolution() * 0.5;
    ray_cursor cursor{grid_, *start, origin, direction, [&](std::int32_t step) { return step * half; }};
    const bool moves = cursor.step[0] != 0 || cursor.step[1] != 0 || cursor.step[2] != 0;
    if (!moves || !std::isfinite(norm)) return ended(ray_end::no_direction, *start);

    const double safe = surely_in_range(origin);
    for (;;) {
      // Where nothing can stop it, the ray walks to the node's face without a look.
      const std::uint32_t cells = passable_cells(cursor.key());
      if (cells != 0) {
        ray_cursor ahead = cursor;
        const auto [axis, parameter] = leave(ahead, cells);
        if (parameter < safe) {
          if (ahead.at[axis] >= cursor.cells) {
            ahead.at[axis] -= static_cast<std::uint32_t>(ahead.step[axis]);
            return ended(ray_end::out_of_grid, ahead.key());
          }
          cursor = ahead;
          if (const auto stop = stop_at(cursor.key())) return ended(*stop, cursor.key());
          continue;
        }
      }
      const voxel_key octant = node_key(cursor.key(), octant_level);
      do {
        const std::size_t axis = cursor.axis();
        if (!cursor.can_step(axis)) return ended(ray_end::out_of_grid, cursor.key());
        const bool may_be_far = !(cursor.next[axis] < safe);
        cursor.advance(axis);
        if (may_be_far && is_out_of_range(origin, cursor.key())) return ended(ray_end::out_of_range, cursor.key());
        if (const auto stop = stop_at(cursor.key())) return ended(*stop, cursor.key());
      } while (node_key(cursor.key(), octant_level) == octant);
    }
  }

 private:
  [[nodiscard]] ray_hit ended(ray_end end, const voxel_key& key) const noexcept {
    return {end, key, grid_.center(key)};
  }
  [[nodiscard]] std::optional<ray_end> stop_at(const voxel_key& k) noexcept {
    const octant_view<value_type>& o = reader_.octant(k);
    const std::uint32_t place = place_in_octant(k);
    if ((o.known >> place & 1U) == 0) return options_.ignore_unknown ? std::nullopt : std::optional{ray_end::unknown};
    const bool occupied = !reader_.is_below(Model::occupancy_threshold) && is_occupied<Model>(o.at(place));
    return occupied ? std::optional{ray_end::hit} : std::nullopt;
  }
  /// The edge, in voxels, of a node around `k` in which no voxel stops the ray; 0 if there is none.
  [[nodiscard]] std::uint32_t passable_cells(const voxel_key& k) noexcept {
    const octant_view<value_type>& o = reader_.octant(k);
    const bool is_free = o.known == 0 || reader_.is_below(Model::occupancy_threshold);
    const bool is_passable = is_free && (options_.ignore_unknown || o.known == ~std::uint64_t{0});
    if (!is_passable) return 0;
    const brick<value_type>* const b = reader_.last_brick();
    return b != nullptr && is_passable_brick(*b) ? node_cells(brick_level) : reader_.cells();
  }
  [[nodiscard]] bool is_passable_brick(const brick<value_type>& b) const noexcept {
    const unsigned present = b.uniform | b.dense;
    bool passable = options_.ignore_unknown || b.uniform == 0xff;
    for (unsigned i = 0; i != 8; ++i)
      passable &= (present >> i & 1U) == 0 || b.value[i] < Model::occupancy_threshold;
    return passable;
  }

  struct step_out {
    std::size_t axis;
    double parameter;  ///< of the ray where it leaves
  };
  /// Steps out of the node of edge `cells` that the cursor is in.
  [[nodiscard]] static step_out leave(ray_cursor& c, std::uint32_t cells) noexcept {
    std::array<std::uint32_t, 3> left{};  // steps until outside
    for (std::size_t i = 0; i != 3; ++i) {
      const std::uint32_t inside = c.at[i] & (cells - 1);
      left[i] = c.step[i] > 0 ? cells - inside : inside + 1;
    }
    // By hand for each axis: everything stays in registers.
    double next0 = c.next[0], next1 = c.next[1], next2 = c.next[2];
    std::uint32_t left0 = left[0], left1 = left[1], left2 = left[2];
    step_out out{};
    for (;;) {
      if (next0 < next1 && next0 < next2) {
        out = {0, next0};
        next0 += c.delta[0];
        if (--left0 == 0) break;
      } else if (next1 < next2 && !(next0 < next1)) {
        out = {1, next1};
        next1 += c.delta[1];
        if (--left1 == 0) break;
      } else {
        out = {2, next2};
        next2 += c.delta[2];
        if (--left2 == 0) break;
      }
    }
    c.next = {next0, next1, next2};
    const std::array<std::uint32_t, 3> rest{left0, left1, left2};
    for (std::size_t i = 0; i != 3; ++i) c.at[i] += static_cast<std::uint32_t>(c.step[i]) * (left[i] - rest[i]);
    return out;
  }

  /// A ray parameter up to which no voxel's centre is beyond the range. A centre is at most 0.87
  /// voxels away from where the ray enters the voxel; floats round to 6e-8 of their size.
  [[nodiscard]] double surely_in_range(const float3& origin) const noexcept {
    if (!(options_.max_range > 0.0)) return std::numeric_limits<double>::infinity();
    double far = options_.max_range;
    for (const float o : origin) far += std::fabs(static_cast<double>(o));
    return options_.max_range - grid_.resolution() - 1e-6 * far;
  }
  [[nodiscard]] bool is_out_of_range(const float3& origin, const voxel_key& k) const noexcept {
    const vec3 center = grid_.center(k);
    double squares = 0.0;
    for (int i = 0; i != 3; ++i) {
      const float away = static_cast<float>(center[i]) - origin[static_cast<std::size_t>(i)];
      squares += static_cast<double>(rounded_product(away, away));
    }
    return options_.max_range > 0.0 && squares > options_.max_range * options_.max_range;
  }

  store_reader<value_type> reader_;
  voxel_grid grid_;
  ray_options options_;
};

/// Casts many rays: `out[i]` becomes where the ray from `origins[i]` along `directions[i]` ends, the
/// same under every policy. `origins` may be a single point. Allocates nothing.
/// @pre origins (unless a point), directions and out have the same size
template <execution_policy Policy, octree_map Map, class Origins, point_range Directions>
requires point_range<Origins> || point_like<Origins>
void cast_rays(const Policy& policy, const Map& map, const Origins& origins, const Directions& directions,
               const ray_options& options, std::span<ray_hit> out) {
  const auto count = static_cast<std::size_t>(std::ranges::size(directions));
  assert(out.size() == count);
  const auto at = [](const auto& points, std::size_t i) {
    const auto first = std::ranges::begin(points);
    return coordinates<float>(first[static_cast<std::iter_difference_t<decltype(first)>>(i)]);
  };
  if constexpr (point_range<Origins>) assert(static_cast<std::size_t>(std::ranges::size(origins)) == count);
  for_each_chunk(policy, count, 256, [&](std::size_t begin, std::size_t end) {
    ray_caster<typename Map::model> cast{map.store(), map.grid(), options};
    for (std::size_t i = begin; i != end; ++i) {
      if constexpr (point_range<Origins>)
        out[i] = cast(at(origins, i), at(directions, i));
      else
        out[i] = cast(coordinates<float>(origins), at(directions, i));
    }
  });
}

}  // namespace orbis::octree
