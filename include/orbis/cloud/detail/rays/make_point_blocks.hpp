// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The blocks of a cloud's points.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <span>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/cloud/detail/rays/point_blocks.hpp>
#include <orbis/core/execution.hpp>

namespace orbis::cloud::detail {

/// In the order of `leaf_order`. O(n), 16 bytes for each point, also while at work; the same for every
/// policy. Coordinates are taken as float. @pre fewer than 2^32 points
template <execution_policy Policy>
[[nodiscard]] point_blocks make_point_blocks(const Policy& policy, const point_view& points) {
  constexpr std::size_t size = point_blocks::block_size;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  leaf_order order{policy, points, std::numeric_limits<std::size_t>::max()};
  point_blocks out;
  out.index.reserve(order.entries().size());
  for (const auto& entry : order.entries()) out.index.push_back(entry.index);
  order.drop_entries();
  if (out.index.empty()) return out;
  const std::size_t count = (out.index.size() + size - 1) / size;
  for (auto& axis : out.axis) axis.resize(count * size, nan);
  out.blocks.resize(count);
  for_each_index(policy, count, 32, [&](std::size_t b) {
    point_blocks::box box{{inf, inf, inf}, {-inf, -inf, -inf}};
    for (std::size_t i = b * size; i != std::min(out.index.size(), (b + 1) * size); ++i) {
      const auto p = order.position(out.index[i]);
      for (std::size_t a = 0; a != 3; ++a) {
        out.axis[a][i] = p[a];
        box.low[a] = std::min(box.low[a], p[a]);
        box.high[a] = std::max(box.high[a], p[a]);
      }
    }
    out.blocks[b] = box;
  });
  for (std::size_t b = 0; b < count; b += point_blocks::group_size) {
    const std::size_t end = std::min(count, b + point_blocks::group_size);
    out.groups.push_back(hull_of(std::span{out.blocks}.subspan(b, end - b)));
  }
  return out;
}

}  // namespace orbis::cloud::detail
