// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A container of objects with ids that remain valid while other objects are added and erased.
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <utility>
#include <vector>

#include <orbis/slam/detail/map/paged_slots.hpp>
#include <orbis/slam/ids.hpp>

namespace orbis::slam::detail {

/// Objects with the ids 0, 1, 2 ... in the order of insertion. Ids are not reused; the memory of erased objects is. The
/// replacement of an erased id, if any, is known at least until `remembered` more ids have been assigned (`no_id`:
/// indefinitely). References stay valid until their object is erased. All operations take O(1) unless stated otherwise.
template <std::default_initializable T, class Id, std::uint32_t remembered = no_id>
class slot_map {
 public:
  static constexpr std::uint32_t most_ids = 0x7fffffffU;

  /// Adds an object and returns its id. @pre fewer than `most_ids` ids have been assigned
  Id add(T value) {
    assert(slots_.size() < most_ids);
    std::uint32_t slot = static_cast<std::uint32_t>(items_.size());
    if (free_.empty()) {
      items_.push_back(std::move(value));
    } else {
      slot = free_.back();
      free_.pop_back();
      items_[slot] = std::move(value);
    }
    slots_.push_back(slot);
    return last_id();
  }

  /// Begins or ends the import of objects and ids from another source, such as a file. Ids that were erased in the
  /// source are treated as if they were erased when the import ends.
  void adopt(bool on) noexcept { slots_.adopt(on); }
  /// Adds an id whose object is already erased.
  /// @pre `replacement` is `no_id`, or the id of an object that will be added
  Id add_erased(Id replacement) {
    assert(slots_.size() < most_ids);
    slots_.push_back(paged_slots::erased | replacement.value());
    return last_id();
  }
  /// Adds `count` ids whose objects are already erased, without replacement. O(1) amortised.
  /// @pre at most `most_ids` ids in total
  void add_gone(std::uint32_t count) {
    assert(count <= most_ids - slots_.size());
    slots_.push_gone(count);
  }

  /// Erases an object; `replacement` replaces it. @pre contains(i); replacement is no_id or another contained id
  void erase(Id i, Id replacement = no_id) {
    assert(contains(i) && (replacement == no_id || (replacement != i && contains(replacement))));
    const std::uint32_t slot = slots_[i.value()];
    slots_.erase(i.value(), paged_slots::erased | replacement.value());
    items_[slot] = T{};
    free_.push_back(slot);
  }

  [[nodiscard]] bool contains(Id i) const noexcept { return slots_.contains(i.value()); }
  /// @pre contains(i)
  [[nodiscard]] const T& operator[](Id i) const {
    assert(contains(i));
    return items_[slots_[i.value()]];
  }
  [[nodiscard]] T& operator[](Id i) {
    assert(contains(i));
    return items_[slots_[i.value()]];
  }
  /// The number of objects.
  [[nodiscard]] std::size_t size() const noexcept { return items_.size() - free_.size(); }
  [[nodiscard]] bool empty() const noexcept { return size() == 0; }
  /// The id of the next object.
  [[nodiscard]] Id end_id() const noexcept { return slots_.size(); }
  /// Returns the first id >= `i` that has an object; `end_id()` if there is none. O(erased ids skipped); 256
  /// consecutive erased ids may take one step.
  [[nodiscard]] Id next_id(Id i) const noexcept { return slots_.next_contained(i.value()); }
  /// Returns the first id >= `i` that has an object or a replacement; `end_id()` if there is none. Same cost as
  /// `next_id`.
  [[nodiscard]] Id next_known_id(Id i) const noexcept { return slots_.next_known(i.value()); }

  /// Returns `i` if its object exists; otherwise its replacement, following the chain of replacements; `no_id` if there
  /// is none, or if it was forgotten. O(replacements).
  [[nodiscard]] Id replacement(Id i) const noexcept {
    std::uint32_t at = i.value();
    while (at < slots_.size()) {
      const std::uint32_t slot = slots_[at];
      if ((slot & paged_slots::erased) == 0) return at;
      if (slot == paged_slots::gone) break;
      at = slot & ~paged_slots::erased;
    }
    return no_id;
  }

  /// Appends all objects and erased ids of `other`; its erased ids count as erased at the time of the call. Returns the
  /// offset added to the ids of `other`. Ids inside the objects are not changed. O(ids of `other`); 256 consecutive
  /// forgotten ids may take one step.
  /// @pre at most `most_ids` ids in total
  std::uint32_t append(slot_map&& other) {
    assert(other.slots_.size() <= most_ids - slots_.size());
    const std::uint32_t offset = slots_.size();
    adopt(true);
    for (std::uint32_t i = 0; i != other.slots_.size();) {
      const std::uint32_t known = other.slots_.next_known(i);
      slots_.push_gone(known - i);
      if ((i = known) == other.slots_.size()) break;
      const std::uint32_t slot = other.slots_[i++];
      if ((slot & paged_slots::erased) == 0)
        add(std::move(other.items_[slot]));
      else
        slots_.push_back(slot + offset);
    }
    adopt(false);
    other = slot_map{};
    return offset;
  }

  /// Iterates over the objects in ascending order of id.
  class const_iterator {
   public:
    using value_type = T;
    using difference_type = std::ptrdiff_t;
    using reference = const T&;
    using pointer = const T*;
    using iterator_category = std::forward_iterator_tag;

    const_iterator() = default;
    const_iterator(const slot_map& all, Id at) : all_{&all}, at_{at} { skip(); }
    [[nodiscard]] reference operator*() const { return (*all_)[at_]; }
    [[nodiscard]] pointer operator->() const { return &(*all_)[at_]; }
    const_iterator& operator++() {
      ++at_;
      skip();
      return *this;
    }
    const_iterator operator++(int) {
      const const_iterator before = *this;
      ++*this;
      return before;
    }
    friend bool operator==(const const_iterator& a, const const_iterator& b) { return a.at_ == b.at_; }

   private:
    void skip() { at_ = all_->next_id(at_); }
    const slot_map* all_ = nullptr;
    Id at_ = 0;
  };

  [[nodiscard]] const_iterator begin() const { return {*this, 0}; }
  [[nodiscard]] const_iterator end() const { return {*this, end_id()}; }
  /// The object with the smallest id. Same cost as `next_id`. @pre !empty()
  [[nodiscard]] const T& front() const { return *begin(); }
  /// The object with the greatest id. Same cost as `next_id`. @pre !empty()
  [[nodiscard]] const T& back() const { return (*this)[slots_.last_contained()]; }

 private:
  [[nodiscard]] Id last_id() const noexcept { return slots_.size() - 1; }

  paged_slots slots_{remembered};  ///< for each id: index in `items_`
  std::deque<T> items_;
  std::vector<std::uint32_t> free_;  ///< slots without an object
};

}  // namespace orbis::slam::detail
