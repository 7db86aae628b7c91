// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Voxels along the Morton curve: the bits of x, y and z in turn, x lowest. Of a voxel's code, the six
/// lowest bits are its place in its octant of 4x4x4 voxels and the others are the octant's code.
///
/// G. M. Morton, "A computer oriented geodetic data base and a new technique in file sequencing",
/// IBM, 1966.
#pragma once

#include <cassert>
#include <cstdint>

#include <orbis/octree/key.hpp>

namespace orbis::octree {

/// The place of voxel `k` along the curve; 63 bits. @pre coordinates < 2^21
[[nodiscard]] constexpr std::uint64_t morton_code(const voxel_key& k) noexcept {
  assert(((k.x | k.y | k.z) >> 21U) == 0);
  const auto spread = [](std::uint64_t v) {  // two zeros after each bit
    v = (v | v << 32U) & 0x001f00000000ffffULL;
    v = (v | v << 16U) & 0x001f0000ff0000ffULL;
    v = (v | v << 8U) & 0x100f00f00f00f00fULL;
    v = (v | v << 4U) & 0x10c30c30c30c30c3ULL;
    return (v | v << 2U) & 0x1249249249249249ULL;
  };
  return spread(k.x) | spread(k.y) << 1U | spread(k.z) << 2U;
}

/// The voxel at a place of the curve. @pre code < 2^63
[[nodiscard]] constexpr voxel_key morton_key(std::uint64_t code) noexcept {
  const auto gather = [](std::uint64_t v) {
    v &= 0x1249249249249249ULL;
    v = (v | v >> 2U) & 0x10c30c30c30c30c3ULL;
    v = (v | v >> 4U) & 0x100f00f00f00f00fULL;
    v = (v | v >> 8U) & 0x001f0000ff0000ffULL;
    v = (v | v >> 16U) & 0x001f00000000ffffULL;
    return static_cast<std::uint32_t>((v | v >> 32U) & 0x1fffffULL);
  };
  return {gather(code), gather(code >> 1U), gather(code >> 2U)};
}

}  // namespace orbis::octree
