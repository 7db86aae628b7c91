// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The occupied voxels of a small part of space, in the order in which they are first seen.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_cells.hpp>

namespace orbis::cloud::detail {

/// 64 mixed bits of a key, the upper ones best. `Salt` makes different functions.
template <std::uint64_t Salt>
[[nodiscard]] constexpr std::uint64_t mixed_key(const voxel_key& key) noexcept {
  const auto term = [](std::int32_t cell, std::uint64_t odd) {
    return static_cast<std::uint64_t>(std::int64_t{cell}) * odd;
  };
  std::uint64_t h = term(key[0], 0x9e3779b97f4a7c15ULL + Salt) + term(key[1], 0xbf58476d1ce4e5b9ULL + Salt) +
                    term(key[2], 0x94d049bb133111ebULL + Salt);
  h ^= h >> 32U;
  return h * 0xd6e8feb86659fd93ULL;
}

/// Rows by key, with what is needed of a row side by side: one miss of the cache for a voxel that is known, besides the
/// one for its slot. Open addressing with linear probing, at most a third full.
template <class Record>
class voxel_table {
 public:
  struct row {
    voxel_key key;
    std::uint32_t first;  ///< the point that made it
    Record record;
  };

  /// The row of `key`; a new one, with `first` and an empty record, if there is none.
  [[nodiscard]] row& at(const voxel_key& key, std::uint32_t first) {
    std::size_t i = place(key);
    if (slots_[i] != none) return rows_[slots_[i]];
    if (size_ == most_) {
      grow();
      i = place(key);
    }
    slots_[i] = static_cast<std::uint32_t>(size_);
    row& made = rows_[size_++];
    made = {key, first, {}};
    return made;
  }
  [[nodiscard]] std::span<const row> rows() const noexcept { return std::span{rows_}.first(size_); }
  /// Forgets the rows and makes room for `expected` ones. Keeps the memory.
  void clear(std::size_t expected) {
    size_ = 0;
    make_room(std::max(expected, fewest));
  }

 private:
  static constexpr std::uint32_t none = std::numeric_limits<std::uint32_t>::max();
  static constexpr std::size_t fewest = 21;

  [[nodiscard]] std::size_t place(const voxel_key& key) const noexcept {
    std::size_t i = static_cast<std::size_t>(mixed_key<0>(key) >> shift_);
    while (slots_[i] != none && !same_key(rows_[slots_[i]].key, key)) i = (i + 1) & (slots_.size() - 1);
    return i;
  }
  void grow() {
    make_room(2 * most_);
    for (std::size_t r = 0; r != size_; ++r) slots_[place(rows_[r].key)] = static_cast<std::uint32_t>(r);
  }
  /// For `most` rows; the slots are empty then.
  void make_room(std::size_t most) {
    most_ = most;
    if (rows_.size() < most) rows_.resize(most);
    const std::size_t slots = std::bit_ceil(3 * most);
    slots_.assign(slots, none);
    shift_ = 64 - static_cast<unsigned>(std::countr_zero(slots));
  }

  std::vector<row> rows_ = std::vector<row>(fewest);                         ///< the first size_ are in use
  std::vector<std::uint32_t> slots_ = std::vector<std::uint32_t>(64, none);  ///< 2^(64 - shift_)
  std::size_t size_ = 0, most_ = fewest;
  unsigned shift_ = 58;
};

}  // namespace orbis::cloud::detail
