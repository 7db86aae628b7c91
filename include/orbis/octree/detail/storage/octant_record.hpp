// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Octants of 4x4x4 voxels as they are stored: the values there are, and for each voxel the index of
/// its own.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <optional>

#include <orbis/octree/detail/storage/packed_block.hpp>

namespace orbis::octree::detail {

/// An octant where it is stored: its known voxels, and the index of each voxel's value, bit by bit.
template <class T>
struct octant_view {
  std::uint64_t known = 0;
  const std::uint64_t* plane = nullptr;  ///< `bits` masks: bit j of every voxel's index
  unsigned bits = 0;
  const T* value = nullptr;

  /// The value of a place. @pre it is known
  [[nodiscard]] T at(std::uint32_t place) const noexcept {
    unsigned index = 0;
    for (unsigned j = 0; j != bits; ++j) index |= static_cast<unsigned>(plane[j] >> place & 1U) << j;
    return value[index];
  }
};

/// An octant with up to 2^Bits values.
template <class T, unsigned Bits>
struct packed_octant {
  std::uint64_t known = 0;
  std::array<std::uint64_t, Bits> plane{};
  std::array<T, 1U << Bits> values{};

  [[nodiscard]] octant_view<T> view() const noexcept { return {known, plane.data(), Bits, values.data()}; }
  [[nodiscard]] T at(std::uint32_t place) const noexcept {
    unsigned index = 0;
    for (unsigned j = 0; j != Bits; ++j) index |= static_cast<unsigned>(plane[j] >> place & 1U) << j;
    return values[index];
  }
  template <class Wanted>
  [[nodiscard]] std::uint64_t where(Wanted&& wanted) const noexcept {
    std::uint64_t found = 0;
    for (unsigned i = 0; i != 1U << Bits; ++i)
      if (wanted(values[i])) found |= voxels_of_index<Bits>(plane.data(), i);
    return found;
  }
  void unpack(block<T>& out) const noexcept {
    out.known = known;
    expand_palette(values.data(), plane.data(), Bits, out);
  }
  void pack(std::uint64_t voxels, const palette<T>& p) noexcept {
    known = voxels;
    std::copy_n(p.plane.begin(), Bits, plane.begin());
    std::copy_n(p.value.begin(), values.size(), values.begin());
  }
  template <class Change>
  [[nodiscard]] packed_octant transformed(Change&& change, std::uint64_t& different) const {
    packed_octant changed = *this;
    for (unsigned i = 0; i != 1U << Bits; ++i) {
      const std::uint64_t where = known & voxels_of_index<Bits>(plane.data(), i);
      if (where == 0) continue;
      const std::optional<T> v = change(values[i]);
      if (v != values[i]) different |= where;
      if (v) changed.values[i] = *v;
      if (!v) changed.known &= ~where;
    }
    return changed;
  }
};
/// Bit j of every place.
inline constexpr std::array<std::uint64_t, 6> place_planes{0xaaaaaaaaaaaaaaaa, 0xcccccccccccccccc, 0xf0f0f0f0f0f0f0f0,
                                                           0xff00ff00ff00ff00, 0xffff0000ffff0000, 0xffffffff00000000};
/// An octant of more values than that.
template <class T>
struct plain_octant {
  std::uint64_t known = 0;
  std::array<T, 64> values{};

  [[nodiscard]] octant_view<T> view() const noexcept { return {known, place_planes.data(), 6, values.data()}; }
  [[nodiscard]] T at(std::uint32_t place) const noexcept { return values[place]; }
  template <class Wanted>
  [[nodiscard]] std::uint64_t where(Wanted&& wanted) const noexcept {
    std::uint64_t found = 0;
    for (unsigned i = 0; i != 64; ++i) found |= std::uint64_t{wanted(values[i])} << i;
    return found;
  }
  void unpack(block<T>& out) const noexcept {
    out.known = known;
    out.value = values;
  }
  void pack(const block<T>& voxels) noexcept {
    known = voxels.known;
    values = voxels.value;
  }
  template <class Change>
  [[nodiscard]] plain_octant transformed(Change&& change, std::uint64_t& different) const {
    plain_octant changed = *this;
    for (std::uint64_t rest = known; rest != 0; rest &= rest - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(rest));
      const std::optional<T> v = change(values[i]);
      if (v != values[i]) different |= std::uint64_t{1} << i;
      changed.values[i] = v.value_or(T{});
      if (!v) changed.known &= ~(std::uint64_t{1} << i);
    }
    return changed;
  }
};

}  // namespace orbis::octree::detail
