// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// One scan as sets of crossed and hit voxels. Uses bit masks per brick, so that marking a voxel a thousand times takes
/// a thousand `or` operations but no additional memory.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/octree/detail/storage/brick.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// Masks of a scan for one brick; word i is octant i.
struct scan_brick {
  std::uint64_t name = 0;
  std::array<std::uint64_t, 8> free{};
  std::array<std::uint64_t, 8> occupied{};
};

/// The voxels that a scan observes. Reused between scans; memory is freed only if a scan needs much less than an
/// earlier one.
class scan_masks {
 public:
  [[nodiscard]] const std::vector<scan_brick>& bricks() const noexcept { return bricks_; }
  void clear() noexcept {
    constexpr std::size_t few = 1U << 16U, rarely = 16;
    if (bricks_.capacity() > few && bricks_.size() < bricks_.capacity() / rarely) {
      index_ = hash_index{};
      bricks_ = std::vector<scan_brick>{};
    }
    index_.clear();
    bricks_.clear();
  }
  /// Returns the masks of the brick that contains `k`; valid until the next call.
  [[nodiscard]] scan_brick& at(const voxel_key& k) { return named(node_name(k, brick_level)); }

  /// Returns the masks of a named brick, or null.
  [[nodiscard]] const scan_brick* find(std::uint64_t name) const noexcept {
    const std::uint32_t i = index_.find(name);
    return i == hash_index::none ? nullptr : &bricks_[i];
  }

  void mark_occupied(const voxel_key& k) {
    const std::uint32_t place = place_in_brick(k);
    at(k).occupied[place >> 6U] |= std::uint64_t{1} << (place & 63U);
  }
  void mark_free(const voxel_key& k) {
    const std::uint32_t place = place_in_brick(k);
    at(k).free[place >> 6U] |= std::uint64_t{1} << (place & 63U);
  }
  /// Adds the marks of `other`.
  void merge(const scan_masks& other) {
    for (const scan_brick& from : other.bricks_) {
      scan_brick& to = named(from.name);
      for (std::size_t i = 0; i != 8; ++i) {
        to.free[i] |= from.free[i];
        to.occupied[i] |= from.occupied[i];
      }
    }
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return index_.memory_bytes() + bricks_.capacity() * sizeof(scan_brick);
  }

 private:
  [[nodiscard]] scan_brick& named(std::uint64_t name) {
    if (last_ < bricks_.size() && bricks_[last_].name == name) return bricks_[last_];
    const std::uint32_t i = index_.find(name);
    last_ = i != hash_index::none ? i : bricks_.size();
    if (last_ != bricks_.size()) return bricks_[last_];
    index_.set(name, static_cast<std::uint32_t>(last_));
    return bricks_.emplace_back(scan_brick{.name = name});
  }

  hash_index index_;
  std::vector<scan_brick> bricks_;
  std::size_t last_ = 0;  ///< the last brick used; consecutive voxels are mostly in the same brick
};

/// Callback that sets the bits of the voxels in a named brick that a miss would not change. It is type-erased, so that
/// the algorithms need not be compiled for each map type. Can be called from several threads.
struct saturated_voxels {
  using words = std::array<std::uint64_t, 8>;

  void (*find)(const void* map, std::uint64_t name, words&) = nullptr;  ///< null: no voxel is saturated
  const void* map = nullptr;

  void operator()(std::uint64_t name, words& saturated) const {
    if (find != nullptr) find(map, name, saturated);
  }
};

/// Calls `visit(place)` for every bit set in `masks`; `place` is the voxel's place in the brick.
template <class Visit>
void for_each_place(const std::array<std::uint64_t, 8>& masks, Visit&& visit) {
  for (std::uint32_t octant = 0; octant != 8; ++octant)
    for (std::uint64_t bits = masks[octant]; bits != 0; bits &= bits - 1)
      visit(octant << 6U | static_cast<std::uint32_t>(std::countr_zero(bits)));
}

}  // namespace orbis::octree::detail
