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
#include <optional>
#include <ranges>
#include <span>

#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/octree/accessor.hpp>
#include <orbis/octree/detail/points/ray_walk.hpp>
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

namespace detail {

/// The walk of `ray_cursor`, able to leave a whole node at once: the parameters of the next steps along
/// each axis are summed up in advance, in the same order, so that how many of them come before the
/// node's face can be looked up instead of walked.
class ray_leaper {
 public:
  explicit ray_leaper(const ray_cursor& c) noexcept : at_{c.at}, step_{c.step}, delta_{c.delta}, cells_{c.cells} {
    for (std::size_t i = 0; i != 3; ++i) per_step_[i] = step_[i] == 0 ? 0.0 : 1.0 / delta_[i];
    sum_up(c.next[0], c.next[1], c.next[2]);
  }

  [[nodiscard]] voxel_key key() const noexcept { return {at_[0], at_[1], at_[2]}; }
  [[nodiscard]] bool is_outside() const noexcept { return (at_[0] | at_[1] | at_[2]) >= cells_; }
  /// Takes back the last step, along `axis`.
  void step_back(std::size_t axis) noexcept { at_[axis] -= static_cast<std::uint32_t>(step_[axis]); }

  struct crossing {
    std::size_t axis;
    double parameter;  ///< of the ray at the face
  };
  /// One step.
  crossing step() noexcept {
    const crossing face = first(ahead_[0][used_[0]], ahead_[1][used_[1]], ahead_[2][used_[2]]);
    at_[face.axis] += static_cast<std::uint32_t>(step_[face.axis]);
    if (++used_[face.axis] == count - 1) renew();
    return face;
  }
  /// Where the ray leaves the node of edge `cells` that it is in.
  struct way_out {
    crossing face;
    std::array<std::uint32_t, 3> steps;  ///< until outside along each axis, were it alone
  };
  /// @pre cells is a power of two, at most 32
  [[nodiscard]] way_out find_way_out(std::uint32_t cells) noexcept {
    way_out way{};
    const auto steps_along = [&](std::size_t i) {
      const std::uint32_t inside = at_[i] & (cells - 1);
      way.steps[i] = step_[i] > 0 ? cells - inside : inside + 1;
      return used_[i] + way.steps[i] >= count;
    };
    const bool short_x = steps_along(0), short_y = steps_along(1), short_z = steps_along(2);
    if (short_x || short_y || short_z) renew();
    const auto last = [&](std::size_t i) { return ahead_[i][used_[i] + way.steps[i] - 1]; };
    way.face = first(last(0), last(1), last(2));
    return way;
  }
  /// Takes all steps up to there.
  void take(const way_out& way) noexcept {
    const double end = way.face.parameter;
    const auto take_along = [&](std::size_t i) {
      // Steps are `delta` apart but for rounding, so only the one next to the face must be looked at. The
      // first is less than a step before the ray, the last not before the face: nothing to clamp.
      const double* const next = ahead_[i].data() + used_[i];
      const double near = (end - next[0]) * per_step_[i] + 0.5;
      const auto sure = static_cast<std::uint32_t>(static_cast<std::int32_t>(near));
      const bool is_before = (next[sure] < end) | ((next[sure] == end) & (i >= way.face.axis));
      const std::uint32_t taken = sure + (is_before ? 1 : 0);
      at_[i] += static_cast<std::uint32_t>(step_[i]) * taken;
      used_[i] += taken;
    };
    take_along(0);
    take_along(1);
    take_along(2);
  }

 private:
  static constexpr std::uint32_t count = 64;

  /// The face that comes first; of those at the same place the last axis', as in ray_cursor.
  [[nodiscard]] static crossing first(double x, double y, double z) noexcept {
    const bool is_x = x < y && x < z, is_z = !(y < z) || (x < y && !is_x);
    const double parameter = x < y ? x : y;
    return {is_x ? std::size_t{0} : is_z ? std::size_t{2} : std::size_t{1}, parameter < z ? parameter : z};
  }
  void renew() noexcept { sum_up(ahead_[0][used_[0]], ahead_[1][used_[1]], ahead_[2][used_[2]]); }
  void sum_up(double x, double y, double z) noexcept {
    const double dx = delta_[0], dy = delta_[1], dz = delta_[2];
    for (std::size_t i = 0; i != count; ++i) {
      ahead_[0][i] = x;
      ahead_[1][i] = y;
      ahead_[2][i] = z;
      x += dx;
      y += dy;
      z += dz;
    }
    used_ = {};
  }

