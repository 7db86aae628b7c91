// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The part of a cloud that a filter kept.
#pragma once

#include <cassert>
#include <cstdint>
#include <span>

#include <orbis/core/point_cloud.hpp>

namespace orbis::cloud {

/// A copy of the points, and colours if there are any, with the given indices, in their order.
/// @pre every index < cloud.size()
[[nodiscard]] inline point_cloud extract(const point_cloud& cloud, std::span<const std::uint32_t> indices) {
  point_cloud out;
  out.points.reserve(indices.size());
  if (cloud.has_colors()) out.colors.reserve(indices.size());
  for (const std::uint32_t i : indices) {
    assert(i < cloud.size());
    out.points.push_back(cloud.points[i]);
    if (cloud.has_colors()) out.colors.push_back(cloud.colors[i]);
  }
  return out;
}

}  // namespace orbis::cloud
