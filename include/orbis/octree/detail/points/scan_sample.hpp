// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Some points of a scan that stand for all.
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include <orbis/core/random.hpp>
#include <orbis/core/types.hpp>
#include <orbis/octree/detail/points/ray_traversal.hpp>

namespace orbis::octree::detail {

/// Somewhere in the k-th of so many equal stretches of [0, last]. At random: regular steps and the rows of a scan get
/// into step.
[[nodiscard]] inline std::size_t place_in_stretch(std::size_t k, std::size_t stretches, std::size_t last,
                                                  random_bits& random) {
  const double place = (static_cast<double>(k) + random.uniform()) * static_cast<double>(last);
  return std::min(static_cast<std::size_t>(place / static_cast<double>(stretches)), last);
}
/// The ray to a point: how long it is, at most `limit` (metres), and in `direction` which way it goes (of length 1).
/// Empty if there is no such ray: the point is the origin, not finite or very far away.
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
