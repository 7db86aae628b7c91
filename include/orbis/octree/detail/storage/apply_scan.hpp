// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Applies the masks of one scan to the bricks of a map.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <orbis/core/simd.hpp>
#include <orbis/octree/change_log.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/integration.hpp>
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
      // A value at or beyond its bound does not change, as in after_hit and after_miss.
      const mask moves = (is_hit & (v < high)) | (is_miss & (v > low));
      const values after = select(moves, min(max(sum, low), high), v);
      after.store(b.value.data() + i);
      changed |= std::uint64_t{simd::bits(v != after)} << i;
    }
    return changed;
  }
};

/// Applies a miss to the voxels `free` of `b` and a hit to the voxels `occupied`, see after_miss and after_hit. Returns
/// the voxels whose value changed or became known. @pre free and occupied are disjoint
template <sensor_model M>
std::uint64_t update_block(block<typename M::value_type>& b, std::uint64_t free, std::uint64_t occupied) noexcept {
  using signature = std::uint64_t(block<typename M::value_type>&, std::uint64_t, std::uint64_t);
  return simd::kernel<update_block_kernel<M>, signature>()(b, free, occupied);
}

/// Returns true if a miss cannot lower this value further.
template <sensor_model Model>
[[nodiscard]] constexpr bool is_saturated_free(typename Model::value_type v) noexcept {
  return v <= Model::clamp_min;
}

/// Returns true if the brick that contains `k` is part of a larger leaf whose value a miss cannot lower further.
template <sensor_model Model>
[[nodiscard]] bool is_saturated_leaf(const brick_store<typename Model::value_type>& store, const voxel_key& k) {
  if (!store.has_large()) return false;
  const auto* const large = store.find_large_value(k);
  return large != nullptr && is_saturated_free<Model>(*large);
}

/// Adds to `saturated` (word i: octant i) those voxels of the named brick whose values a miss cannot lower further.
template <sensor_model Model>
void find_saturated(const brick_store<typename Model::value_type>& store, std::uint64_t name,
                    std::array<std::uint64_t, 8>& saturated) {
  const auto* const b = store.find(named_key(name));
  if (b == nullptr) {
    if (is_saturated_leaf<Model>(store, named_key(name))) saturated.fill(~std::uint64_t{0});
    return;
  }
  for (std::uint32_t i = 0; i != 8; ++i) saturated[i] |= store.voxels_where(*b, i, is_saturated_free<Model>);
}

/// Voxels of an octant that changed, and unsaturated voxels that received a miss.
struct octant_change {
  std::uint64_t changed = 0, missed = 0;
};

/// Applies a hit to the voxels `occupied` of octant `octant` of `b` and a miss to the voxels `free`. @pre free and
/// occupied are disjoint
template <sensor_model Model>
octant_change apply_octant(brick_store<typename Model::value_type>& store, brick<typename Model::value_type>& b,
                           std::uint32_t octant, std::uint64_t occupied, std::uint64_t free) {
  using T = typename Model::value_type;
  // Most voxels of a mapped room are already saturated, so octants that cannot change are not unpacked.
  if (free != 0) free &= ~store.voxels_where(b, octant, is_saturated_free<Model>);
  if (occupied != 0) occupied &= ~store.voxels_where(b, octant, [](T v) { return v >= Model::clamp_max; });
  if ((free | occupied) == 0) return {};
  block<T> voxels;
  store.read_octant(b, octant, voxels);
  const std::uint64_t changed = update_block<Model>(voxels, free, occupied);
  store.write_octant(b, octant, voxels);
  return {changed, free};
}

/// Applies the observations of one brick: a hit to every occupied voxel, a miss to every free one. `for_each(visit)`
/// calls `visit(octant, free, occupied)` with disjoint masks. Counts the voxels in `summary`, and records the changes
/// in `log` unless it is null.
template <sensor_model Model, class ForEachOctant>
void apply_brick(brick_store<typename Model::value_type>& store, std::uint64_t name, const ForEachOctant& for_each,
                 integration_summary& summary, change_log* log) {
  const voxel_key key = named_key(name);
  bool matters = !is_saturated_leaf<Model>(store, key);
  for_each([&](std::uint32_t, std::uint64_t, std::uint64_t occupied) {
    summary.occupied += static_cast<std::size_t>(std::popcount(occupied));
    matters = matters || occupied != 0;
  });
  if (!matters) return;  // a large leaf is split only if one of its voxels changes
  auto& b = store.make(key);
  for_each([&](std::uint32_t octant, std::uint64_t free, std::uint64_t occupied) {
    const auto [changed, missed] = apply_octant<Model>(store, b, octant, occupied, free);
    summary.free += static_cast<std::size_t>(std::popcount(missed));
    if (log != nullptr) log->record(child_key(key, octant, node_cells(octant_level)), changed);
  });
}

/// Applies the masks of a scan, in which a voxel both free and occupied counts as occupied; see apply_brick.
template <sensor_model Model>
void apply_scan(brick_store<typename Model::value_type>& store, const scan_masks& scan, integration_summary& summary,
                change_log* log) {
  for (const scan_brick& s : scan.bricks())
    apply_brick<Model>(
        store, s.name,
        [&](const auto& visit) {
          for (std::uint32_t i = 0; i != 8; ++i)
            if ((s.occupied[i] | s.free[i]) != 0) visit(i, s.free[i] & ~s.occupied[i], s.occupied[i]);
        },
        summary, log);
}

}  // namespace orbis::octree::detail
