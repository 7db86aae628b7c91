// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A cloud in blocks of neighbouring points with bounding boxes, for passes that can skip whole blocks.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace orbis::cloud::detail {

/// The finite points of a cloud in the order of a space-filling curve, axis by axis. `block_size` consecutive points
/// form a block, and `group_size` blocks form a group. The last block is padded with NaN.
struct point_blocks {
  static constexpr std::size_t block_size = 128;
  static constexpr std::size_t group_size = 16;

  struct box {
    std::array<float, 3> low;
    std::array<float, 3> high;
  };

  std::array<std::vector<float>, 3> axis{};  ///< metres
  std::vector<std::uint32_t> index{};        ///< index in the cloud; one per finite point
  std::vector<box> blocks{};
  std::vector<box> groups{};
};

/// Bounding box of several boxes. @pre boxes is not empty
[[nodiscard]] inline point_blocks::box enclosing_box(std::span<const point_blocks::box> boxes) {
  point_blocks::box hull = boxes.front();
  for (const point_blocks::box& b : boxes) {
    for (std::size_t a = 0; a != 3; ++a) {
      hull.low[a] = std::min(hull.low[a], b.low[a]);
      hull.high[a] = std::max(hull.high[a], b.high[a]);
    }
  }
  return hull;
}

}  // namespace orbis::cloud::detail
