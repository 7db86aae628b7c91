// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A brick whose scans are replayed, before it is stored.
#pragma once

#include <array>
#include <cstdint>

#include <orbis/octree/detail/storage/packed_block.hpp>

namespace orbis::octree::detail {

/// What the scans say about the octants of a brick, and the voxels in which that differs from what is stored.
template <class T>
struct replayed_brick {
  std::array<block<T>, 8> octants;
  std::array<std::uint64_t, 8> changed{};  ///< zero for octants that were not replayed
};

}  // namespace orbis::octree::detail
