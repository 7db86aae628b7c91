// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Storage of a map. A hash table finds chunks of 4x4x4 bricks. A brick has eight octants of 4x4x4 voxels. An octant is
/// unknown, uniform (one value, the equivalent of pruning), or stored as indices into its distinct values. Leaves
/// larger than a brick are stored separately, and are split when a voxel inside changes.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/cow_pages.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/octree/detail/storage/large_leaves.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>
#include <orbis/octree/detail/storage/octant_record.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>

namespace orbis::octree::detail {

/// A node of 8x8x8 voxels.
template <class T>
struct brick {
  std::uint64_t name = 0;    ///< see node_name
  std::uint8_t uniform = 0;  ///< bit i: octant i has one value, value[i]
  std::uint8_t dense = 0;    ///< bit i: octant i is stored voxel by voxel in record at[i]
  std::array<std::uint32_t, 8> at{};
  std::array<T, 8> value{};  ///< the largest value in octant i, if any is known

  [[nodiscard]] bool is_known() const noexcept { return (uniform | dense) != 0; }
  /// Returns true if all 512 voxels have the same value.
  [[nodiscard]] bool is_uniform() const noexcept {
    bool same = uniform == 0xff;
    for (const T v : value) same &= v == value[0];
    return same;
  }
};

/// All bricks of a map. A copy shares all data with the original until one of them changes.
template <class T>
class brick_store {
 public:
  static constexpr std::uint32_t none = hash_index::none;

  /// A node of 4x4x4 bricks in Morton order; `none` for missing bricks.
  struct chunk {
    std::uint64_t name = 0;
    std::array<std::uint32_t, 64> at{};
  };

  // -- look-up

