// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Hash tables from keys to 32-bit positions in an array.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace orbis {

/// The hash table underlying the indices below: open addressing with linear probing, at most half full. Erasing shifts
/// the following entries back, so a table with equal numbers of insertions and erasures does not grow. `is_empty()`
/// must be true for a default-constructed `Slot`. Every function takes the hash of the key; its highest bits select the
/// slot.
///
/// Source: D. E. Knuth, "The Art of Computer Programming", vol. 3, 6.4, algorithm R.
template <class Slot>
class probe_table {
 public:
  probe_table() = default;
  probe_table(const probe_table&) = default;
  probe_table(probe_table&& other) noexcept
      : slots_{std::exchange(other.slots_, {})}, used_{std::exchange(other.used_, 0)}, shift_{other.shift_} {}
  probe_table& operator=(probe_table other) noexcept {
    std::swap(slots_, other.slots_);
    std::swap(used_, other.used_);
    std::swap(shift_, other.shift_);
    return *this;
  }
  ~probe_table() = default;

  /// Returns the slot with this hash for which `matches(slot)` is true, or null. O(1) on average.
  template <class Matches>
  [[nodiscard]] const Slot* find(std::uint64_t hash, const Matches& matches) const {
    if (slots_.empty()) return nullptr;
    const Slot& s = slots_[place(hash, matches)];
    return s.is_empty() ? nullptr : &s;
  }
  /// Returns the slot with this hash for which `matches(slot)` is true, or an empty one, which the caller must fill.
  /// `hash_of(slot)` provides the hashes of other slots when the table grows. O(1) on average.
  template <class Matches, class HashOf>
  [[nodiscard]] Slot& find_or_insert(std::uint64_t hash, const Matches& matches, const HashOf& hash_of) {
    if (2 * (used_ + 1) > slots_.size()) resize(std::max<std::size_t>(16, 2 * slots_.size()), hash_of);
    Slot& s = slots_[place(hash, matches)];
    used_ += s.is_empty() ? 1 : 0;
    return s;
  }
  /// Empties the slot with this hash for which `matches(slot)` is true, if any. O(1) on average.
  template <class Matches, class HashOf>
  void erase(std::uint64_t hash, const Matches& matches, const HashOf& hash_of) {
    if (slots_.empty()) return;
    const std::size_t mask = slots_.size() - 1;
    std::size_t gap = place(hash, matches);
    if (slots_[gap].is_empty()) return;
    // An entry after the gap moves into it unless it would then precede the start of its own probe sequence.
    for (std::size_t i = (gap + 1) & mask; !slots_[i].is_empty(); i = (i + 1) & mask) {
      if (((i - home(hash_of(slots_[i]))) & mask) < ((i - gap) & mask)) continue;
      slots_[gap] = slots_[i];
      gap = i;
    }
    slots_[gap] = {};
    --used_;
  }
  /// Halves the table if less than an eighth of it is used.
  template <class HashOf>
  void shrink(const HashOf& hash_of) {
    if (slots_.size() > 64 && 8 * used_ < slots_.size()) resize(slots_.size() / 2, hash_of);
  }
  /// Empties all slots; keeps the memory.
  void clear() noexcept {
    if (used_ != 0) std::fill(slots_.begin(), slots_.end(), Slot{});
    used_ = 0;
  }
  [[nodiscard]] std::size_t size() const noexcept { return used_; }
  [[nodiscard]] bool empty() const noexcept { return used_ == 0; }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return slots_.capacity() * sizeof(Slot); }

 private:
  [[nodiscard]] std::size_t home(std::uint64_t hash) const noexcept { return static_cast<std::size_t>(hash >> shift_); }
  /// Index of the matching slot, or of the empty slot for its insertion.
  template <class Matches>
  [[nodiscard]] std::size_t place(std::uint64_t hash, const Matches& matches) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = home(hash);
    while (!slots_[i].is_empty() && !matches(slots_[i])) i = (i + 1) & mask;
    return i;
  }
  template <class HashOf>
  void resize(std::size_t size, const HashOf& hash_of) {
    const std::vector<Slot> old = std::exchange(slots_, std::vector<Slot>(size));
    for (shift_ = 64; size != 1; size /= 2) --shift_;
    for (const Slot& s : old)
      if (!s.is_empty()) slots_[place(hash_of(s), [](const Slot&) { return false; })] = s;
  }

  std::vector<Slot> slots_;  ///< 2^(64 - shift_) slots, or none
  std::size_t used_ = 0;
  unsigned shift_ = 64;
};

