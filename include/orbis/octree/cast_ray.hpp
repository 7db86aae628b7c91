// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Ray casting: the first occupied or unknown voxel along a ray, identical to that of OctoMap's `castRay`.
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
#include <orbis/octree/detail/mark/rays/skipping_traversal.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {

enum class ray_end {
  hit,           ///< an occupied voxel
  unknown,       ///< an unknown voxel
  out_of_range,  ///< the centre of the voxel is beyond the range
  out_of_grid,   ///< the ray leaves the grid, or starts outside it
  no_direction   ///< the direction is zero or not finite
};

/// The voxel at which a cast ray ended, and the reason.
struct ray_hit {
  ray_end end = ray_end::out_of_grid;
  voxel_key key;               ///< the voxel in which the ray ended
  vec3 point = zeros<vec3>();  ///< voxel centre, metres; key and point are zero if the ray starts outside the grid

  /// Returns true if the ray hit an occupied voxel.
  [[nodiscard]] explicit operator bool() const noexcept { return end == ray_end::hit; }
};

struct ray_options {
  double max_range = std::numeric_limits<double>::infinity();  ///< metres; infinite or <= 0: limited by the grid only
  bool ignore_unknown = false;                                 ///< true if rays pass through unknown space
};

/// Casts single rays; faster if each passes near the previous one. Use one per thread; store and grid must outlive the
/// caster and must not change.
template <sensor_model Model>
class ray_caster {
 public:
  using value_type = typename Model::value_type;

  ray_caster(const detail::brick_store<value_type>& store, const voxel_grid& grid, const ray_options& options) noexcept
      : reader_{store}, grid_{grid}, options_{options} {}

  /// Follows the ray from `origin` along `direction` (any length) to the first voxel that is occupied, unknown (unless
  /// ignored) or out of range. O(voxels along the ray), with few operations per voxel.
  [[nodiscard]] ray_hit operator()(const detail::float3& origin, detail::float3 direction) noexcept {
    const auto start = grid_.key(origin);
    if (!start) return {};
    const double norm = detail::length(direction);
    if (norm > 0.0)
      for (float& d : direction) d /= static_cast<float>(norm);
    if (const auto stop = stop_at(*start)) return ended(*stop, *start);

    const double half = grid_.resolution() * 0.5;
    const detail::ray_traversal cursor{grid_, *start, origin, direction,
                                       [&](std::int32_t step) { return step * half; }};
    const bool moves = cursor.step[0] != 0 || cursor.step[1] != 0 || cursor.step[2] != 0;
    if (!moves || !std::isfinite(norm)) return ended(ray_end::no_direction, *start);

    detail::skipping_traversal ray{cursor};
    const double safe = surely_in_range(origin);
    for (;;) {
      // Skip to the face of a node in which no voxel can stop the ray.
      std::uint32_t cells = passable_cells(ray.key());
      if (cells == 0) {
        if (const auto stop = stop_at(ray.key())) return ended(*stop, ray.key());
        cells = is_passable_octant() ? node_cells(detail::octant_level) : 0;
      }
      if (cells != 0) {
        const auto way = ray.find_node_exit(cells);
        if (way.face.parameter < safe) {
          ray.take(way);
          if (!ray.is_outside()) continue;
          ray.step_back(way.face.axis);
          return ended(ray_end::out_of_grid, ray.key());
        }
      }
      const voxel_key octant = node_key(ray.key(), detail::octant_level);
      for (;;) {
        const auto face = ray.step();
        if (ray.is_outside()) {
          ray.step_back(face.axis);
          return ended(ray_end::out_of_grid, ray.key());
        }
        if (!(face.parameter < safe) && is_out_of_range(origin, ray.key()))
          return ended(ray_end::out_of_range, ray.key());
        if (node_key(ray.key(), detail::octant_level) != octant) break;
        if (const auto stop = stop_at(ray.key())) return ended(*stop, ray.key());
      }
    }
  }

 private:
  using chunk = typename detail::brick_store<value_type>::chunk;
  /// Cached data for a chunk, whether or not the chunk is stored. The mask of passable bricks is computed once enough
  /// rays have visited the chunk.
  struct seen_chunk {
    std::uint64_t name = ~std::uint64_t{0};
    std::uint64_t passable = 0;  ///< passable bricks, in Morton order
    const chunk* content = nullptr;
    std::uint32_t visits = 0;
  };
  static constexpr std::size_t chunks_kept = 64;
  static constexpr std::uint32_t enough_visits = 4;