  [[nodiscard]] bool empty() const noexcept { return brick_count() == 0 && large_.empty(); }
  [[nodiscard]] std::size_t brick_count() const noexcept { return bricks_.size() - free_bricks_.size(); }
  [[nodiscard]] std::size_t chunk_count() const noexcept { return chunks_.size(); }
  /// Returns the chunk that contains `k`, or null.
  [[nodiscard]] const chunk* find_chunk(const voxel_key& k) const noexcept {
    const std::uint32_t i = index_.find(node_name(k, chunk_level));
    return i == none ? nullptr : &chunks_[i];
  }
  /// Returns the brick at a place in a chunk, or null.
  [[nodiscard]] const brick<T>* find(const chunk& c, std::uint32_t place) const noexcept {
    return c.at[place] == none ? nullptr : &bricks_[c.at[place]];
  }
  /// Returns the brick that contains `k`, or null.
  [[nodiscard]] const brick<T>* find(const voxel_key& k) const noexcept {
    const chunk* const c = find_chunk(k);
    return c == nullptr ? nullptr : find(*c, place_in_chunk(k));
  }
  /// Returns true if there are leaves larger than a brick.
  [[nodiscard]] bool has_large() const noexcept { return !large_.empty(); }
  [[nodiscard]] std::size_t large_count() const noexcept { return large_.size(); }
  /// Returns the value and level of the leaf that contains `k` and is larger than a brick, if it exists.
  [[nodiscard]] std::optional<std::pair<T, int>> find_large(const voxel_key& k) const noexcept {
    const auto* const leaf = large_.find(k);
    return leaf != nullptr ? std::optional{std::pair{leaf->value, named_level(leaf->name)}} : std::nullopt;
  }
  /// Returns the value of the leaf that contains `k` and is larger than a brick; null if there is none. Valid until the
  /// store changes.
  [[nodiscard]] const T* find_large_value(const voxel_key& k) const noexcept {
    const auto* const leaf = large_.find(k);
    return leaf != nullptr ? &leaf->value : nullptr;
  }
  /// Returns the value at a place in a brick, empty if unknown.
  [[nodiscard]] std::optional<T> value(const brick<T>& b, std::uint32_t place) const noexcept {
    const std::uint32_t octant = place >> 6U;
    if ((b.uniform >> octant & 1U) != 0) return b.value[octant];
    if ((b.dense >> octant & 1U) == 0) return std::nullopt;
    return pools_.read(b.at[octant], [&](const auto& r) -> std::optional<T> {
      const std::uint32_t p = place & 63U;
      return (r.known >> p & 1U) != 0 ? std::optional{r.at(p)} : std::nullopt;
    });
  }
  /// Returns the value of voxel `k`, empty if unknown.
  [[nodiscard]] std::optional<T> value(const voxel_key& k) const noexcept {
    const brick<T>* const b = find(k);
    if (b != nullptr) return value(*b, place_in_brick(k));
    const auto* const leaf = large_.find(k);
    return leaf != nullptr ? std::optional{leaf->value} : std::nullopt;
  }
  /// Views octant `i` of `b` in place; valid until the store or `b` changes.
  [[nodiscard]] octant_view<T> view(const brick<T>& b, std::uint32_t i) const noexcept {
    if ((b.uniform >> i & 1U) != 0) return {~std::uint64_t{0}, nullptr, 0, &b.value[i]};
    if ((b.dense >> i & 1U) == 0) return {};
    return pools_.read(b.at[i], [](const auto& r) { return r.view(); });
  }
  /// Mask of the known voxels of octant `i` of `b`.
  [[nodiscard]] std::uint64_t known(const brick<T>& b, std::uint32_t i) const noexcept {
    if ((b.uniform >> i & 1U) != 0) return ~std::uint64_t{0};
    if ((b.dense >> i & 1U) == 0) return 0;
    return pools_.read(b.at[i], [](const auto& r) { return r.known; });
  }
  /// Mask of the known voxels of octant `i` of `b` whose values satisfy `wanted`.
  template <std::predicate<T> Wanted>
  [[nodiscard]] std::uint64_t voxels_where(const brick<T>& b, std::uint32_t i, Wanted&& wanted) const noexcept {
    if ((b.uniform >> i & 1U) != 0) return wanted(b.value[i]) ? ~std::uint64_t{0} : 0;
    if ((b.dense >> i & 1U) == 0) return 0;
    return pools_.read(b.at[i], [&](const auto& r) { return r.known & r.where(wanted); });
  }
  /// Unpacks octant `i` of `b`.
  void read_octant(const brick<T>& b, std::uint32_t i, block<T>& out) const noexcept {
    if ((b.uniform >> i & 1U) != 0) {
      out.value.fill(b.value[i]);
      out.known = ~std::uint64_t{0};
    } else if ((b.dense >> i & 1U) != 0) {
      pools_.read(b.at[i], [&](const auto& r) { r.unpack(out); });
    } else {
      out.value.fill(T{});
      out.known = 0;
    }
  }
  /// Calls `visit(const chunk&)` for every chunk in Morton order.
  template <std::invocable<const chunk&> Visit>
  void for_each_chunk(Visit&& visit) const {
    for (const auto& [order, i] : sorted_chunks()) visit(chunks_[i]);
  }
  /// Calls `visit(const brick<T>&)` for every brick in Morton order.
  template <std::invocable<const brick<T>&> Visit>
  void for_each_brick(Visit&& visit) const {
    for_each_chunk([&](const chunk& c) {
      for (std::uint32_t place = 0; place != 64; ++place)
        if (c.at[place] != none) visit(bricks_[c.at[place]]);
    });
  }
  /// Calls `visit(name, value)` for every leaf larger than a brick, in unspecified order.
  template <class Visit>
  void for_each_large(Visit&& visit) const {
    for (std::size_t i = 0; i != large_.size(); ++i) visit(large_[i].name, large_[i].value);
  }
  /// Heap memory in bytes, including memory shared with copies.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return index_.memory_bytes() + chunks_.memory_bytes() + bricks_.memory_bytes() + large_.memory_bytes() +
           free_bricks_.capacity() * sizeof(std::uint32_t) + pools_.memory_bytes();
  }

  // -- modification

