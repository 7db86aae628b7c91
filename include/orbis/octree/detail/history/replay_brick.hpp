// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Replays the scans that observe something in a brick, and stores what comes out.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/octree/change_log.hpp>
#include <orbis/octree/detail/history/brick_uses.hpp>
#include <orbis/octree/detail/history/replayed_brick.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/detail/storage/update_block.hpp>
#include <orbis/octree/scan_voxels.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree::detail {

/// The voxels in which two octants differ; unknown voxels hold 0.
template <class T>
[[nodiscard]] std::uint64_t difference(const block<T>& a, const block<T>& b) noexcept {
  std::uint64_t different = a.known ^ b.known;
  for (unsigned i = 0; i != 64; ++i) different |= std::uint64_t{a.value[i] != b.value[i]} << i;
  return different;
}

/// Replays the stale octants of a brick from empty: every scan of `b.uses` in turn, `voxels_of(scan)` being its voxels.
/// Reads the store only. O(scans that use the brick).
/// @pre no leaf of the store is larger than a brick
template <sensor_model Model, class VoxelsOf>
void replay_brick(const brick_store<typename Model::value_type>& store, const used_brick& b, const VoxelsOf& voxels_of,
                  replayed_brick<typename Model::value_type>& out) {
  using T = typename Model::value_type;
  for (unsigned i = 0; i != 8; ++i) {
    if ((b.stale >> i & 1U) == 0) continue;
    out.octants[i].value.fill(T{});
    out.octants[i].known = 0;
  }
  for (const brick_use& u : b.uses) {
    const scan_voxels& scan = voxels_of(u.scan);
    scan.for_each_octant(scan.parts()[u.part], [&](unsigned i, std::uint64_t free, std::uint64_t occupied) {
      if ((b.stale >> i & 1U) != 0) update_block<Model>(out.octants[i], free, occupied);
    });
  }
  out.changed.fill(0);
  const brick<T>* const stored = store.find(named_key(b.name));
  block<T> before;
  for (unsigned i = 0; i != 8; ++i) {
    if ((b.stale >> i & 1U) == 0) continue;
    if (stored != nullptr) {
      store.read_octant(*stored, i, before);
      out.changed[i] = difference(before, out.octants[i]);
    } else {
      out.changed[i] = out.octants[i].known;
    }
  }
}

/// Stores the octants of a replayed brick that differ from what is stored, and records that. Returns whether anything
/// is known about the brick afterwards.
template <class T>
bool store_replayed(brick_store<T>& store, std::uint64_t name, const replayed_brick<T>& replayed, change_log* log) {
  const voxel_key key = named_key(name);
  std::uint64_t any = 0;
  for (const std::uint64_t changed : replayed.changed) any |= changed;
  if (any == 0) {
    const brick<T>* const stored = store.find(key);
    return stored != nullptr && stored->is_known();
  }
  brick<T>& b = store.make(key);
  for (unsigned i = 0; i != 8; ++i) {
    if (replayed.changed[i] == 0) continue;
    store.write_octant(b, i, replayed.octants[i]);
    if (log != nullptr) log->record(child_key(key, i, node_cells(octant_level)), replayed.changed[i]);
  }
  return b.is_known();
}

}  // namespace orbis::octree::detail
