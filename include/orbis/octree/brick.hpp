// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the voxels lie: a hash of bricks of 8x8x8 voxels, each of eight octants of 4x4x4, each of
/// which is unknown, uniform (one value: this is pruning) or a block of 64 values.
///
/// Everything is in Morton order (x lowest, then y, then z): the eight children of a tree node are
/// eight neighbours in memory, a byte of a 64-bit mask is a node of 2x2x2, a mask is an octant.
/// Leaves bigger than a brick are kept by their own name and split when something inside changes.
#pragma once

#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/octree/hash_index.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree {

/// The depth of the nodes that are bricks, octants, and groups of 2x2x2.
inline constexpr int brick_depth = tree_depth - 3;
inline constexpr int octant_depth = tree_depth - 2;

/// Bits 0, 1, 2 moved to 0, 3, 6.
[[nodiscard]] constexpr std::uint32_t spread3(std::uint32_t v) noexcept {
  return (v & 1U) | (v & 2U) << 2U | (v & 4U) << 4U;
}
/// A voxel's place in its brick: bits 0-5 within the octant, bits 6-8 the octant.
[[nodiscard]] constexpr std::uint32_t place_in_brick(const voxel_key& k) noexcept {
  return spread3(k.x) | spread3(k.y) << 1U | spread3(k.z) << 2U;
}
/// The lowest voxel, relative to the brick's, of a place in a brick.
[[nodiscard]] constexpr voxel_key voxel_in_brick(std::uint32_t place) noexcept {
  const auto gather = [](std::uint32_t v) { return (v & 1U) | (v >> 2U & 2U) | (v >> 4U & 4U); };
  return {gather(place), gather(place >> 1U), gather(place >> 2U)};
}

/// The name of the node at `depth` that contains `k`, unique among all nodes of all depths.
[[nodiscard]] constexpr std::uint64_t node_name(const voxel_key& k, int depth) noexcept {
  const auto s = static_cast<unsigned>(tree_depth - depth);
  return std::uint64_t{k.x >> s} | std::uint64_t{k.y >> s} << 19U | std::uint64_t{k.z >> s} << 38U |
         std::uint64_t{static_cast<unsigned>(depth)} << 57U;
}
/// The lowest voxel of a named node.
[[nodiscard]] constexpr voxel_key named_key(std::uint64_t name) noexcept {
  const auto s = static_cast<unsigned>(tree_depth) - static_cast<unsigned>(name >> 57U);
  const auto part = [&](unsigned shift) { return static_cast<std::uint32_t>(name >> shift & 0x7ffffU) << s; };
  return {part(0), part(19), part(38)};
}

/// An octant that is neither unknown nor uniform.
template <class T>
struct block {
  std::array<T, 64> value{};
  std::uint64_t known = 0;

  [[nodiscard]] bool is_uniform() const noexcept {
    if (known != ~std::uint64_t{0}) return false;
    bool same = true;
    for (const T v : value) same &= v == value[0];
    return same;
  }
};

/// 8x8x8 voxels.
template <class T>
struct brick {
  std::uint64_t name;        ///< see node_name
  std::uint8_t uniform = 0;  ///< bit i: octant i has one value, value[i]
  std::uint8_t dense = 0;    ///< bit i: octant i is block number at[i]
  std::array<std::uint32_t, 8> at{};
  std::array<T, 8> value{};
};

/// A leaf bigger than a brick.
template <class T>
struct large_leaf {
  std::uint64_t name;
  T value;
};

/// All the bricks of a map.
template <class T>
class brick_store {
 public:
  [[nodiscard]] const std::vector<brick<T>>& bricks() const noexcept { return bricks_; }
  [[nodiscard]] const block<T>& block_at(std::uint32_t i) const noexcept { return blocks_[i]; }
  [[nodiscard]] block<T>& block_at(std::uint32_t i) noexcept { return blocks_[i]; }

  /// The brick that contains `k`, or null.
  [[nodiscard]] const brick<T>* find(const voxel_key& k) const noexcept {
    const std::uint32_t i = index_.find(node_name(k, brick_depth));
    return i == hash_index::none ? nullptr : &bricks_[i];
  }
  /// The value of the leaf bigger than a brick that contains `k`, or null.
  [[nodiscard]] const T* find_large(const voxel_key& k) const noexcept {
    const std::uint32_t i = find_large_index(k);
    return i == hash_index::none ? nullptr : &large_[i].value;
  }
  /// The value of voxel `k`, or null where nothing is known.
  [[nodiscard]] const T* value(const voxel_key& k) const noexcept {
    const brick<T>* b = find(k);
    if (b == nullptr) return large_.empty() ? nullptr : find_large(k);
    const std::uint32_t place = place_in_brick(k);
    const std::uint32_t octant = place >> 6U;
    if ((b->uniform >> octant & 1U) != 0) return &b->value[octant];
    if ((b->dense >> octant & 1U) == 0) return nullptr;
    const block<T>& voxels = blocks_[b->at[octant]];
    return (voxels.known >> (place & 63U) & 1U) != 0 ? &voxels.value[place & 63U] : nullptr;
  }

