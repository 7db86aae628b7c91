// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Counts the occurrences of ids.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace orbis::slam::detail {

/// Counts ids in an open-addressing table. Time and memory depend on the number of different ids, not on their values.
template <class Id>
class counter {
 public:
  struct entry {
    Id id = 0;
    std::uint32_t count = 0;
    friend bool operator==(const entry&, const entry&) = default;
  };

  /// Counts an id; returns true if it is new. O(1) amortised.
  bool add(Id id) {
    if (2 * (entries_.size() + 1) > table_.size()) grow();
    std::size_t at = index_of(id);
    for (; table_[at] != 0; at = (at + 1) & (table_.size() - 1)) {
      entry& e = entries_[table_[at] - 1];
      if (e.id != id) continue;
      ++e.count;
      return false;
    }
    entries_.push_back({id, 1});
    table_[at] = static_cast<std::uint32_t>(entries_.size());
    return true;
  }

  /// The entries in the order in which the ids first occurred.
  [[nodiscard]] const std::vector<entry>& entries() const noexcept { return entries_; }
  [[nodiscard]] std::vector<entry> take() && { return std::move(entries_); }

 private:
  [[nodiscard]] std::size_t index_of(Id id) const noexcept {
    return static_cast<std::size_t>((id.value() * std::uint64_t{0x9e3779b97f4a7c15}) >> 32U) & (table_.size() - 1);
  }
  void grow() {
    table_.assign(table_.empty() ? 64 : 2 * table_.size(), 0);
    for (std::uint32_t i = 0; i != entries_.size(); ++i) {
      std::size_t at = index_of(entries_[i].id);
      while (table_[at] != 0) at = (at + 1) & (table_.size() - 1);
      table_[at] = i + 1;
    }
  }

  std::vector<entry> entries_;
  /// In each slot, the index of an entry plus one, or 0. The size is a power of two; at least half of the slots are 0.
  std::vector<std::uint32_t> table_;
};

}  // namespace orbis::slam::detail
