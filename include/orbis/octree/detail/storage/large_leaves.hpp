// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Leaves larger than a brick. There are only a few; a look-up tries the names of the nodes above brick level that
/// contain the voxel.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>

#include <orbis/core/cow_pages.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>

namespace orbis::octree::detail {

/// A set of disjoint nodes larger than a brick, each with one value.
template <class T>
class large_leaves {
 public:
  struct leaf {
    std::uint64_t name = 0;
    T value{};
  };

  large_leaves() = default;
  large_leaves(const large_leaves&) = default;
  large_leaves(large_leaves&& other) noexcept
      : index_{std::move(other.index_)},
        leaves_{std::move(other.leaves_)},
        on_level_{std::exchange(other.on_level_, {})},
        levels_{std::exchange(other.levels_, 0)} {}
  large_leaves& operator=(large_leaves other) noexcept {
    index_ = std::move(other.index_);
    leaves_ = std::move(other.leaves_);
    on_level_ = other.on_level_;
    levels_ = other.levels_;
    return *this;
  }
  ~large_leaves() = default;

  [[nodiscard]] bool empty() const noexcept { return leaves_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return leaves_.size(); }
  /// Returns the i-th leaf, in unspecified order. @pre i < size()
  [[nodiscard]] const leaf& operator[](std::size_t i) const noexcept { return leaves_[i]; }
  /// Returns the leaf that contains `k`, or null. O(levels with leaves).
  [[nodiscard]] const leaf* find(const voxel_key& k) const noexcept {
    for (unsigned levels = levels_; levels != 0; levels &= levels - 1) {
      const std::uint32_t i = index_.find(node_name(k, std::countr_zero(levels)));
      if (i != hash_index::none) return &leaves_[i];
    }
    return nullptr;
  }
  /// Adds a leaf. @pre no other leaf overlaps the node
  void add(std::uint64_t name, T value) {
    index_.set(name, static_cast<std::uint32_t>(leaves_.size()));
    leaves_.push_back({name, value});
    const auto level = static_cast<unsigned>(named_level(name));
    ++on_level_[level];
    levels_ |= 1U << level;
  }
  void set_value(std::size_t i, T value) { leaves_.writable(i).value = value; }
  /// Removes the leaf with this name, if it exists; the last leaf takes its position.
  void erase(std::uint64_t name) {
    const std::uint32_t i = index_.find(name);
    if (i == hash_index::none) return;
    const auto level = static_cast<unsigned>(named_level(name));
    if (--on_level_[level] == 0) levels_ &= ~(1U << level);
    index_.erase(name);
    const leaf last = leaves_[leaves_.size() - 1];
    if (last.name != name) {
      leaves_.writable(i) = last;
      index_.set(last.name, i);
    }
    leaves_.resize(leaves_.size() - 1);
    if (leaves_.empty()) *this = large_leaves{};
  }
  /// Heap memory in bytes, including memory shared with copies.
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return index_.memory_bytes() + leaves_.memory_bytes(); }

 private:
  hash_index index_;
  cow_pages<leaf> leaves_;
  std::array<std::uint32_t, max_tree_depth + 1> on_level_{};
  unsigned levels_ = 0;  ///< bit l: there is a leaf at level l
};

}  // namespace orbis::octree::detail
