// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Table of the distance field kernels; slice_kernels.hpp implements them for each instruction set.
#pragma once

#include <array>
#include <cstdint>

namespace orbis::nav::detail {

/// Maximum reach of a field, in voxels: its square is less than `far_away`.
inline constexpr int max_reach = 181;
/// The value of a voxel that is farther from all obstacles than the field's reach.
inline constexpr std::uint16_t far_away = 0x7fff;
/// Stands for "no offer" in a slice_offer: with or without a square added, it exceeds every value of a voxel.
inline constexpr std::uint16_t no_offer = 0x8000;

/// Values of 8x8 voxels, at index y * 8 + x.
using slice = std::array<std::uint16_t, 64>;

/// The offer of a slice to neighbouring slices.
struct slice_offer {
  alignas(64) slice value;
  std::uint16_t least = no_offer;  ///< smallest of the values
};

/// Pointers to the kernels of the same names.
struct slice_code {
  void (*choose_offer)(const std::uint16_t* from, const std::uint16_t* other, slice_offer* offer);
  unsigned (*equal_slices)(const std::uint16_t* targets, const std::uint16_t* tops, const slice_offer* offer, int from,
                           int first, int last, unsigned skip);
  void (*lower_slices)(std::uint16_t* targets, std::uint16_t* tops, const slice_offer* offer, int from, int first,
                       int last, unsigned skip, std::uint16_t bound);
  bool (*equal_rows)(const std::uint16_t* target, const slice_offer* offer, const std::uint16_t* squares);
  bool (*lower_rows)(const std::uint16_t* target, const slice_offer* offer, const std::uint16_t* squares,
                     std::uint16_t bound, std::uint16_t* lowered, std::uint16_t* top);
  std::uint16_t (*add_rows)(std::uint16_t* best, const std::uint8_t* rows, const std::uint16_t* squares);
  std::uint16_t (*combine_slices)(const std::uint16_t* own, const std::uint16_t* const* below,
                                  const std::uint16_t* const* above, int count, std::uint16_t bound,
                                  std::uint16_t* out);
};

}  // namespace orbis::nav::detail
