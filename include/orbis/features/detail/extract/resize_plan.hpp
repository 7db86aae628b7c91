// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The memory of bilinear shrinking.
#pragma once

#include <cstdint>
#include <vector>

namespace orbis::features::detail {

/// How to get from one width to another; made once, used for any number of images.
struct resize_plan {
  int from = 0, to = 0;  ///< widths
  // Of each pixel of the result, up to a whole number of blocks: it lies between `first` and the pixel after it.
  std::vector<std::int32_t> first;
  std::vector<std::uint16_t> weight;  ///< of the pixel after it, in 1/256
  // Of each eight pixels of the result; empty where they do not lie within sixteen pixels of the source.
  std::vector<std::int32_t> base;    ///< where the sixteen begin
  std::vector<std::uint8_t> places;  ///< of each `first` in them, as the low byte of a word whose high byte gives zero
};

/// Memory of `resize`, which the next call uses again.
struct resize_workspace {
  resize_plan plan;
  std::vector<std::uint16_t> rows;  ///< two of the source, shrunk horizontally
};

}  // namespace orbis::features::detail
