// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Storage of 64 voxels as indices into their few distinct values. Log-odds result from a few additions and two bounds,
/// so neighbouring voxels mostly have equal values: an octant takes a quarter of the memory of its floats, without
/// loss.
#pragma once

#include <array>
#include <cstdint>

namespace orbis::octree::detail {

/// An unpacked octant of 4x4x4 voxels, in Morton order. Unknown voxels hold 0.
template <class T>
struct alignas(64) block {
  std::array<T, 64> value{};
  std::uint64_t known = 0;

  /// Returns true if all voxels are known and have the same value, bit by bit.
  [[nodiscard]] bool is_uniform() const noexcept {
    if (known != ~std::uint64_t{0}) return false;
    bool same = true;
    for (const T v : value) same &= v == value[0];
    return same;
  }
};

/// Maximum number of values of an octant that is stored as indices.
inline constexpr unsigned max_palette_bits = 5;
inline constexpr unsigned max_palette = 1U << max_palette_bits;

/// Distinct values of a block: `plane[j]` holds bit j of every voxel's index into `value`.
template <class T>
struct palette {
  unsigned count = 0;  ///< greater than max_palette if there are too many
  std::array<std::uint64_t, max_palette_bits> plane{};
  std::array<T, max_palette> value{};

  void add(T v, std::uint64_t where) noexcept {
    value[count] = v;
    for (unsigned j = 0; j != max_palette_bits; ++j)
      if ((count >> j & 1U) != 0) plane[j] |= where;
    ++count;
  }
};

/// Mask of the voxels whose index is `i`, for indices with `Bits` planes.
template <unsigned Bits>
[[nodiscard]] constexpr std::uint64_t voxels_of_index(const std::uint64_t* plane, unsigned i) noexcept {
  std::uint64_t where = ~std::uint64_t{0};
  for (unsigned j = 0; j != Bits; ++j) where &= (i >> j & 1U) != 0 ? plane[j] : ~plane[j];
  return where;
}

// Both are defined in palette_kernels.hpp.

/// Finds the distinct values of the known voxels of `b`, in the order of their first voxels.
template <class T>
void find_palette(const block<T>& b, palette<T>& p) noexcept;

/// Sets the known voxels of `out` to the values that `plane[0 ... bits)` selects from the 2^bits `values`, and the
/// others to 0.
template <class T>
void expand_palette(const T* values, const std::uint64_t* plane, unsigned bits, block<T>& out) noexcept;

}  // namespace orbis::octree::detail