  std::array<std::uint32_t, 3> at_;
  std::array<std::int32_t, 3> step_;
  std::array<double, 3> delta_;
  std::array<double, 3> per_step_{};
  std::array<std::uint32_t, 3> used_{};
  std::uint32_t cells_;
  std::array<std::array<double, count>, 3> ahead_;
};

}  // namespace detail

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
    const ray_cursor cursor{grid_, *start, origin, direction, [&](std::int32_t step) { return step * half; }};
    const bool moves = cursor.step[0] != 0 || cursor.step[1] != 0 || cursor.step[2] != 0;
    if (!moves || !std::isfinite(norm)) return ended(ray_end::no_direction, *start);

    detail::ray_leaper ray{cursor};
    const double safe = surely_in_range(origin);
    for (;;) {
      // Where nothing can stop it, the ray leaps to the node's face.
      std::uint32_t cells = passable_cells(ray.key());
      if (cells == 0) {
        if (const auto stop = stop_at(ray.key())) return ended(*stop, ray.key());
        cells = is_passable_octant() ? node_cells(octant_level) : 0;
      }
      if (cells != 0) {
        const auto way = ray.find_way_out(cells);
        if (way.face.parameter < safe) {
          ray.take(way);
          if (!ray.is_outside()) continue;
          ray.step_back(way.face.axis);
          return ended(ray_end::out_of_grid, ray.key());
        }
      }
      const voxel_key octant = node_key(ray.key(), octant_level);
      for (;;) {
        const auto face = ray.step();
        if (ray.is_outside()) {
          ray.step_back(face.axis);
          return ended(ray_end::out_of_grid, ray.key());
        }
        if (!(face.parameter < safe) && is_out_of_range(origin, ray.key()))
          return ended(ray_end::out_of_range, ray.key());
        if (node_key(ray.key(), octant_level) != octant) break;
        if (const auto stop = stop_at(ray.key())) return ended(*stop, ray.key());
      }
    }
  }

 private:
  using chunk = typename brick_store<value_type>::chunk;
  /// What is remembered of a chunk, stored or not. Which bricks let rays through is worked out once
  /// enough rays have come by.
  struct seen_chunk {
    std::uint64_t name = ~std::uint64_t{0};
    std::uint64_t passable = 0;  ///< bricks in Morton order
    const chunk* content = nullptr;
    std::uint32_t visits = 0;
  };
  static constexpr std::size_t chunks_kept = 64;
  static constexpr std::uint32_t enough_visits = 4;

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
  /// Whether no voxel of the octant asked for last stops a ray.
  [[nodiscard]] bool is_passable_octant() const noexcept {
    const std::uint64_t known = reader_.last().known;
    const bool is_free = known == 0 || reader_.is_below(Model::occupancy_threshold);
    return is_free && (options_.ignore_unknown || known == ~std::uint64_t{0});
  }
  /// The edge, in voxels, of a node from a brick to a chunk around `k` in which no voxel stops a ray; 0
  /// if there is none.
  [[nodiscard]] std::uint32_t passable_cells(const voxel_key& k) noexcept {
    const seen_chunk& c = chunk_at(k);
    const std::uint32_t place = place_in_chunk(k);
    if (c.visits < enough_visits) return is_passable_brick(c, k, place) ? node_cells(brick_level) : 0;
    if (c.passable == ~std::uint64_t{0}) return node_cells(chunk_level);
    if ((c.passable >> (place & 56U) & 0xffU) == 0xff) return node_cells(brick_level + 1);
    return (c.passable >> place & 1U) != 0 ? node_cells(brick_level) : 0;
  }
  [[nodiscard]] const seen_chunk& chunk_at(const voxel_key& k) noexcept {
    const std::uint64_t name = node_name(k, chunk_level);
    if (seen_[here_].name == name) return seen_[here_];
    const voxel_key c{k.x >> chunk_level, k.y >> chunk_level, k.z >> chunk_level};
    here_ = (c.x & 3U) | (c.y & 3U) << 2U | (c.z & 3U) << 4U;
    seen_chunk& here = seen_[here_];
    if (here.name != name) here = {name, 0, reader_.store().find_chunk(k), 0};
    if (++here.visits == enough_visits) {
      const voxel_key low = node_key(k, chunk_level);
      for (std::uint32_t place = 0; place != 64; ++place) {
        const voxel_key offset = brick_in_chunk(place);
        const bool passable = is_passable_brick(here, {low.x + offset.x, low.y + offset.y, low.z + offset.z}, place);
        here.passable |= std::uint64_t{passable} << place;
      }
    }
    return here;
  }
  [[nodiscard]] bool is_passable_brick(const seen_chunk& c, const voxel_key& k, std::uint32_t place) const noexcept {
    const brick<value_type>* const b = c.content == nullptr ? nullptr : reader_.store().find(*c.content, place);
    if (b == nullptr) {
      const value_type* const large = reader_.store().find_large_value(k);
      return large == nullptr ? options_.ignore_unknown : !is_occupied<Model>(*large);
    }
    const unsigned present = b->uniform | b->dense;
    bool passable = options_.ignore_unknown || b->uniform == 0xff;
    for (unsigned i = 0; i != 8; ++i) passable &= (present >> i & 1U) == 0 || b->value[i] < Model::occupancy_threshold;
    return passable;
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
  std::array<seen_chunk, chunks_kept> seen_{};
  std::size_t here_ = 0;  ///< of the chunk looked at last
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
