// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Memory for the bilinear resize.
#pragma once

#include <cstdint>
#include <vector>

namespace orbis::features::detail {

/// Table for resizing rows from one width to another; computed once, reused for all images.
struct resize_plan {
  int from = 0, to = 0;  ///< widths
  // For each pixel of the result, padded to whole blocks: its position is between `first` and the next pixel.
  std::vector<std::int32_t> first;
  std::vector<std::uint16_t> weight;  ///< weight of the next pixel, in units of 1/256
  // For each group of eight result pixels; empty if their source pixels do not fit into sixteen.
  std::vector<std::int32_t> base;    ///< start of the sixteen pixels
  std::vector<std::uint8_t> places;  ///< pairs of bytes: `first` - `base`, then 0x80, which selects zero
};

/// Reusable memory for `resize`.
struct resize_workspace {
  resize_plan plan;
  std::vector<std::uint16_t> rows;  ///< two source rows, resized horizontally
};

}  // namespace orbis::features::detail
