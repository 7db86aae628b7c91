// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Random sampling of the points of a scan.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

namespace orbis::octree::detail {

/// Returns a random position in the k-th of `stretches` equal parts of [0, last]. Randomness avoids aliasing between
/// regular steps and the rows of a scan.
[[nodiscard]] inline std::size_t place_in_stretch(std::size_t k, std::size_t stretches, std::size_t last,
                                                  random_bits& random) {
  const double place = (static_cast<double>(k) + random.uniform()) * static_cast<double>(last);
  return std::min(static_cast<std::size_t>(place / static_cast<double>(stretches)), last);
}
/// Returns the length of the ray to a point, at most `limit` (metres), and stores its direction (length 1) in
/// `direction`. Empty if the point is the origin, not finite or very far away.
[[nodiscard]] inline std::optional<double> length_of_ray(const float3& origin, const float3& p, double limit,
                                                         vec3& direction) {
  for (std::size_t axis = 0; axis != 3; ++axis)
    direction[static_cast<int>(axis)] = static_cast<double>(p[axis]) - static_cast<double>(origin[axis]);
  const double length = norm(direction);
  if (!(length > 0.0 && length < 1e30)) return std::nullopt;
  direction /= length;
  return std::min(length, limit);
}

}  // namespace orbis::octree::detail
