// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A layer of a map as bit columns of voxels.
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

/// Masks of the voxels of an octant at each height.
inline constexpr std::array<std::uint64_t, 4> octant_layers{0x000000000f0f0f0f, 0x00000000f0f0f0f0, 0x0f0f0f0f00000000,
                                                            0xf0f0f0f000000000};

/// The voxels in a box of a map, column by column: one bit each for "known" and for "occupied".
template <class = void>
class basic_voxel_columns {
 public:
  /// Creates columns of unknown voxels. @pre low and size are multiples of 4
  basic_voxel_columns(const octree::voxel_key& low, std::array<std::uint32_t, 3> size)
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
  /// Number of voxels in a column.
  [[nodiscard]] int levels() const noexcept { return static_cast<int>(size_[2]); }

  /// The lowest occupied voxel of a column at level `z` or above; the largest int if there is none. @pre z >= 0
  [[nodiscard]] int next_occupied(int x, int y, int z) const noexcept {
    const int found = next(occupied_, 0, x, y, z);
    return found < levels() ? found : std::numeric_limits<int>::max();
  }
  /// The highest level of the run of occupied voxels that starts at `z`, or of the 64-bit word that contains `z` if the
  /// run continues beyond it.
  /// @pre the voxel at `z` is occupied; z >= 0
  [[nodiscard]] int end_of_run(int x, int y, int z) const noexcept {
    return z + std::countr_one(occupied_[place(x, y) + static_cast<std::size_t>(z >> 6)] >> (z & 63)) - 1;
  }
  /// The lowest unknown voxel of a column at level `z` or above; levels() if there is none in the box. @pre z >= 0
  [[nodiscard]] int next_unknown(int x, int y, int z) const noexcept {
    return next(known_, ~std::uint64_t{0}, x, y, z);
  }

  /// Sets the states of all octants in a box of octants. @pre none was set before; the box lies in the box of columns
  void set(const octree::key_box& octants, const octree::octant_states& s) noexcept {
    const std::uint64_t all = ~std::uint64_t{0};
    const bool is_uniform = s.known == all && (s.occupied == 0 || s.occupied == all);
    const int from = static_cast<int>(octants.low.z - low_.z), to = static_cast<int>(octants.high.z - low_.z) + 4;
    for (std::uint32_t y = octants.low.y; y <= octants.high.y; y += 4)
      for (std::uint32_t x = octants.low.x; x <= octants.high.x; x += 4) {
        const auto u = static_cast<int>(x - low_.x), v = static_cast<int>(y - low_.y);
        if (is_uniform && from / 64 == (to - 1) / 64) {
          const std::uint64_t bits = (to - from == 64 ? all : (std::uint64_t{1} << (to - from)) - 1) << (from & 63);
          for (int j = 0; j != 4; ++j)
            for (std::size_t i = 0, word = place(u, v + j) + static_cast<std::size_t>(from / 64); i != 4; ++i) {
              known_[word + i * words_] |= bits;
              if (s.occupied != 0) occupied_[word + i * words_] |= bits;
            }
        } else if (is_uniform) {
          for (int i = 0; i != 16; ++i) fill(place(u + (i & 3), v + (i >> 2)), from, to, s.occupied != 0);
        } else {
          for (int z = from; z != to; z += 4) set_octant(u, v, static_cast<unsigned>(z), s);
        }
      }
  }

 private:
  void set_octant(int x, int y, unsigned z, const octree::octant_states& s) noexcept {
    const std::uint64_t known = by_column(s.known), occupied = by_column(s.occupied);
    const unsigned shift = z & 63U;
    for (unsigned j = 0; j != 4; ++j) {
      const unsigned row = 16 * (j >> 1U | (j & 1U) << 1U);
      std::size_t word = place(x, y + static_cast<int>(j)) + z / 64;
      for (unsigned i = 0; i != 4; ++i, word += words_) {
        known_[word] |= (known >> (row + 4 * i) & 15U) << shift;
        occupied_[word] |= (occupied >> (row + 4 * i) & 15U) << shift;
      }
    }
  }
  /// Fills the levels [from, to) of the column whose first word is `first`.
  void fill(std::size_t first, int from, int to, bool occupied) noexcept {
    for (int z = from; z < to; z = (z | 63) + 1) {
      const std::uint64_t rest = to - (z & ~63) < 64 ? (std::uint64_t{1} << (to & 63)) - 1 : ~std::uint64_t{0};
      const std::uint64_t bits = rest & ~std::uint64_t{0} << (z & 63);
      known_[first + static_cast<std::size_t>(z / 64)] |= bits;
      if (occupied) occupied_[first + static_cast<std::size_t>(z / 64)] |= bits;
    }
  }
  /// The voxels of an octant as columns of four, lowest first; columns along x, then rows y = 0, 2, 1, 3. In a Morton
  /// code, x has bits 0 and 3, y bits 1 and 4, z bits 2 and 5; the function exchanges bit 0 with bit 2, and bit 1 with
  /// bit 5.
  [[nodiscard]] static std::uint64_t by_column(std::uint64_t m) noexcept {
    const auto exchange = [&](std::uint64_t bits, int distance) {  // exchanges `bits` with the bits `distance` higher
      const std::uint64_t differ = (m >> distance ^ m) & bits;
      m ^= differ ^ differ << distance;
    };
    exchange(0x0a0a0a0a0a0a0a0a, 3);
    exchange(0x00000000cccccccc, 30);
    return m;
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
  std::vector<std::uint64_t> known_, occupied_;  ///< words_ words per column, row by row
};
using voxel_columns = basic_voxel_columns<>;

/// The columns of a box of voxels, cropped along all axes to the octants with known voxels. Errors: no_data,
/// invalid_argument (more than `most` words of 64 levels). O(octants and larger leaves in the box + words).
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
  const auto take = [&](const octree::voxel_key& k, int level, const octree::octant_states& s) {
    if (!box.overlaps(k, level) || s.known == 0) return;
    const std::uint32_t last = octree::node_cells(level) - 4;
    const octree::key_box inside{
        {std::max(k.x, box.low.x), std::max(k.y, box.low.y), std::max(k.z, box.low.z)},
        {std::min(k.x + last, box.high.x), std::min(k.y + last, box.high.y), std::min(k.z + last, box.high.z)}};
    parts.push_back({inside, s});
    around.low = {std::min(around.low.x, inside.low.x), std::min(around.low.y, inside.low.y),
                  std::min(around.low.z, inside.low.z)};
    around.high = {std::max(around.high.x, inside.high.x), std::max(around.high.y, inside.high.y),
                   std::max(around.high.z, inside.high.z)};
  };
  if constexpr (requires { map_access<Map>::for_each_octant(map, box, take); })
    map_access<Map>::for_each_octant(map, box, take);
  else
    map_access<Map>::for_each_octant(map, take);
  if (parts.empty()) return fail(errc::no_data, "", "all space at the floor's height is unknown");
  const std::array<std::uint32_t, 3> size{around.high.x + 4 - around.low.x, around.high.y + 4 - around.low.y,
                                          around.high.z + 4 - around.low.z};
  if (std::uint64_t{size[0]} * size[1] > most || std::uint64_t{size[0]} * size[1] * ((size[2] + 63) / 64) > most)
    return fail(errc::invalid_argument, "region",
                "the region is too large for one floor map: reduce its area or its height");
  voxel_columns columns{around.low, size};
  for (const part& p : parts) columns.set(p.octants, p.states);
  return columns;
}

}  // namespace orbis::nav::detail
