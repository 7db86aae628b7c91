// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Objects by number: a number stays what it is, whatever comes and goes.
#pragma once

#include <cassert>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <iterator>
#include <utility>
#include <vector>

#include <orbis/slam/ids.hpp>

namespace orbis::slam::detail {

/// Objects with the numbers 0, 1, 2 ... in the order in which they came. A number is never used again; the memory of
/// what was erased is. An erased number remembers which other one took its place, if any did, and takes four bytes.
/// References stay valid while their object is there.
template <std::default_initializable T>
class slot_map {
 public:
  using id = std::uint32_t;
  static constexpr id most_ids = 0x7fffffffU;

  /// The number of the new object. @pre fewer than `most_ids` so far
  id add(T value) {
    assert(fate_.size() < most_ids);
    std::uint32_t place = static_cast<std::uint32_t>(items_.size());
    if (free_.empty()) {
      items_.push_back(std::move(value));
    } else {
      place = free_.back();
      free_.pop_back();
      items_[place] = std::move(value);
    }
    fate_.push_back(place);
    return end_id() - 1;
  }

  /// A number whose object is gone from the start, as when a store is read from a file.
  /// @pre `successor` is `no_id`, or will be the number of an object
  id add_erased(id successor) {
    assert(fate_.size() < most_ids);
    fate_.push_back(gone | successor);
    return end_id() - 1;
  }

  /// Frees the object; `successor` takes its place. @pre contains(i); successor is no_id or another that is there
  void erase(id i, id successor = no_id) {
    assert(contains(i) && (successor == no_id || (successor != i && contains(successor))));
    const std::uint32_t place = std::exchange(fate_[i], gone | successor);
    items_[place] = T{};
    free_.push_back(place);
  }

  [[nodiscard]] bool contains(id i) const noexcept { return i < fate_.size() && (fate_[i] & gone) == 0; }
  /// @pre contains(i)
  [[nodiscard]] const T& operator[](id i) const {
    assert(contains(i));
    return items_[fate_[i]];
  }
  [[nodiscard]] T& operator[](id i) {
    assert(contains(i));
    return items_[fate_[i]];
  }
  /// How many objects there are.
  [[nodiscard]] std::size_t size() const noexcept { return items_.size() - free_.size(); }
  /// The number that the next object will have.
  [[nodiscard]] id end_id() const noexcept { return static_cast<id>(fate_.size()); }

  /// `i` itself while it is there, else what took its place in the end; `no_id` if nothing did.
  [[nodiscard]] id became(id i) const noexcept {
    while (i < fate_.size() && (fate_[i] & gone) != 0) i = fate_[i] == no_id ? no_id : fate_[i] & ~gone;
    return i < fate_.size() ? i : no_id;
  }

  /// Takes over the objects and the past of `other`. Returns what its numbers have grown by; numbers that the
  /// objects hold are the caller's to change.
  id append(slot_map&& other) {
    assert(fate_.size() + other.fate_.size() <= most_ids);
    const id shift = end_id();
    for (const std::uint32_t fate : other.fate_) {
      if ((fate & gone) == 0) {
        add(std::move(other.items_[fate]));
      } else {
        fate_.push_back(fate == no_id ? no_id : fate + shift);
      }
    }
    other = slot_map{};
    return shift;
  }

  /// Goes through the objects by ascending number.
  class const_iterator {
   public:
    using value_type = T;
    using difference_type = std::ptrdiff_t;
    using reference = const T&;
    using pointer = const T*;
    using iterator_category = std::forward_iterator_tag;

    const_iterator() = default;
    const_iterator(const slot_map& all, id at) : all_{&all}, at_{at} { skip(); }
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
    void skip() {
      while (at_ < all_->end_id() && !all_->contains(at_)) ++at_;
    }
    const slot_map* all_ = nullptr;
    id at_ = 0;
  };

  [[nodiscard]] const_iterator begin() const { return {*this, 0}; }
  [[nodiscard]] const_iterator end() const { return {*this, end_id()}; }
  [[nodiscard]] bool empty() const noexcept { return size() == 0; }
  /// The object of the lowest number, and of the highest. @pre !empty()
  [[nodiscard]] const T& front() const { return *begin(); }
  [[nodiscard]] const T& back() const {
    id last = end_id() - 1;
    while (!contains(last)) --last;
    return (*this)[last];
  }

 private:
  static constexpr std::uint32_t gone = 0x80000000U;
  std::vector<std::uint32_t> fate_;  ///< by number: its place in `items_`; or `gone` with the number that follows
  std::deque<T> items_;
  std::vector<std::uint32_t> free_;  ///< places
};

}  // namespace orbis::slam::detail
