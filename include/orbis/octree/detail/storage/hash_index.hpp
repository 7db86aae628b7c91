// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A hash from 64-bit names to 32-bit positions, from which names can be erased.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace orbis::octree::detail {

/// Open addressing with linear probing; erasing moves back what follows, so that a window that rolls
/// on for ever needs no more memory than it holds at a time.
///
/// D. E. Knuth, "The Art of Computer Programming", vol. 3, 6.4, algorithm R; multiplicative hashing.
class hash_index {
 public:
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  hash_index() = default;
  hash_index(const hash_index&) = default;
  hash_index(hash_index&& other) noexcept
      : slots_{std::exchange(other.slots_, {})}, used_{std::exchange(other.used_, 0)}, shift_{other.shift_} {}
  hash_index& operator=(hash_index other) noexcept {
    std::swap(slots_, other.slots_);
    std::swap(used_, other.used_);
    std::swap(shift_, other.shift_);
    return *this;
  }
  ~hash_index() = default;

  /// The position stored for `name`, or `none`. @pre name != ~0, as for those below
  [[nodiscard]] std::uint32_t find(std::uint64_t name) const noexcept {
    return slots_.empty() ? none : slots_[place(name)].position;
  }
  /// Stores `position` for `name`, new or not.
  void set(std::uint64_t name, std::uint32_t position) {
    if (2 * (used_ + 1) > slots_.size()) grow();  // absent names are asked for as often as present ones
    slot& s = slots_[place(name)];
    used_ += s.name == no_name ? 1 : 0;
    s = {name, position};
  }
  /// Forgets `name`, if it is there.
  void erase(std::uint64_t name) noexcept {
    if (slots_.empty()) return;
    const std::size_t mask = slots_.size() - 1;
    std::size_t gap = place(name);
    if (slots_[gap].name == no_name) return;
    // What stands behind the gap moves into it unless it would come before where its search begins.
    for (std::size_t i = (gap + 1) & mask; slots_[i].name != no_name; i = (i + 1) & mask) {
      if (((i - home(slots_[i].name)) & mask) < ((i - gap) & mask)) continue;
      slots_[gap] = slots_[i];
      gap = i;
    }
    slots_[gap] = {};
    --used_;
  }
  /// Forgets everything, keeps the memory.
  void clear() noexcept {
    if (used_ != 0) std::fill(slots_.begin(), slots_.end(), slot{});
    used_ = 0;
  }
  [[nodiscard]] std::size_t size() const noexcept { return used_; }
  [[nodiscard]] bool empty() const noexcept { return used_ == 0; }
  /// Bytes on the heap.
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return slots_.capacity() * sizeof(slot); }

 private:
  static constexpr std::uint64_t no_name = ~std::uint64_t{0};
  struct slot {
    std::uint64_t name = no_name;
    std::uint32_t position = none;
  };

  [[nodiscard]] std::size_t home(std::uint64_t name) const noexcept {
    return static_cast<std::size_t>((name * 0x9e3779b97f4a7c15ULL) >> shift_);
  }
  [[nodiscard]] std::size_t place(std::uint64_t name) const noexcept {
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = home(name);
    while (slots_[i].name != name && slots_[i].name != no_name) i = (i + 1) & mask;
    return i;
  }
  void grow() {
    std::vector<slot> old(std::max<std::size_t>(16, 2 * slots_.size()));
    shift_ = old.size() == 16 ? 60 : shift_ - 1;
    old.swap(slots_);
    for (const slot& s : old)
      if (s.name != no_name) slots_[place(s.name)] = s;
  }

  std::vector<slot> slots_;  ///< 2^(64 - shift_) of them, or none
  std::size_t used_ = 0;
  unsigned shift_ = 60;
};

}  // namespace orbis::octree::detail