  /// The brick that contains `k`, made if need be; splits a larger leaf.
  [[nodiscard]] brick<T>& make(const voxel_key& k) {
    const std::uint32_t i = index_.find(node_name(k, brick_depth));
    if (i != hash_index::none) return bricks_[i];
    if (const std::uint32_t large = large_.empty() ? hash_index::none : find_large_index(k);
        large != hash_index::none) {
      split(large, k);
      return bricks_[index_.find(node_name(k, brick_depth))];
    }
    return add(node_name(k, brick_depth));
  }
  /// Octant `i` of `b` as a block, made if need be.
  [[nodiscard]] block<T>& make_block(brick<T>& b, std::uint32_t i) {
    const auto bit = static_cast<std::uint8_t>(1U << i);
    if ((b.dense & bit) != 0) return blocks_[b.at[i]];
    if (free_.empty()) {
      if (blocks_.size() == blocks_.capacity()) blocks_.reserve(blocks_.size() + blocks_.size() / 4 + 16);
      free_.push_back(static_cast<std::uint32_t>(blocks_.size()));
      blocks_.emplace_back();
    }
    b.at[i] = free_.back();
    free_.pop_back();
    b.dense |= bit;
    block<T>& made = blocks_[b.at[i]];
    if ((b.uniform & bit) != 0) {
      made.value.fill(b.value[i]);
      made.known = ~std::uint64_t{0};
      b.uniform &= static_cast<std::uint8_t>(~bit);
    } else {
      made = {};
    }
    return made;
  }
  /// Gives octant `i` of `b` one value for all its voxels.
  void make_uniform(brick<T>& b, std::uint32_t i, T value) {
    const auto bit = static_cast<std::uint8_t>(1U << i);
    if ((b.dense & bit) != 0) free_.push_back(b.at[i]);
    b.dense &= static_cast<std::uint8_t>(~bit);
    b.uniform |= bit;
    b.value[i] = value;
  }
  /// Gives every voxel of the node at `depth` that starts at `k` the same value.
  /// @pre nothing is known inside it
  void set_node(const voxel_key& k, int depth, T value) {
    if (depth < brick_depth) {
      large_index_.set(node_name(k, depth), static_cast<std::uint32_t>(large_.size()));
      large_.push_back({node_name(k, depth), value});
      large_depths_ |= 1U << static_cast<unsigned>(depth);
      return;
    }
    brick<T>& b = make(k);
    const std::uint32_t place = place_in_brick(k);
    if (depth == brick_depth) {
      for (std::uint32_t i = 0; i != 8; ++i) make_uniform(b, i, value);
    } else if (depth == octant_depth) {
      make_uniform(b, place >> 6U, value);
    } else {
      block<T>& voxels = make_block(b, place >> 6U);
      const std::uint32_t count = depth == tree_depth ? 1 : 8;
      for (std::uint32_t i = 0; i != count; ++i) {
        voxels.value[(place & 63U) + i] = value;
        voxels.known |= std::uint64_t{1} << ((place & 63U) + i);
      }
      if (voxels.is_uniform()) make_uniform(b, place >> 6U, value);
    }
  }
  /// Calls `visit(name, value)` for every leaf bigger than a brick.
  template <class Visit>
  void for_each_large(Visit&& visit) const {
    for (const large_leaf<T>& leaf : large_)
      if (leaf.name != gone) visit(leaf.name, leaf.value);
  }
  [[nodiscard]] bool empty() const noexcept { return bricks_.empty() && large_.empty(); }
  void clear() { *this = {}; }
  /// Bytes on the heap.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return index_.memory_bytes() + large_index_.memory_bytes() + bricks_.capacity() * sizeof(brick<T>) +
           blocks_.capacity() * sizeof(block<T>) + large_.capacity() * sizeof(large_leaf<T>) +
           free_.capacity() * sizeof(std::uint32_t);
  }

 private:
  static constexpr std::uint64_t gone = ~std::uint64_t{0};

  brick<T>& add(std::uint64_t name) {
    index_.set(name, static_cast<std::uint32_t>(bricks_.size()));
    return bricks_.emplace_back(brick<T>{name});
  }
  [[nodiscard]] std::uint32_t find_large_index(const voxel_key& k) const noexcept {
    for (unsigned depths = large_depths_; depths != 0; depths &= depths - 1) {
      const std::uint32_t i = large_index_.find(node_name(k, std::countr_zero(depths)));
      if (i != hash_index::none) return i;
    }
    return hash_index::none;
  }
  /// Replaces a large leaf by its brick that contains `k` and that brick's siblings on the way down.
  void split(std::uint32_t large, const voxel_key& k) {
    const auto [name, value] = std::exchange(large_[large], {gone, T{}});
    large_index_.set(name, hash_index::none);
    voxel_key node = named_key(name);
    for (int depth = static_cast<int>(name >> 57U) + 1; depth <= brick_depth; ++depth) {
      const std::uint32_t cells = node_cells(depth);
      const voxel_key parent = node;
      for (unsigned i = 0; i != 8; ++i) {
        const voxel_key child = child_key(parent, i, cells);
        if (node_name(child, depth) == node_name(k, depth) && depth != brick_depth)
          node = child;
        else
          set_whole(child, depth, value);
      }
    }
  }
  void set_whole(const voxel_key& k, int depth, T value) {
    if (depth == brick_depth) {
      brick<T>& b = add(node_name(k, depth));
      b.uniform = 0xff;
      b.value.fill(value);
    } else {
      set_node(k, depth, value);
    }
  }

  hash_index index_;
  hash_index large_index_;
  std::vector<brick<T>> bricks_;
  std::vector<block<T>> blocks_;
  std::vector<std::uint32_t> free_;  ///< blocks not in use
  std::vector<large_leaf<T>> large_;
  unsigned large_depths_ = 0;  ///< bit d: there has been a large leaf at depth d
};

}  // namespace orbis::octree
