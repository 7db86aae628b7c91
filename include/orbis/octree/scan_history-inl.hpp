// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of scan_history.hpp.
#pragma once

#include <algorithm>

#include <orbis/octree/detail/storage/apply_scan.hpp>
#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/occupancy_octree-inl.hpp>
#include <orbis/octree/scan.hpp>
#include <orbis/octree/scan_history.hpp>
#include <orbis/octree/sensor_model.hpp>

namespace orbis::octree {
namespace detail {

/// Mask of the voxels in which two octants differ. @pre unknown voxels hold 0
template <class T>
[[nodiscard]] std::uint64_t difference(const block<T>& a, const block<T>& b) noexcept {
  std::uint64_t different = a.known ^ b.known;
  for (unsigned i = 0; i != 64; ++i) different |= std::uint64_t{a.value[i] != b.value[i]} << i;
  return different;
}

/// Replays the stale octants of a brick from an empty state with every scan of `b.uses` in turn; `voxels_of(scan)`
/// returns the scan's voxels. Does not change the store. O(scans that use the brick).
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
    const scan& seen = voxels_of(u.scan);
    seen.for_each_octant(seen.parts()[u.part], [&](unsigned i, std::uint64_t free, std::uint64_t occupied) {
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

/// Stores the octants of a replayed brick that differ from those in the store, and records the changes. Returns true if
/// any voxel of the brick is known afterwards.
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

[[nodiscard]] inline unsigned observed_octants(const scan::part& p) noexcept { return p.free | p.occupied | p.full; }
/// Mask of the octants of a brick for which the observations of two scans differ.
[[nodiscard]] inline unsigned different_octants(const scan& a, const scan::part& in_a, const scan& b,
                                                const scan::part& in_b) noexcept {
  const auto x = a.masks(in_a), y = b.masks(in_b);
  unsigned different = 0;
  for (unsigned i = 0; i != 8; ++i)
    if (((x.free[i] ^ y.free[i]) | (x.occupied[i] ^ y.occupied[i])) != 0) different |= 1U << i;
  return different;
}

}  // namespace detail

template <replayable_octree Octree>
void scan_history<Octree>::set(std::uint64_t frame, const scan& voxels) {
  const std::uint32_t number = make_scan(frame);
  change_uses(number, voxels);
  scans_[number].voxels = voxels;
  apply_fresh(number);
}

template <replayable_octree Octree>
bool scan_history<Octree>::remove(std::uint64_t frame) {
  const auto at = find(frame);
  if (at == order_.end() || at->frame != frame) return false;
  const std::uint32_t number = at->number;
  change_uses(number, {});
  scans_[number] = {};
  order_.erase(at);
  free_.push_back(number);
  return true;
}

template <replayable_octree Octree>
const scan* scan_history<Octree>::find_scan(std::uint64_t frame) const noexcept {
  const auto at = std::lower_bound(order_.begin(), order_.end(), frame, is_before);
  return at == order_.end() || at->frame != frame ? nullptr : &scans_[at->number].voxels;
}

template <replayable_octree Octree>
std::size_t scan_history<Octree>::replay_stale(const parallel_policy& policy, const replay_limits& limits) {
  if (stale_bricks() == 0 || limits.bricks == 0) return 0;
  const auto start = std::chrono::steady_clock::now();
  const std::size_t wanted = std::min(limits.bricks, stale_bricks());
  std::size_t done = 0;
  map_.change_store([&](auto& store, change_log* log) {
    do {
      const std::size_t count = std::min(wanted - done, batch * std::max(1U, policy.threads()));
      replay_first(policy, store, log, count);
      done += count;
    } while (done != wanted && std::chrono::steady_clock::now() - start < limits.time);
  });
  return done;
}

template <replayable_octree Octree>
std::size_t scan_history<Octree>::bytes() const noexcept {
  std::size_t n = uses_.bytes() + scans_.capacity() * sizeof(entry) + order_.capacity() * sizeof(place) +
                  (free_.capacity() + fresh_.capacity()) * sizeof(std::uint32_t);
  for (const entry& s : scans_) n += s.voxels.bytes();
  return n;
}

template <replayable_octree Octree>
auto scan_history<Octree>::find(std::uint64_t frame) noexcept -> typename std::vector<place>::iterator {
  if (order_.empty() || order_.back().frame < frame) return order_.end();
  return std::lower_bound(order_.begin(), order_.end(), frame, is_before);
}

template <replayable_octree Octree>
std::uint32_t scan_history<Octree>::make_scan(std::uint64_t frame) {
  const auto at = find(frame);
  if (at != order_.end() && at->frame == frame) return at->number;
  std::uint32_t number = 0;
  if (free_.empty()) {
    number = static_cast<std::uint32_t>(scans_.size());
    scans_.emplace_back();
  } else {
    number = free_.back();
    free_.pop_back();
  }
  scans_[number].frame = frame;
  order_.insert(at, {frame, number});
  return number;
}

template <replayable_octree Octree>
auto scan_history<Octree>::find_place(std::vector<detail::brick_use>& uses, std::uint64_t frame) const noexcept
    -> std::vector<detail::brick_use>::iterator {
  if (uses.empty() || scans_[uses.back().scan].frame < frame) return uses.end();
  return std::lower_bound(uses.begin(), uses.end(), frame,
                          [&](const detail::brick_use& u, std::uint64_t f) { return scans_[u.scan].frame < f; });
}

template <replayable_octree Octree>
void scan_history<Octree>::change_uses(std::uint32_t number, const scan& after) {
  const entry& s = scans_[number];
  const auto old_parts = s.voxels.parts(), new_parts = after.parts();
  std::size_t i = 0;
  const auto drop = [&](const scan::part& p) {
    const std::uint32_t brick = uses_.find_or_add(p.name);
    auto& uses = uses_[brick].uses;
    uses.erase(find_place(uses, s.frame));
    uses_.mark_stale(brick, detail::observed_octants(p));
  };
  fresh_.clear();
  for (std::uint32_t j = 0; j != new_parts.size(); ++j) {
    const scan::part& p = new_parts[j];
    for (; i != old_parts.size() && old_parts[i].name < p.name; ++i) drop(old_parts[i]);
    const std::uint32_t brick = uses_.find_or_add(p.name);
    auto& uses = uses_[brick].uses;
    const auto at = find_place(uses, s.frame);
    if (i != old_parts.size() && old_parts[i].name == p.name) {
      at->part = j;
      uses_.mark_stale(brick, detail::different_octants(s.voxels, old_parts[i], after, p));
      ++i;
    } else if (at == uses.end()) {
      uses.push_back({number, j});
      fresh_.push_back(j);
    } else {
      uses.insert(at, {number, j});
      uses_.mark_stale(brick, detail::observed_octants(p));
    }
  }
  for (; i != old_parts.size(); ++i) drop(old_parts[i]);
}

template <replayable_octree Octree>
void scan_history<Octree>::apply_fresh(std::uint32_t number) {
  if (fresh_.empty()) return;
  const scan& voxels = scans_[number].voxels;
  map_.change_store([&](auto& store, change_log* log) {
    integration_summary counted;
    for (const std::uint32_t i : fresh_) {
      const scan::part& p = voxels.parts()[i];
      detail::apply_brick<model>(
          store, p.name, [&](const auto& visit) { voxels.for_each_octant(p, visit); }, counted, log);
    }
  });
}

template <replayable_octree Octree>
void scan_history<Octree>::replay_first(const parallel_policy& policy, detail::brick_store<value_type>& store,
                                        change_log* log, std::size_t count) {
  if (replayed_.size() < count) replayed_.resize(count);
  const auto stale = uses_.stale().first(count);
  const auto voxels_of = [&](std::uint32_t number) -> const scan& { return scans_[number].voxels; };
  for_each_index(policy, count, 4,
                 [&](std::size_t i) { detail::replay_brick<model>(store, uses_[stale[i]], voxels_of, replayed_[i]); });
  unknown_.clear();
  for (std::size_t i = 0; i != count; ++i) {
    const std::uint64_t name = uses_[stale[i]].name;
    if (!detail::store_replayed(store, name, replayed_[i], log)) unknown_.push_back(name);
  }
  store.erase_bricks(unknown_);
  uses_.finish(count);
}

}  // namespace orbis::octree