  /// Returns the brick that contains `k`; creates it if needed, splitting a larger leaf. Valid until the next change to
  /// another brick.
  [[nodiscard]] brick<T>& make(const voxel_key& k) {
    if (const std::uint32_t i = find_brick_index(k); i != none) return bricks_.writable(i);
    if (const auto* const leaf = large_.find(k)) {
      split(leaf->name, leaf->value, k);
      return bricks_.writable(find_brick_index(k));
    }
    return add(k);
  }
  /// Sets all voxels of octant `i` of `b` to one value.
  void make_uniform(brick<T>& b, std::uint32_t i, T value) {
    drop_record(b, i);
    b.uniform |= static_cast<std::uint8_t>(1U << i);
    b.value[i] = value;
  }
  /// Stores `voxels` as octant `i` of `b`.
  void write_octant(brick<T>& b, std::uint32_t i, const block<T>& voxels) {
    palette<T> p;
    find_palette(voxels, p);
    if (p.count <= max_palette) {
      write_octant(b, i, voxels.known, p);
      return;
    }
    make_record(b, i, octant_pools<T>::plain);
    pools_.write(b.at[i], [&](auto& r) {
      if constexpr (requires { r.pack(voxels); }) r.pack(voxels);
    });
    b.value[i] = voxels.value[static_cast<std::size_t>(std::countr_zero(voxels.known))];
    for (std::uint64_t rest = voxels.known; rest != 0; rest &= rest - 1)
      b.value[i] = std::max(b.value[i], voxels.value[static_cast<std::size_t>(std::countr_zero(rest))]);
  }
  /// Stores the voxels `known` with the values of palette `p` as octant `i` of `b`.
  /// @pre p.count <= max_palette, the values of p are distinct and each is used by a known voxel
  void write_octant(brick<T>& b, std::uint32_t i, std::uint64_t known, const palette<T>& p) {
    if (known == 0) {
      drop_record(b, i);
    } else if (p.count == 1 && known == ~std::uint64_t{0}) {
      make_uniform(b, i, p.value[0]);
    } else {
      make_record(b, i, static_cast<unsigned>(std::bit_width(p.count - 1)));
      pools_.write(b.at[i], [&](auto& r) {
        if constexpr (requires { r.pack(known, p); }) r.pack(known, p);
      });
      b.value[i] = *std::max_element(p.value.begin(), p.value.begin() + p.count);
    }
  }
  /// Sets every voxel of the node at `level` that starts at `k` to the same value.
  /// @pre the whole node is unknown
  void set_node(const voxel_key& k, int level, T value) {
    if (level > brick_level) {
      large_.add(node_name(k, level), value);
      return;
    }
    brick<T>& b = make(k);
    const std::uint32_t place = place_in_brick(k);
    if (level == brick_level) {
      for (std::uint32_t i = 0; i != 8; ++i) make_uniform(b, i, value);
    } else if (level == octant_level) {
      make_uniform(b, place >> 6U, value);
    } else {
      block<T> voxels;
      read_octant(b, place >> 6U, voxels);
      const std::uint32_t count = level == 0 ? 1 : 8;
      for (std::uint32_t i = 0; i != count; ++i) {
        voxels.value[(place & 63U) + i] = value;
        voxels.known |= std::uint64_t{1} << ((place & 63U) + i);
      }
      write_octant(b, place >> 6U, voxels);
    }
  }
  /// Replaces every value by `change(value)`; an empty result makes the voxel unknown. Calls `change` at least once for
  /// each value of an octant. Calls `changed(name of the brick, octant, mask of voxels)` for changed voxels, except
  /// those of leaves larger than a brick. O(octants).
  template <class Change, std::invocable<std::uint64_t, std::uint32_t, std::uint64_t> Changed>
  requires std::is_invocable_r_v<std::optional<T>, Change&, T> void transform(Change&& change, Changed&& changed) {
    std::vector<std::uint64_t> empty;
    block<T> voxels;
    for (std::uint32_t i = 0; i != bricks_.size(); ++i) {
      for (std::uint32_t octant = 0; octant != 8; ++octant) {
        const brick<T>& before = bricks_[i];
        std::uint64_t different = 0;
        if ((before.uniform >> octant & 1U) != 0) {
          const std::optional<T> v = change(before.value[octant]);
          if (v == before.value[octant]) continue;
          different = ~std::uint64_t{0};
          brick<T>& b = bricks_.writable(i);
          if (v) b.value[octant] = *v;
          if (!v) drop_record(b, octant);
        } else if ((before.dense >> octant & 1U) != 0) {
          pools_.read(before.at[octant], [&](const auto& r) { r.transformed(change, different).unpack(voxels); });
          if (different != 0) write_octant(bricks_.writable(i), octant, voxels);
        }
        if (different != 0) changed(bricks_[i].name, octant, different);
      }
      if (!bricks_[i].is_known() && bricks_[i].name != 0) empty.push_back(bricks_[i].name);
    }
    std::vector<std::uint64_t> gone;
    for (std::size_t i = 0; i != large_.size(); ++i) {
      if (const std::optional<T> v = change(large_[i].value))
        large_.set_value(i, *v);
      else
        gone.push_back(large_[i].name);
    }
    erase_large(gone);
    erase_bricks(empty);
  }
  /// Removes bricks. O(bricks removed + chunks).
  void erase_bricks(std::span<const std::uint64_t> names) {
    bool emptied = false;
    for (const std::uint64_t name : names) {
      const voxel_key k = named_key(name);
      const std::uint32_t c = index_.find(node_name(k, chunk_level));
      if (c == none || chunks_[c].at[place_in_chunk(k)] == none) continue;
      chunk& from = chunks_.writable(c);
      const std::uint32_t i = std::exchange(from.at[place_in_chunk(k)], none);
      emptied = emptied || std::all_of(from.at.begin(), from.at.end(), [](std::uint32_t b) { return b == none; });
      brick<T>& b = bricks_.writable(i);
      for (std::uint32_t octant = 0; octant != 8; ++octant) drop_record(b, octant);
      b = {};
      free_bricks_.push_back(i);
    }
    if (emptied) erase_empty_chunks();
  }
  /// Removes the leaves larger than a brick with the given names.
  void erase_large(std::span<const std::uint64_t> names) {
    for (const std::uint64_t name : names) large_.erase(name);
  }
  void clear() { *this = {}; }

