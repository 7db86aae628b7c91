// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A layer of a map by columns of voxels, as bits.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/result.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/octree/key.hpp>
#include <orbis/octree/octants.hpp>

namespace orbis::nav::detail {

/// The voxels of an octant at each height.
inline constexpr std::array<std::uint64_t, 4> octant_layers{0x000000000f0f0f0f, 0x00000000f0f0f0f0, 0x0f0f0f0f00000000,
                                                            0xf0f0f0f000000000};

/// The voxels of a box of a map, column by column: which are known, and which of these are occupied.
class voxel_columns {
 public:
  /// Columns of nothing. @pre low and size are multiples of 4
  voxel_columns(const octree::voxel_key& low, std::array<std::uint32_t, 3> size)
      : low_{low},
        size_{size},
        words_{(size[2] + 63) / 64},
        known_(static_cast<std::size_t>(size[0]) * size[1] * words_),
        occupied_(known_.size()) {
    assert(((low.x | low.y | low.z | size[0] | size[1] | size[2]) & 3U) == 0);
  }

  /// The voxel at the low corner.
  [[nodiscard]] const octree::voxel_key& low() const noexcept { return low_; }
  [[nodiscard]] int width() const noexcept { return static_cast<int>(size_[0]); }
  [[nodiscard]] int height() const noexcept { return static_cast<int>(size_[1]); }
  /// Voxels above each other.
  [[nodiscard]] int levels() const noexcept { return static_cast<int>(size_[2]); }

  /// The lowest occupied voxel of a column from level `z` on; the largest int if there is none. @pre z >= 0
  [[nodiscard]] int next_occupied(int x, int y, int z) const noexcept {
    const int found = next(occupied_, 0, x, y, z);
    return found < levels() ? found : std::numeric_limits<int>::max();
  }
  /// The lowest voxel of which nothing is known; levels() if that lies beyond the box. @pre z >= 0
  [[nodiscard]] int next_unknown(int x, int y, int z) const noexcept {
    return next(known_, ~std::uint64_t{0}, x, y, z);
  }

  /// Sets an octant. @pre it lies in the box
  void set(const octree::voxel_key& octant, const octree::octant_states& s) noexcept {
    const auto x = static_cast<int>(octant.x - low_.x), y = static_cast<int>(octant.y - low_.y);
    const std::uint32_t z = octant.z - low_.z;
    for (int i = 0; i != 16; ++i) {
      // Of the bits of a Morton code, x has 0 and 3, y 1 and 4, z 2 and 5.
      const auto in = static_cast<unsigned>(i);
      const unsigned code = (in & 1U) | (in & 2U) << 2U | (in & 4U) >> 1U | (in & 8U) << 1U;
      const std::size_t word = place(x + (i & 3), y + (i >> 2)) + z / 64;
      known_[word] |= four(s.known >> code) << (z & 63U);
      occupied_[word] |= four(s.occupied >> code) << (z & 63U);
    }
  }

 private:
  /// The four voxels of a column of an octant, of which the lowest is bit 0.
  [[nodiscard]] static std::uint64_t four(std::uint64_t m) noexcept {
    return (m & 1U) | (m >> 3U & 2U) | (m >> 30U & 4U) | (m >> 33U & 8U);
  }
  [[nodiscard]] std::size_t place(int x, int y) const noexcept {
    return (static_cast<std::size_t>(y) * size_[0] + static_cast<std::size_t>(x)) * words_;
  }
  [[nodiscard]] int next(const std::vector<std::uint64_t>& bits, std::uint64_t flip, int x, int y,
                         int z) const noexcept {
    const std::size_t first = place(x, y);
    for (std::uint64_t mask = ~std::uint64_t{0} << (z & 63); z < levels(); z = (z | 63) + 1, mask = ~std::uint64_t{0})
      if (const std::uint64_t rest = (bits[first + static_cast<std::size_t>(z >> 6)] ^ flip) & mask; rest != 0)
        return std::min((z & ~63) + std::countr_zero(rest), levels());
    return levels();
  }

  octree::voxel_key low_;
  std::array<std::uint32_t, 3> size_;
  std::size_t words_;
  std::vector<std::uint64_t> known_, occupied_;  ///< words_ for each column, row by row
};

/// The columns of what is known in a box of voxels: as far along x and y as something in it is known, in octants.
/// Errors: no_data, invalid_argument (more than `most` columns). O(octants in the box + columns).
template <planning_map Map>
[[nodiscard]] result<voxel_columns> read_columns(const Map& map, const octree::key_box& wanted, std::uint64_t most) {
  const auto down = [](const octree::voxel_key& k) { return octree::node_key(k, 2); };
  const octree::key_box box{down(wanted.low), down(wanted.high)};  // of octants
  struct part {
    octree::key_box octants;
    octree::octant_states states;
  };
  std::vector<part> parts;
  octree::key_box around{box.high, box.low};
  map_access<Map>::for_each_octant(map, [&](const octree::voxel_key& k, int level, const octree::octant_states& s) {
    if (!box.overlaps(k, level) || s.known == 0) return;
    const std::uint32_t last = octree::node_cells(level) - 4;
    const octree::key_box inside{
        {std::max(k.x, box.low.x), std::max(k.y, box.low.y), std::max(k.z, box.low.z)},
        {std::min(k.x + last, box.high.x), std::min(k.y + last, box.high.y), std::min(k.z + last, box.high.z)}};
    parts.push_back({inside, s});
    around.low = {std::min(around.low.x, inside.low.x), std::min(around.low.y, inside.low.y), box.low.z};
    around.high = {std::max(around.high.x, inside.high.x), std::max(around.high.y, inside.high.y), box.high.z};
  });
  if (parts.empty()) return fail(errc::no_data, "", "nothing is known at the floor's height");
  const std::array<std::uint32_t, 3> size{around.high.x + 4 - around.low.x, around.high.y + 4 - around.low.y,
                                          around.high.z + 4 - around.low.z};
  if (std::uint64_t{size[0]} * size[1] > most)
    return fail(errc::invalid_argument, "region", "the map is too wide for one floor map");
  voxel_columns columns{around.low, size};
  for (const part& p : parts)
    for (std::uint32_t z = p.octants.low.z; z <= p.octants.high.z; z += 4)
      for (std::uint32_t y = p.octants.low.y; y <= p.octants.high.y; y += 4)
        for (std::uint32_t x = p.octants.low.x; x <= p.octants.high.x; x += 4) columns.set({x, y, z}, p.states);
  return columns;
}

}  // namespace orbis::nav::detail
