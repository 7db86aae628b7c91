// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Traversal of the voxels along a ray.
///
/// J. Amanatides, A. Woo, "A fast voxel traversal algorithm for ray tracing", Eurographics 1987, with the arithmetic of
/// OctoMap (direction and length in float, parameters in double, ties to the last axis), so that the voxels are
/// identical.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// A point with the precision that OctoMap uses.
using float3 = std::array<float, 3>;

[[nodiscard]] inline float3 difference(const float3& a, const float3& b) noexcept {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}
/// Length of `v`, with the sum of squares in float and the square root in double.
[[nodiscard]] inline double length(const float3& v) noexcept {
  const float squares = rounded_product(v[0], v[0]) + rounded_product(v[1], v[1]) + rounded_product(v[2], v[2]);
  return std::sqrt(static_cast<double>(squares));
}

/// State of a ray traversal: the voxel, and for each axis the ray parameter (metres) at which the ray leaves the voxel.
struct ray_traversal {
  std::array<std::uint32_t, 3> at{};
  std::array<std::int32_t, 3> step{};
  std::array<double, 3> next{};
  std::array<double, 3> delta{};
  double reach = 0.0;     ///< length of the ray, if it has an end
  std::uint32_t cells{};  ///< width of the grid along each axis, in voxels

  /// `half`: offset from a voxel's centre to its face, as a function of the step's sign.
  template <class Half>
  ray_traversal(const voxel_grid& grid, const voxel_key& start, const float3& origin, const float3& direction,
                Half&& half) noexcept
      : at{start.x, start.y, start.z}, cells{grid.cells()} {
    for (std::size_t i = 0; i != 3; ++i) {
      step[i] = direction[i] > 0.0F ? 1 : direction[i] < 0.0F ? -1 : 0;
      if (step[i] != 0) {
        const double face = grid.center(at[i]) + half(step[i]);
        next[i] = (face - static_cast<double>(origin[i])) / static_cast<double>(direction[i]);
        delta[i] = grid.resolution() / std::fabs(static_cast<double>(direction[i]));
      } else {
        next[i] = delta[i] = std::numeric_limits<double>::max();
      }
    }
  }

  /// Returns the state at the start of the ray from `origin` in voxel `from` to `end`; empty if the ray is too short or
  /// too long for its direction to be represented in float.
  [[nodiscard]] static std::optional<ray_traversal> between(const voxel_grid& grid, const voxel_key& from,
                                                            const float3& origin, const float3& end) noexcept {
    float3 direction = difference(end, origin);
    const auto reach = static_cast<float>(length(direction));
    if (!(reach > 0.0F && std::isfinite(reach))) return std::nullopt;
    for (float& d : direction) d /= reach;
    const double half = 0.5 * grid.resolution();
    ray_traversal cursor{grid, from, origin, direction,
                         [&](std::int32_t step) { return static_cast<double>(static_cast<float>(step * half)); }};
    cursor.reach = static_cast<double>(reach);
    return cursor;
  }

  /// Axis of the next face.
  [[nodiscard]] std::size_t axis() const noexcept {
    if (next[0] < next[1]) return next[0] < next[2] ? 0 : 2;
    return next[1] < next[2] ? 1 : 2;
  }
  /// Returns true if a step along `axis` stays inside the grid.
  [[nodiscard]] bool can_step(std::size_t axis) const noexcept {
    return at[axis] + static_cast<std::uint32_t>(step[axis]) < cells;
  }
  void advance(std::size_t axis) noexcept {
    at[axis] += static_cast<std::uint32_t>(step[axis]);
    next[axis] += delta[axis];
  }
  [[nodiscard]] voxel_key key() const noexcept { return {at[0], at[1], at[2]}; }
};

/// Calls `visit(key)` for the voxels that a ray from `origin` to `end` crosses, including the voxel of the origin but
/// not that of the end; makes no call if both are in one voxel.
/// @pre from and to are the keys of origin and end
template <class Visit>
void traverse_ray(const voxel_grid& grid, const float3& origin, const voxel_key& from, const float3& end,
                  const voxel_key& to, Visit&& visit) {
  if (from == to) return;
  visit(from);
  auto cursor = ray_traversal::between(grid, from, origin, end);
  if (!cursor) return;
  for (;;) {
    const std::size_t axis = cursor->axis();
    if (!cursor->can_step(axis)) return;
    cursor->advance(axis);
    if (cursor->key() == to) return;
    // Due to rounding, the traversal may miss the end voxel; it then ends at the length of the ray.
    if (std::min(std::min(cursor->next[0], cursor->next[1]), cursor->next[2]) > cursor->reach) return;
    visit(cursor->key());
  }
}

/// Marks the voxels that the ray crosses as free, see traverse_ray.
inline void mark_ray(scan_masks& masks, const voxel_grid& grid, const float3& origin, const voxel_key& from,
                     const float3& end, const voxel_key& to) {
  voxel_key last{~std::uint32_t{0}, 0, 0};  // in no brick
  std::uint64_t* free = nullptr;
  traverse_ray(grid, origin, from, end, to, [&](const voxel_key& k) {
    if ((((k.x ^ last.x) | (k.y ^ last.y) | (k.z ^ last.z)) >> 3U) != 0) {
      free = masks.at(k).free.data();
      last = k;
    }
    const std::uint32_t place = place_in_brick(k);
    free[place >> 6U] |= std::uint64_t{1} << (place & 63U);
  });
}

}  // namespace orbis::octree::detail
