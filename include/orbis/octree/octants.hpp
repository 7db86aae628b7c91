// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Access to the states of a map's voxels as bit masks of octants (4x4x4 voxels), for deriving data from a whole map or
/// from the octants in its change log.
#pragma once

#include <concepts>
#include <cstdint>

#include <orbis/octree/accessor.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree {

/// The 64 voxels of an octant; bit i is the voxel at position i of the Morton curve, as in change_log.
struct octant_states {
  std::uint64_t known = 0;
  std::uint64_t occupied = 0;  ///< subset of the known voxels

  [[nodiscard]] constexpr std::uint64_t free() const noexcept { return known & ~occupied; }
  friend constexpr bool operator==(const octant_states&, const octant_states&) = default;
};

namespace detail {

template <sensor_model Model>
[[nodiscard]] octant_states make_states(const brick_store<typename Model::value_type>& store,
                                        const brick<typename Model::value_type>& b, std::uint32_t octant) {
  return {store.known(b, octant), store.voxels_where(b, octant, is_occupied<Model>)};
}
template <sensor_model Model>
[[nodiscard]] octant_states make_states(typename Model::value_type v) {
  const std::uint64_t all = ~std::uint64_t{0};
  return {all, is_occupied<Model>(v) ? all : 0};
}

}  // namespace detail

/// Reads octants of a map that are near each other, for example those of a change log. The map must outlive the reader
/// and must not change; use one per thread.
template <octree_map Map>
class octant_reader {
 public:
  explicit octant_reader(const Map& map) noexcept : store_{&map.store()} {}

  /// Returns the octant that contains `k`. O(1).
  [[nodiscard]] octant_states operator()(const voxel_key& k) {
    if (const voxel_key chunk = node_key(k, detail::chunk_level); !started_ || !(chunk == at_)) {
      started_ = true;
      at_ = chunk;
      chunk_ = store_->find_chunk(k);
    }
    const auto* const b = chunk_ == nullptr ? nullptr : store_->find(*chunk_, detail::place_in_chunk(k));
    if (b != nullptr) return detail::make_states<model>(*store_, *b, detail::place_in_brick(k) >> 6U);
    const auto* const v = store_->find_large_value(k);
    return v != nullptr ? detail::make_states<model>(*v) : octant_states{};
  }

 private:
  using model = typename Map::model;
  using store = detail::brick_store<typename model::value_type>;

  const store* store_;
  const typename store::chunk* chunk_ = nullptr;
  voxel_key at_{};
  bool started_ = false;
};

/// Calls `visit(lowest voxel, level, states)` for every octant (level 2) with a voxel in `box` and at least one known
/// voxel, and for every leaf larger than 8x8x8 voxels (level > 3) with a voxel in `box`; `states` then holds for each
/// octant of the leaf. The order is unspecified. O(blocks of 32x32x32 voxels with bricks + large leaves + octants in
/// the box that are not uniform).
template <octree_map Map, std::invocable<const voxel_key&, int, const octant_states&> Visit>
void for_each_octant(const Map& map, const key_box& box, Visit&& visit) {
  using model = typename Map::model;
  const auto& store = map.store();
  store.for_each_chunk([&](const auto& c) {
    const voxel_key chunk = detail::named_key(c.name);
    if (!box.overlaps(chunk, detail::chunk_level)) return;
    for (std::uint32_t place = 0; place != 64; ++place) {
      const auto* const b = store.find(c, place);
      if (b == nullptr) continue;
      const voxel_key low = detail::named_key(b->name);
      if (!box.overlaps(low, detail::octant_level + 1)) continue;
      for (std::uint32_t i = 0; i != 8; ++i)
        if (const voxel_key k = child_key(low, i, node_cells(detail::octant_level));
            ((b->uniform | b->dense) >> i & 1U) != 0 && box.overlaps(k, detail::octant_level))
          visit(k, detail::octant_level, detail::make_states<model>(store, *b, i));
    }
  });
  store.for_each_large([&](std::uint64_t name, typename model::value_type v) {
    const voxel_key low = detail::named_key(name);
    if (const int level = detail::named_level(name); box.overlaps(low, level))
      visit(low, level, detail::make_states<model>(v));
  });
}

/// Visits the octants of the whole map. O(bricks + octants that are not uniform).
template <octree_map Map, std::invocable<const voxel_key&, int, const octant_states&> Visit>
void for_each_octant(const Map& map, Visit&& visit) {
  constexpr std::uint32_t last = node_cells(max_tree_depth) - 1;
  for_each_octant(map, {{0, 0, 0}, {last, last, last}}, visit);
}

}  // namespace orbis::octree
