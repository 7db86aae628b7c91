// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Index of the scans that observe each brick, and a queue of the octants to replay.
#pragma once

#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/core/hash_index.hpp>
#include <orbis/octree/detail/storage/packed_block.hpp>

namespace orbis::octree::detail {

/// Octants of a brick as computed from the scans, and the voxels in which they differ from the stored octants.
template <class T>
struct replayed_brick {
  std::array<block<T>, 8> octants;
  std::array<std::uint64_t, 8> changed{};  ///< zero for octants that were not replayed
};

/// A scan's observations of a brick: the index of the scan, and the index of the part in octree::scan::parts().
struct brick_use {
  std::uint32_t scan, part;
};

/// A brick, the scans that observe it, in order, and its stale octants (bit i: octant i), which do not hold the result
/// of these scans yet.
struct used_brick {
  std::uint64_t name = 0;
  std::uint8_t stale = 0;
  std::vector<brick_use> uses;
};

/// All bricks observed by scans, and a queue of those with stale octants. A brick without scans is removed when it is
/// no longer stale; its memory is reused.
template <class = void>
class basic_brick_uses {
 public:
  /// Returns the index of a brick, adding the brick if needed; valid until the brick is removed. O(1).
  [[nodiscard]] std::uint32_t find_or_add(std::uint64_t name) {
    const std::uint32_t found = index_.find(name);
    if (found != hash_index::none) return found;
    std::uint32_t number = 0;
    if (free_.empty()) {
      number = static_cast<std::uint32_t>(bricks_.size());
      bricks_.emplace_back();
    } else {
      number = free_.back();
      free_.pop_back();
    }
    bricks_[number].name = name;
    index_.set(name, number);
    return number;
  }
  [[nodiscard]] used_brick& operator[](std::uint32_t number) noexcept { return bricks_[number]; }
  [[nodiscard]] const used_brick& operator[](std::uint32_t number) const noexcept { return bricks_[number]; }

  /// Marks octants of a brick as stale.
  void mark_stale(std::uint32_t number, unsigned octants) {
    if (octants == 0) return;
    used_brick& b = bricks_[number];
    if (b.stale == 0) queue_.push_back(number);
    b.stale = static_cast<std::uint8_t>(b.stale | octants);
  }
  /// Bricks with stale octants, longest stale first.
  [[nodiscard]] std::span<const std::uint32_t> stale() const noexcept { return std::span{queue_}.subspan(done_); }
  /// Marks the first `count` stale bricks as up to date.
  void finish(std::size_t count) {
    assert(count <= stale().size());
    for (const std::uint32_t number : stale().first(count)) {
      used_brick& b = bricks_[number];
      b.stale = 0;
      if (!b.uses.empty()) continue;
      index_.erase(b.name);
      free_.push_back(number);
    }
    done_ += count;
    if (done_ < queue_.size() / 2) return;
    queue_.erase(queue_.begin(), queue_.begin() + static_cast<std::ptrdiff_t>(done_));
    done_ = 0;
  }
  /// Number of bricks.
  [[nodiscard]] std::size_t size() const noexcept { return index_.size(); }
  /// Heap memory in bytes. O(bricks).
  [[nodiscard]] std::size_t bytes() const noexcept {
    std::size_t n = index_.memory_bytes() + bricks_.capacity() * sizeof(used_brick) +
                    (free_.capacity() + queue_.capacity()) * sizeof(std::uint32_t);
    for (const used_brick& b : bricks_) n += b.uses.capacity() * sizeof(brick_use);
    return n;
  }

 private:
  hash_index index_;
  std::vector<used_brick> bricks_;
  std::vector<std::uint32_t> free_;   ///< unused brick indices
  std::vector<std::uint32_t> queue_;  ///< indices of the stale bricks, which start at position done_
  std::size_t done_ = 0;
};
using brick_uses = basic_brick_uses<>;

}  // namespace orbis::octree::detail
