// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Collision tests for planners: overlap of a box, a sphere or a capsule with occupied space.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>

#include <orbis/core/types.hpp>
#include <orbis/octree/accessor.hpp>
#include <orbis/octree/detail/storage/leaves.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree {

/// A solid sphere; centre and radius in metres. @pre radius >= 0
struct sphere {
  vec3 center = zeros<vec3>();
  double radius = 0.0;
};
/// All points within `radius` of the segment from `a` to `b`, metres. @pre radius >= 0
struct capsule {
  vec3 a = zeros<vec3>(), b = zeros<vec3>();
  double radius = 0.0;
};

[[nodiscard]] inline bounding_box bounds_of(const bounding_box& b) { return b; }
[[nodiscard]] inline bounding_box bounds_of(const sphere& s) {
  return {shifted(s.center, -s.radius), shifted(s.center, s.radius)};
}
[[nodiscard]] inline bounding_box bounds_of(const capsule& c) {
  return {shifted(entrywise_min(c.a, c.b), -c.radius), shifted(entrywise_max(c.a, c.b), c.radius)};
}

/// Point of a box that is nearest to `p`.
[[nodiscard]] inline vec3 clamped(const vec3& p, const bounding_box& b) {
  return entrywise_min(entrywise_max(p, b.min), b.max);
}

/// Returns true if a shape and a box have a point in common, including faces and corners.
[[nodiscard]] inline bool touches(const bounding_box& a, const bounding_box& b) noexcept {
  return all_at_most(a.min, b.max) && all_at_most(b.min, a.max);
}
[[nodiscard]] inline bool touches(const sphere& s, const bounding_box& b) noexcept {
  const vec3 nearest = clamped(s.center, b);
  return squared_norm(s.center - nearest) <= s.radius * s.radius;
}
namespace detail {
/// Exact test for the cases that the quick tests of `touches` below do not decide.
[[nodiscard]] inline bool touches_exactly(const capsule& c, const bounding_box& b) noexcept {
  const vec3 along = c.b - c.a;
  // The squared distance of a + t (b - a) from the box is convex in t, and its slope is linear between the parameters
  // at which the segment crosses the planes of the faces: find the piece in which the slope is 0.
  const auto away = [&](double t) -> vec3 {
    const vec3 p = c.a + t * along;
    return p - clamped(p, b);
  };
  std::array<double, 8> knots{0.0, 1.0};
  std::size_t count = 2;
  for (int i = 0; i != 3; ++i)
    for (const double face : {b.min[i], b.max[i]}) {
      const double t = (face - c.a[i]) / along[i];
      if (!(t > 0.0 && t < 1.0)) continue;
      std::size_t place = count++;
      for (; knots[place - 1] > t; --place) knots[place] = knots[place - 1];
      knots[place] = t;
    }
  double best = 0.0, slope = dot(away(0.0), along);
  for (std::size_t i = 1; i != count && slope < 0.0; ++i) {
    const double next = dot(away(knots[i]), along);
    const double share = next > 0.0 ? slope / (slope - next) : 1.0;
    best = knots[i - 1] + share * (knots[i] - knots[i - 1]);
    slope = next;
  }
  return squared_norm(away(best)) <= c.radius * c.radius;
}
}  // namespace detail

[[nodiscard]] inline bool touches(const capsule& c, const bounding_box& b) noexcept {
  // The circumscribed and the inscribed ball of the box decide most cases.
  const vec3 middle = 0.5 * (b.min + b.max), half = b.max - middle, along = c.b - c.a, from = middle - c.a;
  const double squares = squared_norm(along), product = dot(from, along);
  // Point of the segment nearest to the centre of the box: the start, the end, or a point in between.
  const double share = product <= 0.0 ? 0.0 : product >= squares ? 1.0 : product / squares;
  const double apart = squared_norm(from - share * along);
  const double outside = (c.radius + 1.7320508075688773 * max_entry(half)) * (1.0 + 1e-9);
  if (apart > outside * outside) return false;
  const double inside = (c.radius + min_entry(half)) * (1.0 - 1e-9);
  if (apart < inside * inside) return true;
  // The nearest point of the segment may be near enough to the box; otherwise the plane through the nearest point of
  // the box, perpendicular to the line between these points, may separate both ends from the box. If `c` is a ball, one
  // of the two holds, up to rounding.
  const vec3 point = c.a + share * along, nearest = clamped(point, b), way = point - nearest;
  const double squared = squared_norm(way), reach = c.radius * c.radius;
  if (squared < reach * (1.0 - 1e-9)) return true;
  const double gap = std::min(dot(c.a - nearest, way), dot(c.b - nearest, way));
  if (gap > 0.0 && gap * gap > reach * squared * (1.0 + 1e-9)) return false;
  return detail::touches_exactly(c, b);
}