 private:
  /// Allocates a record in a pool for octant `i` of `b`; replaces an existing one.
  void make_record(brick<T>& b, std::uint32_t i, unsigned number) {
    const auto bit = static_cast<std::uint8_t>(1U << i);
    if ((b.dense & bit) != 0 && octant_pools<T>::pool_number(b.at[i]) == number) return;
    drop_record(b, i);
    b.at[i] = pools_.add(number);
    b.dense |= bit;
  }
  /// Makes octant `i` of `b` unknown.
  void drop_record(brick<T>& b, std::uint32_t i) {
    const auto bit = static_cast<std::uint8_t>(1U << i);
    if ((b.dense & bit) != 0) pools_.erase(b.at[i]);
    b.dense &= static_cast<std::uint8_t>(~bit);
    b.uniform &= static_cast<std::uint8_t>(~bit);
  }

  [[nodiscard]] std::vector<std::pair<std::uint64_t, std::uint32_t>> sorted_chunks() const {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order(chunks_.size());
    for (std::uint32_t i = 0; i != chunks_.size(); ++i) order[i] = {morton_order(named_key(chunks_[i].name)), i};
    std::sort(order.begin(), order.end());
    return order;
  }
  [[nodiscard]] std::uint32_t find_brick_index(const voxel_key& k) const noexcept {
    const chunk* const c = find_chunk(k);
    return c == nullptr ? none : c->at[place_in_chunk(k)];
  }
  /// Adds a brick. @pre no brick contains `k`
  brick<T>& add(const voxel_key& k) {
    const std::uint64_t name = node_name(k, chunk_level);
    std::uint32_t c = index_.find(name);
    if (c == none) {
      c = static_cast<std::uint32_t>(chunks_.size());
      index_.set(name, c);
      chunk made{.name = name};
      made.at.fill(none);
      chunks_.push_back(made);
    }
    std::uint32_t i = 0;
    if (free_bricks_.empty()) {
      i = static_cast<std::uint32_t>(bricks_.size());
      bricks_.push_back({});
    } else {
      i = free_bricks_.back();
      free_bricks_.pop_back();
    }
    chunks_.writable(c).at[place_in_chunk(k)] = i;
    brick<T>& b = bricks_.writable(i);
    b.name = node_name(k, brick_level);
    return b;
  }
  void erase_empty_chunks() {
    cow_pages<chunk> kept;
    for (std::size_t i = 0; i != chunks_.size(); ++i)
      if (std::any_of(chunks_[i].at.begin(), chunks_[i].at.end(), [](std::uint32_t b) { return b != none; }))
        kept.push_back(chunks_[i]);
    if (kept.size() == chunks_.size()) return;
    chunks_ = std::move(kept);
    index_ = hash_index{};
    for (std::uint32_t i = 0; i != chunks_.size(); ++i) index_.set(chunks_[i].name, i);
    if (empty()) clear();
  }

  /// Splits a large leaf into the brick that contains `k`, and the siblings of the nodes on the path to this brick.
  void split(std::uint64_t name, T value, const voxel_key& k) {
    large_.erase(name);
    voxel_key node = named_key(name);
    for (int level = named_level(name) - 1; level >= brick_level; --level) {
      const voxel_key parent = node;
      for (unsigned i = 0; i != 8; ++i) {
        const voxel_key child = child_key(parent, i, node_cells(level));
        if (level != brick_level && child == node_key(k, level))
          node = child;
        else
          set_whole(child, level, value);
      }
    }
  }
  void set_whole(const voxel_key& k, int level, T value) {
    if (level == brick_level) {
      brick<T>& b = add(k);
      b.uniform = 0xff;
      b.value.fill(value);
    } else {
      set_node(k, level, value);
    }
  }

  hash_index index_;  ///< chunk indices by name
  cow_pages<chunk> chunks_;
  cow_pages<brick<T>> bricks_;
  std::vector<std::uint32_t> free_bricks_;
  octant_pools<T> pools_;
  large_leaves<T> large_;
};

}  // namespace orbis::octree::detail