/// A map from 64-bit keys to 32-bit positions.
class hash_index {
 public:
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  /// The position stored for `name`, or `none`. @pre name != ~0, also for the functions below
  [[nodiscard]] std::uint32_t find(std::uint64_t name) const noexcept {
    const slot* const s = table_.find(hash(name), is_named{name});
    return s == nullptr ? none : s->position;
  }
  /// Stores `position` for `name`, replacing an existing entry.
  void set(std::uint64_t name, std::uint32_t position) {
    table_.find_or_insert(hash(name), is_named{name}, hash_of) = {name, position};
  }
  /// Removes `name` if present.
  void erase(std::uint64_t name) noexcept { table_.erase(hash(name), is_named{name}, hash_of); }
  /// Removes all entries; keeps the memory.
  void clear() noexcept { table_.clear(); }
  [[nodiscard]] std::size_t size() const noexcept { return table_.size(); }
  [[nodiscard]] bool empty() const noexcept { return table_.empty(); }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return table_.memory_bytes(); }

 private:
  struct slot {
    std::uint64_t name = ~std::uint64_t{0};
    std::uint32_t position = none;
    [[nodiscard]] bool is_empty() const noexcept { return name == ~std::uint64_t{0}; }
  };
  struct is_named {
    std::uint64_t name;
    [[nodiscard]] bool operator()(const slot& s) const noexcept { return s.name == name; }
  };
  /// Multiplicative hash: spreads consecutive keys.
  [[nodiscard]] static std::uint64_t hash(std::uint64_t name) noexcept { return name * 0x9e3779b97f4a7c15ULL; }
  static constexpr auto hash_of = [](const slot& s) { return hash(s.name); };

  probe_table<slot> table_;
};

/// A map from keys to their positions in the caller's array; 4 bytes per slot. `key_of(position)` returns the key at a
/// position, and `Hash{}(key)` returns 64 well-mixed bits.
template <class Key, class Hash>
class number_index {
 public:
  static constexpr std::uint32_t none = ~std::uint32_t{0};

  /// The position of `key`, or `none`.
  template <class KeyOf>
  [[nodiscard]] std::uint32_t find(const Key& key, const KeyOf& key_of) const {
    const slot* const s = table_.find(Hash{}(key), matches(key, key_of));
    return s == nullptr ? none : s->number;
  }
  /// Returns the position of `key`; stores `number` as its position if `key` is new. From then on, key_of(number) must
  /// return `key`.
  template <class KeyOf>
  std::uint32_t find_or_insert(const Key& key, std::uint32_t number, const KeyOf& key_of) {
    slot& s = table_.find_or_insert(Hash{}(key), matches(key, key_of), hash_of(key_of));
    if (s.is_empty()) s.number = number;
    return s.number;
  }
  /// Removes `key` if present; key_of(position of `key`) must still return it.
  template <class KeyOf>
  void erase(const Key& key, const KeyOf& key_of) {
    table_.erase(Hash{}(key), matches(key, key_of), hash_of(key_of));
    table_.shrink(hash_of(key_of));
  }
  [[nodiscard]] std::size_t size() const noexcept { return table_.size(); }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return table_.memory_bytes(); }

 private:
  struct slot {
    std::uint32_t number = none;
    [[nodiscard]] bool is_empty() const noexcept { return number == none; }
  };
  template <class KeyOf>
  [[nodiscard]] static auto matches(const Key& key, const KeyOf& key_of) {
    return [&](const slot& s) { return key_of(s.number) == key; };
  }
  template <class KeyOf>
  [[nodiscard]] static auto hash_of(const KeyOf& key_of) {
    return [&](const slot& s) { return Hash{}(key_of(s.number)); };
  }

  probe_table<slot> table_;
};

}  // namespace orbis
