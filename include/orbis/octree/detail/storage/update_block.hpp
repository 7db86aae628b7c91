// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Hits and misses for the 64 voxels of an octant at once.
#pragma once

#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree::detail {

template <sensor_model M>
struct update_block_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE std::uint64_t run(block<typename M::value_type>& b, std::uint64_t free,
                                               std::uint64_t occupied) noexcept {
    using values = simd::native_vec<typename M::value_type, Target>;
    using mask = typename values::mask_type;
    const values low(M::clamp_min), high(M::clamp_max);
    std::uint64_t changed = (free | occupied) & ~b.known;
    b.known |= free | occupied;
    for (unsigned i = 0; i != 64; i += values::count) {
      const mask is_hit = mask::from_bits(occupied >> i), is_miss = mask::from_bits(free >> i);
      const values v = values::load(b.value.data() + i);
      const values sum = v + select(is_hit, values(M::hit), values(M::miss));
      // A value at or beyond its bound stays, as after_hit and after_miss say.
      const mask moves = (is_hit & (v < high)) | (is_miss & (v > low));
      const values after = select(moves, min(max(sum, low), high), v);
      after.store(b.value.data() + i);
      changed |= std::uint64_t{simd::bits(v != after)} << i;
    }
    return changed;
  }
};

/// Gives the voxels `free` of `b` a miss and the voxels `occupied` a hit, see after_miss and after_hit. Returns the
/// voxels whose value changed or became known. @pre free and occupied are disjoint
template <sensor_model M>
std::uint64_t update_block(block<typename M::value_type>& b, std::uint64_t free, std::uint64_t occupied) noexcept {
  using signature = std::uint64_t(block<typename M::value_type>&, std::uint64_t, std::uint64_t);
  return simd::kernel<update_block_kernel<M>, signature>()(b, free, occupied);
}

}  // namespace orbis::octree::detail