/// A shape for overlap tests: `bounds_of(shape)` returns a box around it, `touches(shape, box)` returns true if it has
/// a point in common with a box. For a custom shape, define both functions in its namespace.
template <class S>
concept overlap_shape = requires(const S& shape, const bounding_box& box) {
  { bounds_of(shape) } -> std::convertible_to<bounding_box>;
  { touches(shape, box) } -> std::convertible_to<bool>;
};

struct overlap_options {
  occupancy unknown = occupancy::free;  ///< state assumed for unknown space and all space outside the grid
};

namespace detail {

/// Descends the tree around the shape, into nodes that may contain a blocking voxel.
template <sensor_model Model, overlap_shape Shape>
class overlap_search {
 public:
  using T = typename Model::value_type;

  overlap_search(const brick_store<T>& store, const voxel_grid& grid, const Shape& shape, bool unknown_blocks)
      : store_{store}, grid_{grid}, shape_{shape}, unknown_blocks_{unknown_blocks} {}

  [[nodiscard]] bool run() const {
    const bounding_box bounds = bounds_of(shape_);
    const double edge = grid_.resolution() * (grid_.cells() / 2);
    const bool is_inside = all_at_most(filled<vec3>(-edge), bounds.min) && all_at_most(bounds.max, filled<vec3>(edge));
    if (unknown_blocks_ && !is_inside) return true;
    // The box is extended by one voxel to include voxels that only touch it.
    const auto keys =
        keys_between(grid_, shifted(bounds.min, -grid_.resolution()), shifted(bounds.max, grid_.resolution()));
    if (!keys) return false;
    bool found = false;
    store_.for_each_large([&](std::uint64_t name, T v) {
      found = found || (is_occupied<Model>(v) && meets(named_key(name), named_level(name)));
    });
    if (found || unknown_blocks_ || chunks_in(*keys) < static_cast<double>(store_.chunk_count()))
      return found || from_common_node(*keys);
    store_.for_each_chunk([&](const auto& c) {
      const voxel_key k = named_key(c.name);
      found = found || (keys->overlaps(k, chunk_level) && meets(k, chunk_level) && chunk(*keys, k));
    });
    return found;
  }

 private:
  [[nodiscard]] bool meets(const voxel_key& k, int level) const { return touches(shape_, node_cube(grid_, k, level)); }

