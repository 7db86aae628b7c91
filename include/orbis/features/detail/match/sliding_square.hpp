// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How unlike a square of pixels is to those that a strip shows at each shift: what it is, without its code.
#pragma once

#include <cstddef>
#include <cstdint>

namespace orbis::features::detail {

/// Rows of pixels in an image.
struct pixel_rows {
  const std::uint8_t* first = nullptr;
  std::ptrdiff_t stride = 0;  ///< from row to row
  int readable = 0;           ///< pixels of each row, what lies behind those that are asked for included
};

/// A square of `side` x `side` pixels, and the strip of as many rows along which it slides.
struct sliding_square {
  static constexpr int max_side = 31, max_shifts = 32;

  int side = 0;
  pixel_rows square;  ///< with `side` readable pixels or more
  pixel_rows strip;   ///< likewise `side` + `shifts` - 1
};

/// `sums[k]` becomes four times the sum of absolute differences between the square and the strip from column `k` on,
/// each less its mean (to a quarter of a grey value), for k < `shifts`. Writes a multiple of 16 sums, of which those
/// from `shifts` on mean nothing. @pre 1 <= side <= max_side, 1 <= shifts <= max_shifts
void slide_differences(const sliding_square& s, int shifts, std::int32_t* sums);

}  // namespace orbis::features::detail
