// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// 64 voxels as an index into the few values they have. Log-odds come from a handful of additions
/// and two bounds, so that neighbours mostly share their values: an octant of a map takes a quarter
/// of the room that its floats would, and loses nothing.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd.hpp>

namespace orbis::octree::detail {

/// An octant of 4x4x4 voxels in the open, in Morton order. Unknown voxels hold 0.
template <class T>
struct alignas(64) block {
  std::array<T, 64> value{};
  std::uint64_t known = 0;

  /// Whether all voxels are known and have the same value, bit by bit.
  [[nodiscard]] bool is_uniform() const noexcept {
    if (known != ~std::uint64_t{0}) return false;
    bool same = true;
    for (const T v : value) same &= v == value[0];
    return same;
  }
};

/// The most values an octant can have and still be stored as indices.
inline constexpr unsigned max_palette_bits = 5;
inline constexpr unsigned max_palette = 1U << max_palette_bits;

/// The distinct values of a block: `plane[j]` holds bit j of every voxel's index into `value`.
template <class T>
struct palette {
  unsigned count = 0;  ///< more than max_palette: too many
  std::array<std::uint64_t, max_palette_bits> plane{};
  std::array<T, max_palette> value{};

  void add(T v, std::uint64_t where) noexcept {
    value[count] = v;
    for (unsigned j = 0; j != max_palette_bits; ++j)
      if ((count >> j & 1U) != 0) plane[j] |= where;
    ++count;
  }
};

/// The voxels whose index is `i`, among those whose index has `bits` planes.
template <unsigned Bits>
[[nodiscard]] constexpr std::uint64_t voxels_of_index(const std::uint64_t* plane, unsigned i) noexcept {
  std::uint64_t where = ~std::uint64_t{0};
  for (unsigned j = 0; j != Bits; ++j) where &= (i >> j & 1U) != 0 ? plane[j] : ~plane[j];
  return where;
}

template <class T>
using value_bits = std::conditional_t<sizeof(T) == 4, std::uint32_t, std::uint64_t>;

template <class T>
struct find_palette_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const block<T>& b, palette<T>& p) noexcept {
    using words = simd::native_vec<value_bits<T>, Target>;
    p.count = 0;
    p.plane.fill(0);
    for (std::uint64_t rest = b.known; rest != 0;) {
      const T v = b.value[static_cast<std::size_t>(std::countr_zero(rest))];
      const words wanted = simd::bits_as<value_bits<T>>(simd::native_vec<T, Target>(v));
      std::uint64_t same = 0;
      for (unsigned i = 0; i != 64; i += words::count) {
        const auto values = simd::native_vec<T, Target>::load(b.value.data() + i);
        same |= std::uint64_t{simd::bits(simd::bits_as<value_bits<T>>(values) == wanted)} << i;
      }
      if (p.count == max_palette) {
        ++p.count;
        return;
      }
      p.add(v, same & rest);
      rest &= ~same;
    }
  }
};

template <class T>
struct expand_palette_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const T* values, const std::uint64_t* plane, unsigned bits,
                                      block<T>& out) noexcept {
    using index = simd::native_vec<std::int32_t, Target>;
    using lanes = simd::vec<T, index::count, Target>;
    constexpr bool in_registers = sizeof(T) == 4 && index::count == 16;  // all values in two of them
    lanes low, high;
    if constexpr (in_registers) {
      const std::size_t count = std::size_t{1} << bits;
      low = lanes::load(values, std::min<std::size_t>(count, 16));
      high = count > 16 ? lanes::load(values + 16) : low;
    }
    for (unsigned i = 0; i != 64; i += index::count) {
      index at(0);
      for (unsigned j = 0; j != bits; ++j)
        at = at |
             select(index::mask_type::from_bits(plane[j] >> i), index(static_cast<std::int32_t>(1U << j)), index(0));
      lanes chosen;
      if constexpr (in_registers)
        chosen = simd::look_up(low, high, at);
      else
        chosen = simd::gather(values, at);
      const auto known = lanes::mask_type::from_bits(out.known >> i);
      select(known, chosen, lanes(T{})).store(out.value.data() + i);
    }
  }
};

/// Finds the distinct values of the known voxels of `b`, in the order of their first voxels.
template <class T>
void find_palette(const block<T>& b, palette<T>& p) noexcept {
  simd::kernel<find_palette_kernel<T>, void(const block<T>&, palette<T>&)>()(b, p);
}

/// Gives the voxels that `out` knows the values that `plane[0 ... bits)` choose among the 2^bits `values`, and the
/// others 0.
template <class T>
void expand_palette(const T* values, const std::uint64_t* plane, unsigned bits, block<T>& out) noexcept {
  using signature = void(const T*, const std::uint64_t*, unsigned, block<T>&);
  simd::kernel<expand_palette_kernel<T>, signature>()(values, plane, bits, out);
}

}  // namespace orbis::octree::detail

ORBIS_COMPILED_KERNEL(orbis::octree::detail::find_palette_kernel<float>,
                      void(const orbis::octree::detail::block<float>&, orbis::octree::detail::palette<float>&));
ORBIS_COMPILED_KERNEL(orbis::octree::detail::expand_palette_kernel<float>,
                      void(const float*, const std::uint64_t*, unsigned, orbis::octree::detail::block<float>&));
