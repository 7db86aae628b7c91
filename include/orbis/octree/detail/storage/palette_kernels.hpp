// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Vectorised conversion of 64 voxels to and from indices into their values: the functions of packed_block.hpp.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>

namespace orbis::octree::detail {

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
    constexpr bool in_registers = sizeof(T) == 4 && index::count == 16;  // all values fit into two registers
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

template <class T>
void find_palette(const block<T>& b, palette<T>& p) noexcept {
  simd::kernel<find_palette_kernel<T>, void(const block<T>&, palette<T>&)>()(b, p);
}

template <class T>
void expand_palette(const T* values, const std::uint64_t* plane, unsigned bits, block<T>& out) noexcept {
  using signature = void(const T*, const std::uint64_t*, unsigned, block<T>&);
  simd::kernel<expand_palette_kernel<T>, signature>()(values, plane, bits, out);
}

}  // namespace orbis::octree::detail
