// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The occupied voxels of a cloud or of a part of it, in the order in which they first occur.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_cells.hpp>

namespace orbis::cloud::detail {

/// A hash table of rows by key. A row is contiguous: an access to a known voxel costs one or two cache misses in
/// addition to the one for its slot. Open addressing with linear probing, at most half full.
///
/// The branch on new voxels would be hard to predict, so an update does the same for new and known voxels: it reads a
/// row (row 0 for an empty slot) and writes a row (the next free one for an empty slot).
template <class Record>
class voxel_table {
  static_assert(std::is_trivially_copyable_v<Record> && std::is_trivially_default_constructible_v<Record>);

 public:
  struct row {
    voxel_key key;
    std::uint32_t first;  ///< point that created the row
    Record record;
  };

  /// Creates an empty table. New rows begin with the record `empty`.
  explicit voxel_table(const Record& empty) : empty_{empty} { clear(0); }

  /// Removes all rows and makes room for `expected` rows. Keeps the memory.
  void clear(std::size_t expected) {
    size_ = 0;
    make_room(std::max(expected, fewest));
  }
  /// Makes room for `count` more rows. Doubles the capacity, up to `limit` if that suffices.
  void reserve_more(std::size_t count, std::size_t limit) {
    const std::size_t needed = size_ + count;
    if (needed <= most_) return;
    salt_ *= 0x9e3779b1U;  // if the hash order stayed the same, all rows would cluster
    make_room(std::max(needed, std::min(2 * most_, limit)));
    for (std::size_t r = 1; r <= size_; ++r) slots_[free_slot(mixed_key(rows_[r].key))] = static_cast<std::uint32_t>(r);
  }
  /// Prefetches the memory that updates with these hashes will access, if the table is large.
  void expect(std::span<const std::uint32_t> hashes) const noexcept {
    if (slots_.size() < large) return;
    for (const std::uint32_t hash : hashes) __builtin_prefetch(&slots_[first_slot(hash)]);
    for (const std::uint32_t hash : hashes) __builtin_prefetch(&rows_[slots_[first_slot(hash)]]);
  }
  /// Calls `add(record)` with the record of a key, or with that of a new row created by point `first`. `record` is a
  /// copy, which is written back afterwards. @pre hash == mixed_key(key), there is room for one more row
  template <class Add>
  void update(const voxel_key& key, std::uint32_t hash, std::uint32_t first, const Add& add) {
    std::size_t i = first_slot(hash);
    std::uint32_t known = slots_[i];
    while ((known != 0) & !same_key(rows_[known].key, key)) {
      i = (i + 1) & mask_;
      known = slots_[i];
    }
    row made = rows_[known];
    made.key = key;
    made.first = known != 0 ? made.first : first;
    add(made.record);
    const std::uint32_t place = known != 0 ? known : static_cast<std::uint32_t>(size_ + 1);
    rows_[place] = made;
    slots_[i] = place;
    size_ += known == 0;
  }
  [[nodiscard]] std::span<const row> rows() const noexcept { return {rows_.get() + 1, size_}; }

 private:
  static constexpr std::size_t fewest = 64, large = std::size_t{1} << 16U;

  /// First slot to probe for a hash.
  [[nodiscard]] std::size_t first_slot(std::uint32_t hash) const noexcept { return (hash * salt_) >> shift_; }
  [[nodiscard]] std::size_t free_slot(std::uint32_t hash) const noexcept {
    std::size_t i = first_slot(hash);
    while (slots_[i] != 0) i = (i + 1) & mask_;
    return i;
  }
  /// Makes room for `most` rows; clears the slots.
  void make_room(std::size_t most) {
    if (capacity_ < most) {
      auto rows = std::make_unique_for_overwrite<row[]>(most + 1);  // pages are not touched before use
      rows[0] = {{}, 0, empty_};
      if (size_ != 0) std::copy_n(&rows_[1], size_, &rows[1]);
      rows_ = std::move(rows);
      capacity_ = most;
    }
    const std::size_t slots = std::min(std::bit_ceil(2 * most), std::size_t{1} << 32U);  // at most one per hash
    slots_.assign(slots, 0);
    most_ = most;
    mask_ = slots - 1;
    shift_ = 32 - static_cast<unsigned>(std::countr_zero(slots));
  }

  Record empty_;
  std::unique_ptr<row[]> rows_;       ///< row 0, the template of new rows, followed by size_ rows
  std::vector<std::uint32_t> slots_;  ///< 2^(32 - shift_) row indices, 0: empty
  std::size_t size_ = 0, most_ = 0, capacity_ = 0, mask_ = 0;
  std::uint32_t salt_ = 1;  ///< odd
  unsigned shift_ = 0;
};

}  // namespace orbis::cloud::detail
