// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Neighbours of voxels in masks of octants of 4x4x4 voxels.
#pragma once

#include <array>
#include <cstdint>

namespace orbis::nav::detail {

// Bit i is the voxel at index i of the Morton curve: along `axis` (0: x), the low bit of its coordinate is bit `axis`
// of i, the high bit is bit `axis + 3`. The indices of successive voxels therefore differ by 1, 7 and 1 times 2^axis,
// and the index of the last one is 9 times 2^axis greater than that of the first.

/// The voxels with an even coordinate along the axis.
inline constexpr std::array<std::uint64_t, 3> even_voxels{0x5555555555555555, 0x3333333333333333, 0x0f0f0f0f0f0f0f0f};
/// The voxels in the lower half along the axis.
inline constexpr std::array<std::uint64_t, 3> lower_half{0x00ff00ff00ff00ff, 0x0000ffff0000ffff, 0x00000000ffffffff};

/// The voxels of the lowest (highest) layer along the axis.
[[nodiscard]] constexpr std::uint64_t lowest_layer(unsigned axis) noexcept {
  return even_voxels[axis] & lower_half[axis];
}
[[nodiscard]] constexpr std::uint64_t highest_layer(unsigned axis) noexcept {
  return ~even_voxels[axis] & ~lower_half[axis];
}
/// Each voxel's upper neighbour along the axis, if it lies in the octant.
[[nodiscard]] constexpr std::uint64_t moved_up(std::uint64_t m, unsigned axis) noexcept {
  return (m & even_voxels[axis]) << (1U << axis) | (m & ~even_voxels[axis] & lower_half[axis]) << (7U << axis);
}
/// Each voxel's lower neighbour along the axis, if it lies in the octant.
[[nodiscard]] constexpr std::uint64_t moved_down(std::uint64_t m, unsigned axis) noexcept {
  return (m & ~even_voxels[axis]) >> (1U << axis) | (m & even_voxels[axis] & ~lower_half[axis]) >> (7U << axis);
}
/// The upper neighbours in the next octant.
[[nodiscard]] constexpr std::uint64_t spilled_up(std::uint64_t m, unsigned axis) noexcept {
  return (m & highest_layer(axis)) >> (9U << axis);
}
/// The lower neighbours in the previous octant.
[[nodiscard]] constexpr std::uint64_t spilled_down(std::uint64_t m, unsigned axis) noexcept {
  return (m & lowest_layer(axis)) << (9U << axis);
}

/// The voxels and their 26 neighbours that lie in the octant at `offset` from the voxels' octant (-1, 0 or 1 along each
/// axis, in octants).
[[nodiscard]] constexpr std::uint64_t dilated(std::uint64_t m, const std::array<int, 3>& offset) noexcept {
  for (unsigned axis = 0; axis != 3; ++axis)
    m = offset[axis] > 0   ? spilled_up(m, axis)
        : offset[axis] < 0 ? spilled_down(m, axis)
                           : m | moved_up(m, axis) | moved_down(m, axis);
  return m;
}

}  // namespace orbis::nav::detail
