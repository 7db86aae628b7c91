// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A cloud in blocks of neighbouring points with bounding boxes, for passes that can skip whole blocks.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <ranges>
#include <span>
#include <vector>

#include <orbis/cloud/detail/knn/leaf_hierarchy.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>

namespace orbis::cloud::detail {

/// The finite points of a cloud, along a space-filling curve, axis by axis; `block_size` consecutive
/// ones make a block, `group_size` blocks a group. The last block is filled up with NaN.
struct point_blocks {
  static constexpr std::size_t block_size = 128;
  static constexpr std::size_t group_size = 16;

  struct box {
    std::array<float, 3> low;
    std::array<float, 3> high;
  };

  std::array<std::vector<float>, 3> axis{};  ///< metres
  std::vector<std::uint32_t> index{};        ///< which point of the cloud; as many as finite points
  std::vector<box> blocks{};
  std::vector<box> groups{};
};

/// @pre boxes is not empty
[[nodiscard]] inline point_blocks::box hull_of(std::span<const point_blocks::box> boxes) {
  point_blocks::box hull = boxes.front();
  for (const point_blocks::box& b : boxes) {
    for (std::size_t a = 0; a != 3; ++a) {
      hull.low[a] = std::min(hull.low[a], b.low[a]);
      hull.high[a] = std::max(hull.high[a], b.high[a]);
    }
  }
  return hull;
}

/// In the order of `leaf_order`. O(n), 16 bytes for each point, also while at work; the same for every
/// policy. Coordinates are taken as float. @pre fewer than 2^32 points
template <execution_policy Policy, point_range Points>
[[nodiscard]] point_blocks make_point_blocks(const Policy& policy, const Points& points) {
  constexpr std::size_t size = point_blocks::block_size;
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  constexpr float inf = std::numeric_limits<float>::infinity();
  leaf_order<Points> order{policy, points, std::numeric_limits<std::size_t>::max()};
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
