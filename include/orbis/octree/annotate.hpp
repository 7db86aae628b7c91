// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Colours, labels, counts of the points of a scan, into a layer beside the map.
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <optional>
#include <ranges>

#include <orbis/core/point.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key_box.hpp>
#include <orbis/octree/voxel_layer.hpp>

namespace orbis::octree {

/// Calls `update(payload, i)` with the payload of the voxel that holds point i, made if need be, for
/// every point that is finite, within range of `origin` (`max_range`, `beam_ranges`) and within
/// `bounds`, in their order. Give it what `integrate` got. Returns the number of those points.
///
/// @code
///   map.integrate(points, origin, options);
///   annotate(colors, map.grid(), points, origin, options, [&](rgb_mean& c, std::size_t i) { c.update(rgb[i]); });
/// @endcode
template <voxel_payload T, point_range Points, point_like Origin, std::invocable<T&, std::size_t> Update>
std::size_t annotate(voxel_layer<T>& layer, const voxel_grid& grid, const Points& points, const Origin& origin,
                     const integration_options& options, Update&& update) {
  assert(options.beam_ranges.empty() || options.beam_ranges.size() == std::ranges::size(points));
  const float3 from = coordinates<float>(origin);
  const auto box = options.bounds ? keys_between(grid, options.bounds->min, options.bounds->max)
                                  : std::optional{key_box{{}, {~0U, ~0U, ~0U}}};
  if (!box) return 0;
  std::size_t i = 0, used = 0;
  for (const auto& p : points) {
    const std::size_t number = i++;
    const float3 end = coordinates<float>(p);
    const double distance = length(difference(end, from));
    const bool within = distance <= options.max_range &&
                        (options.beam_ranges.empty() ||
                         distance <= static_cast<double>(options.beam_ranges[number]));
    const auto key = within ? grid.key(end) : std::nullopt;
    if (!key || !box->overlaps(*key, 0)) continue;
    update(layer.make(*key), number);
    ++used;
  }
  return used;
}

}  // namespace orbis::octree