  [[nodiscard]] ray_hit ended(ray_end end, const voxel_key& key) const noexcept {
    return {end, key, grid_.center(key)};
  }
  [[nodiscard]] std::optional<ray_end> stop_at(const voxel_key& k) noexcept {
    const detail::octant_view<value_type>& o = reader_.octant(k);
    const std::uint32_t place = detail::place_in_octant(k);
    if ((o.known >> place & 1U) == 0) return options_.ignore_unknown ? std::nullopt : std::optional{ray_end::unknown};
    const bool occupied = !reader_.is_below(Model::occupancy_threshold) && is_occupied<Model>(o.at(place));
    return occupied ? std::optional{ray_end::hit} : std::nullopt;
  }
  /// Returns true if no voxel of the last octant stops a ray.
  [[nodiscard]] bool is_passable_octant() const noexcept {
    const std::uint64_t known = reader_.last().known;
    const bool is_free = known == 0 || reader_.is_below(Model::occupancy_threshold);
    return is_free && (options_.ignore_unknown || known == ~std::uint64_t{0});
  }
  /// Returns the edge, in voxels, of the largest node around `k` (a brick, eight bricks or a chunk) that is known to
  /// contain no voxel that stops a ray; 0 if there is none.
  [[nodiscard]] std::uint32_t passable_cells(const voxel_key& k) noexcept {
    const seen_chunk& c = chunk_at(k);
    const std::uint32_t place = detail::place_in_chunk(k);
    if (c.visits < enough_visits) return is_passable_brick(c, k, place) ? node_cells(detail::brick_level) : 0;
    if (c.passable == ~std::uint64_t{0}) return node_cells(detail::chunk_level);
    if ((c.passable >> (place & 56U) & 0xffU) == 0xff) return node_cells(detail::brick_level + 1);
    return (c.passable >> place & 1U) != 0 ? node_cells(detail::brick_level) : 0;
  }
  [[nodiscard]] const seen_chunk& chunk_at(const voxel_key& k) noexcept {
    const std::uint64_t name = detail::node_name(k, detail::chunk_level);
    if (seen_[here_].name == name) return seen_[here_];
    const voxel_key c{k.x >> detail::chunk_level, k.y >> detail::chunk_level, k.z >> detail::chunk_level};
    here_ = (c.x & 3U) | (c.y & 3U) << 2U | (c.z & 3U) << 4U;
    seen_chunk& here = seen_[here_];
    if (here.name != name) here = {name, 0, reader_.store().find_chunk(k), 0};
    if (++here.visits == enough_visits) {
      const voxel_key low = node_key(k, detail::chunk_level);
      for (std::uint32_t place = 0; place != 64; ++place) {
        const voxel_key offset = detail::brick_in_chunk(place);
        const bool passable = is_passable_brick(here, {low.x + offset.x, low.y + offset.y, low.z + offset.z}, place);
        here.passable |= std::uint64_t{passable} << place;
      }
    }
    return here;
  }
  [[nodiscard]] bool is_passable_brick(const seen_chunk& c, const voxel_key& k, std::uint32_t place) const noexcept {
    const detail::brick<value_type>* const b = c.content == nullptr ? nullptr : reader_.store().find(*c.content, place);
    if (b == nullptr) {
      const value_type* const large = reader_.store().find_large_value(k);
      return large == nullptr ? options_.ignore_unknown : !is_occupied<Model>(*large);
    }
    const unsigned present = b->uniform | b->dense;
    bool passable = options_.ignore_unknown || b->uniform == 0xff;
    for (unsigned i = 0; i != 8; ++i) passable &= (present >> i & 1U) == 0 || b->value[i] < Model::occupancy_threshold;
    return passable;
  }

  /// Ray parameter up to which no voxel's centre is out of range. A centre is at most 0.87 voxels away from the point
  /// where the ray enters the voxel; floats are rounded to 6e-8 of their magnitude.
  [[nodiscard]] double surely_in_range(const detail::float3& origin) const noexcept {
    if (!(options_.max_range > 0.0)) return std::numeric_limits<double>::infinity();
    double far = options_.max_range;
    for (const float o : origin) far += std::fabs(static_cast<double>(o));
    return options_.max_range - grid_.resolution() - 1e-6 * far;
  }
  [[nodiscard]] bool is_out_of_range(const detail::float3& origin, const voxel_key& k) const noexcept {
    const vec3 center = grid_.center(k);
    double squares = 0.0;
    for (int i = 0; i != 3; ++i) {
      const float away = static_cast<float>(center[i]) - origin[static_cast<std::size_t>(i)];
      squares += static_cast<double>(rounded_product(away, away));
    }
    return options_.max_range > 0.0 && squares > options_.max_range * options_.max_range;
  }

  detail::store_reader<value_type> reader_;
  voxel_grid grid_;
  ray_options options_;
  std::array<seen_chunk, chunks_kept> seen_{};
  std::size_t here_ = 0;  ///< index of the last chunk that was looked up
};

/// Casts many rays: sets `out[i]` to the result for the ray from `origins[i]` along `directions[i]`. The result is the
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
