// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a ray through the map meets first, as OctoMap's `castRay` answers it.
#pragma once

#include <cmath>
#include <limits>

#include <orbis/octree/brick.hpp>
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
  vec3 point = vec3::Zero();  ///< the centre of the voxel where it ended, metres

  /// Whether something occupied was hit.
  [[nodiscard]] explicit operator bool() const noexcept { return end == ray_end::hit; }
};

/// Walks from `origin` along `direction` (any length) until a voxel is occupied, or unknown unless
/// `ignore_unknown`, or further away than `max_range` metres (infinity or <= 0: no limit but the grid).
template <sensor_model Model>
[[nodiscard]] ray_hit cast_ray(const brick_store<typename Model::value_type>& store, const voxel_grid& grid,
                               const float3& origin, float3 direction, double max_range, bool ignore_unknown) {
  const auto start = grid.key(origin);
  if (!start) return {};
  const double norm = length(direction);
  if (norm > 0.0)
    for (float& d : direction) d /= static_cast<float>(norm);

  const auto stop_at = [&](const voxel_key& k) -> std::optional<ray_end> {
    const auto value = store.value(k);
    if (!value) return ignore_unknown ? std::nullopt : std::optional{ray_end::unknown};
    return is_occupied<Model>(*value) ? std::optional{ray_end::hit} : std::nullopt;
  };
  if (const auto stop = stop_at(*start)) return {*stop, grid.center(*start)};

  ray_cursor cursor{grid, *start, origin, direction, [&](std::int32_t step) { return step * grid.resolution() * 0.5; }};
  const bool moves = cursor.step[0] != 0 || cursor.step[1] != 0 || cursor.step[2] != 0;
  if (!moves || !std::isfinite(norm)) return {ray_end::no_direction, grid.center(*start)};
  for (;;) {
    const std::size_t axis = cursor.axis();
    if (!cursor.can_step(axis)) return {ray_end::out_of_grid, grid.center(cursor.key())};
    cursor.advance(axis);
    const vec3 center = grid.center(cursor.key());
    if (max_range > 0.0) {
      double squares = 0.0;
      for (int i = 0; i != 3; ++i) {
        const float away = static_cast<float>(center[i]) - origin[static_cast<std::size_t>(i)];
        squares += static_cast<double>(away * away);
      }
      if (squares > max_range * max_range) return {ray_end::out_of_range, center};
    }
    if (const auto stop = stop_at(cursor.key())) return {*stop, center};
  }
}

}  // namespace orbis::octree
