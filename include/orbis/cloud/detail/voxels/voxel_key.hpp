// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keys of the cells of a grid.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

#include <orbis/core/random.hpp>

namespace orbis::cloud::detail {

/// A cell of a grid aligned with the origin.
using voxel_key = std::array<std::int32_t, 3>;

/// 64-bit hash of a voxel's key.
struct voxel_key_hash {
  [[nodiscard]] std::uint64_t operator()(const voxel_key& key) const noexcept {
    const std::uint64_t low = std::bit_cast<std::uint32_t>(key[0]) | std::uint64_t{std::bit_cast<std::uint32_t>(key[1])}
                                                                         << 32U;
    return mix64(low ^ mix64(std::bit_cast<std::uint32_t>(key[2])));
  }
};

/// Returns true if an output of `voxel_cells` is a valid cell.
[[nodiscard]] constexpr bool is_cell(std::int32_t cell) noexcept { return cell > -2147483647 && cell < 2147483647; }
[[nodiscard]] constexpr bool is_cell(const voxel_key& key) noexcept {
  return is_cell(key[0]) && is_cell(key[1]) && is_cell(key[2]);
}

/// Returns true if two keys are equal. The comparison operator of `std::array` would call memcmp.
[[nodiscard]] constexpr bool same_key(const voxel_key& a, const voxel_key& b) noexcept {
  return ((a[0] ^ b[0]) | (a[1] ^ b[1]) | (a[2] ^ b[2])) == 0;
}

}  // namespace orbis::cloud::detail