  [[nodiscard]] static double chunks_in(const key_box& keys) noexcept {
    const auto along = [](std::uint32_t a, std::uint32_t b) { return (b >> chunk_level) - (a >> chunk_level) + 1.0; };
    return along(keys.low.x, keys.high.x) * along(keys.low.y, keys.high.y) * along(keys.low.z, keys.high.z);
  }
  /// Searches below the smallest node that contains all keys and is at least as large as a chunk.
  [[nodiscard]] bool from_common_node(const key_box& keys) const {
    const std::uint32_t differ = (keys.low.x ^ keys.high.x) | (keys.low.y ^ keys.high.y) | (keys.low.z ^ keys.high.z);
    const int level = std::max(chunk_level, static_cast<int>(std::bit_width(differ)));
    return upper(keys, node_key(keys.low, level), level);
  }
  [[nodiscard]] bool upper(const key_box& keys, const voxel_key& k, int level) const {
    if (!keys.overlaps(k, level) || !meets(k, level)) return false;
    if (level == chunk_level) return chunk(keys, k);
    // Occupied large leaves were already tested.
    if (const auto large = store_.find_large(k); large && large->second >= level) return false;
    for (unsigned i = 0; i != 8; ++i)
      if (upper(keys, child_key(k, i, node_cells(level - 1)), level - 1)) return true;
    return false;
  }
  [[nodiscard]] bool chunk(const key_box& keys, const voxel_key& k) const {
    const auto* const c = store_.find_chunk(k);
    if (c == nullptr && !store_.has_large()) return unknown_blocks_;
    if (c == nullptr && !unknown_blocks_) return false;
    const auto from = [&](std::uint32_t low, std::uint32_t first) { return std::max(low & ~7U, first); };
    const auto to = [&](std::uint32_t high, std::uint32_t first) {
      return std::min(high, first + node_cells(chunk_level) - 1);
    };
    for (std::uint32_t z = from(keys.low.z, k.z); z <= to(keys.high.z, k.z); z += 8)
      for (std::uint32_t y = from(keys.low.y, k.y); y <= to(keys.high.y, k.y); y += 8)
        for (std::uint32_t x = from(keys.low.x, k.x); x <= to(keys.high.x, k.x); x += 8) {
          const voxel_key key{x, y, z};
          const brick<T>* const b = c == nullptr ? nullptr : store_.find(*c, place_in_chunk(key));
          const bool blocks = b != nullptr ? may_block(*b) : unknown_blocks_ && store_.find_large_value(key) == nullptr;
          if (!blocks || !meets(key, brick_level)) continue;
          if (b == nullptr || in_brick(*b, keys, key)) return true;
        }
    return false;
  }
  [[nodiscard]] bool may_block(const brick<T>& b) const noexcept {
    bool may = unknown_blocks_ && b.uniform != 0xff;
    for (unsigned i = 0; i != 8; ++i)
      may = may || (((b.uniform | b.dense) >> i & 1U) != 0 && is_occupied<Model>(b.value[i]));
    return may;
  }
  [[nodiscard]] bool in_brick(const brick<T>& b, const key_box& keys, const voxel_key& key) const {
    for (std::uint32_t i = 0; i != 8; ++i) {
      const voxel_key octant = child_key(key, i, node_cells(octant_level));
      if (!keys.overlaps(octant, octant_level)) continue;
      const bool is_known = ((b.uniform | b.dense) >> i & 1U) != 0;
      std::uint64_t blocking = 0;
      if (is_known && is_occupied<Model>(b.value[i])) blocking = store_.voxels_where(b, i, is_occupied<Model>);
      if (unknown_blocks_) blocking |= ~store_.known(b, i);
      if (blocking == 0 || !meets(octant, octant_level)) continue;
      if (blocking == ~std::uint64_t{0}) return true;
      for (unsigned eighth = 0; eighth != 8; ++eighth) {  // 2x2x2 voxels are contiguous along the Morton curve
        std::uint64_t voxels = blocking & (std::uint64_t{0xff} << (8 * eighth));
        if (voxels == 0) continue;
        const bool are_few = std::popcount(voxels) <= 2;
        if (!are_few && !meets(child_key(octant, eighth, 2), 1)) continue;
        if (std::popcount(voxels) == 8) return true;
        for (; voxels != 0; voxels &= voxels - 1)
          if (meets(voxel_in_octant(octant, static_cast<std::uint32_t>(std::countr_zero(voxels))), 0)) return true;
      }
    }
    return false;
  }

  const brick_store<T>& store_;
  const voxel_grid& grid_;
  const Shape& shape_;
  bool unknown_blocks_;
};

}  // namespace detail

/// Returns true if the shape has a point in common with an occupied voxel, or with unknown space if that counts as
/// occupied. The cubes of voxels include their faces, so that touching counts as overlapping. Skips nodes without
/// occupied voxels. @pre finite coordinates
template <octree_map Map, overlap_shape Shape>
[[nodiscard]] bool overlaps(const Map& map, const Shape& shape, const overlap_options& options = {}) {
  assert(all_finite(bounds_of(shape).min) && all_finite(bounds_of(shape).max));
  using search = detail::overlap_search<typename Map::model, Shape>;
  return search{map.store(), map.grid(), shape, options.unknown == occupancy::occupied}.run();
}

}  // namespace orbis::octree
