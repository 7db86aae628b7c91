// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A hash from 64-bit names to 32-bit positions.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace orbis::octree {

/// Open addressing with linear probing and multiplicative hashing. Names are never removed one by
/// one; a name whose position is `none` counts as absent.
class hash_index {
 public:
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  /// The position stored for `name`, or `none`. @pre name != ~0
  [[nodiscard]] std::uint32_t find(std::uint64_t name) const noexcept {
    if (slots_.empty()) return none;
    return slots_[place(name)].position;
  }
  /// Stores `position` for `name`, new or not.
  void set(std::uint64_t name, std::uint32_t position) {
    if (2 * (used_ + 1) > slots_.size()) grow();  // absent names are asked for as often as present ones
    slot& s = slots_[place(name)];
    used_ += s.name == no_name ? 1 : 0;
    s = {name, position};
  }
  /// Forgets everything, keeps the memory.
  void clear() noexcept {
    if (used_ != 0) std::fill(slots_.begin(), slots_.end(), slot{});
    used_ = 0;
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return slots_.capacity() * sizeof(slot); }

 private:
  static constexpr std::uint64_t no_name = ~std::uint64_t{0};
  struct slot {
    std::uint64_t name = no_name;
    std::uint32_t position = none;
  };

  [[nodiscard]] std::size_t place(std::uint64_t name) const noexcept {
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = static_cast<std::size_t>((name * 0x9e3779b97f4a7c15ULL) >> 32U) & mask;
    while (slots_[i].name != name && slots_[i].name != no_name) i = (i + 1) & mask;
    return i;
  }
  void grow() {
    std::vector<slot> old(std::max<std::size_t>(16, 2 * slots_.size()));
    old.swap(slots_);
    for (const slot& s : old)
      if (s.name != no_name) slots_[place(s.name)] = s;
  }

  std::vector<slot> slots_;
  std::size_t used_ = 0;
};

}  // namespace orbis::octree
