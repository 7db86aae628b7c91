// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Where the object of each id is, for ids of which most are erased in the end.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include <orbis/slam/ids.hpp>

namespace orbis::slam::detail {

/// A number for each of the ids 0, 1, 2 ...: the slot of its object, below `erased`; or, once it is erased, `erased`
/// with the id that replaced it; or `gone`: erased, and nothing replaced it.
///
/// Numbers are in pages of 256. A page whose ids are all erased is given back when `remembered` more ids were given
/// since, and its ids are `gone` then: they take 16 bytes for a thousand. A page with one id that is not erased takes 1
/// kB. So a robot that never stops needs memory for the objects that are there, and next to none for those that were.
class paged_slots {
 public:
  static constexpr std::uint32_t erased = 0x80000000U;
  static constexpr std::uint32_t gone = no_id;
  static constexpr std::uint32_t page_size = 256;

  explicit paged_slots(std::uint32_t remembered) : remembered_{remembered} {}
  paged_slots(const paged_slots&) = default;
  /// `other` has no ids afterwards.
  paged_slots(paged_slots&& other) : paged_slots{other.remembered_} { swap(other); }
  paged_slots& operator=(paged_slots other) noexcept {
    swap(other);
    return *this;
  }
  ~paged_slots() = default;

  /// The number of ids.
  [[nodiscard]] std::uint32_t size() const noexcept { return size_; }
  /// @pre i < size()
  [[nodiscard]] std::uint32_t operator[](std::uint32_t i) const noexcept {
    assert(i < size_);
    const std::uint32_t page = page_of(i);
    return page == none ? gone : slots_[std::size_t{page} * page_size + i % page_size];
  }
  [[nodiscard]] bool contains(std::uint32_t i) const noexcept { return i < size_ && ((*this)[i] & erased) == 0; }

  /// Gives the next id. O(1) amortised.
  void push_back(std::uint32_t slot) {
    if (size_ % page_size == 0) begin_page();
    const std::uint32_t page = page_of(size_);
    slots_[std::size_t{page} * page_size + size_ % page_size] = slot;
    if ((slot & erased) == 0) ++contained_[page];
    ++size_;
    if (size_ % page_size == 0) end_page(size_ - 1);
  }
  /// Gives `count` ids that are `gone`. O(1) amortised, however many.
  void push_gone(std::uint32_t count) {
    for (; count != 0 && size_ % page_size != 0; --count) push_back(gone);
    size_ += count / page_size * page_size;
    for (count %= page_size; count != 0; --count) push_back(gone);
  }
  /// @pre contains(i); `now` is `gone`, or `erased` with another id
  void erase(std::uint32_t i, std::uint32_t now) {
    assert(contains(i) && (now & erased) != 0);
    const std::uint32_t page = page_of(i);
    slots_[std::size_t{page} * page_size + i % page_size] = now;
    --contained_[page];
    if (i / page_size != size_ / page_size) end_page(i);
  }

  /// The first id from `i` on that is not erased; `size()` if there is none. O(erased ids in between), but a page whose
  /// ids are all erased takes one step, as do 65536 ids that were `gone` from the start.
  [[nodiscard]] std::uint32_t next_contained(std::uint32_t i) const noexcept {
    return next(
        i, [this](std::uint32_t page) { return contained_[page] != 0; },
        [](std::uint32_t slot) { return (slot & erased) == 0; });
  }
  /// The first id from `i` on that is not `gone`; `size()` if there is none. O(ids in between), but a page that was
  /// given back takes one step, as do 65536 ids that were `gone` from the start.
  [[nodiscard]] std::uint32_t next_known(std::uint32_t i) const noexcept {
    return next(
        i, [](std::uint32_t) { return true; }, [](std::uint32_t slot) { return slot != gone; });
  }
  /// The last id that is not erased; `size()` if there is none. Cost as `next_contained`.
  [[nodiscard]] std::uint32_t last_contained() const noexcept {
    for (std::uint32_t i = size_; i != 0;) {
      const std::uint32_t at = i - 1;
      if (const std::uint32_t page = page_of(at); page == none || contained_[page] == 0)
        i = at - at % (has_chunk(at) ? page_size : chunk_size);
      else if (contains(at))
        return at;
      else
        --i;
    }
    return size_;
  }

  /// From now on, or no more, ids of another source are added that were erased at times of their own: until the end of
  /// that nothing is given back, and they count as erased then.
  void adopt(bool on) noexcept {
    if (!on)
      for (; adopted_from_ < retired_.size(); ++adopted_from_) retired_[adopted_from_].since = size_;
    adopts_ = on;
    adopted_from_ = retired_.size();
  }
  /// Bytes on the heap.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return (chunks_.capacity() + pages_.capacity() + slots_.capacity() + free_.capacity()) * sizeof(std::uint32_t) +
           contained_.capacity() * sizeof(std::uint16_t) + retired_.size() * sizeof(retired_page);
  }

 private:
  static constexpr std::uint32_t none = no_id;
  static constexpr std::uint32_t chunk_size = 256 * page_size;

  struct retired_page {
    std::uint32_t first;  ///< id
    std::uint32_t since;  ///< size() when its last id was erased
  };

  template <class MayHold, class Wanted>
  [[nodiscard]] std::uint32_t next(std::uint32_t i, MayHold may_hold, Wanted wanted) const noexcept {
    while (i < size_) {
      if (const std::uint32_t page = page_of(i); page == none || !may_hold(page))
        i += has_chunk(i) ? page_size - i % page_size : chunk_size - i % chunk_size;
      else if (wanted((*this)[i]))
        return i;
      else
        ++i;
    }
    return size_;
  }

  void swap(paged_slots& other) noexcept {
    std::swap(remembered_, other.remembered_);
    std::swap(size_, other.size_);
    std::swap(adopts_, other.adopts_);
    std::swap(adopted_from_, other.adopted_from_);
    chunks_.swap(other.chunks_);
    pages_.swap(other.pages_);
    slots_.swap(other.slots_);
    contained_.swap(other.contained_);
    free_.swap(other.free_);
    retired_.swap(other.retired_);
  }
  [[nodiscard]] bool has_chunk(std::uint32_t i) const noexcept {
    return i / chunk_size < chunks_.size() && chunks_[i / chunk_size] != none;
  }
  /// The page of `slots_` that holds an id, or `none`.
  [[nodiscard]] std::uint32_t page_of(std::uint32_t i) const noexcept {
    return has_chunk(i) ? pages_[place_of_page(i)] : none;
  }
  /// @pre has_chunk(i)
  [[nodiscard]] std::size_t place_of_page(std::uint32_t i) const noexcept {
    return std::size_t{chunks_[i / chunk_size]} * (chunk_size / page_size) + i % chunk_size / page_size;
  }

  void begin_page() {
    while (!adopts_ && !retired_.empty() && size_ - retired_.front().since >= remembered_) {
      std::uint32_t& page = pages_[place_of_page(retired_.front().first)];
      free_.push_back(page);
      page = none;
      retired_.pop_front();
    }
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(contained_.size()));
      contained_.push_back(0);
      slots_.resize(slots_.size() + page_size);
    }
    if (!has_chunk(size_)) {
      chunks_.resize(size_ / chunk_size + 1, none);
      chunks_.back() = static_cast<std::uint32_t>(pages_.size() / (chunk_size / page_size));
      pages_.resize(pages_.size() + chunk_size / page_size, none);
    }
    pages_[place_of_page(size_)] = free_.back();
    free_.pop_back();
  }
  /// The page that holds the id is whole: it is no longer needed if all its ids are erased.
  void end_page(std::uint32_t i) {
    if (remembered_ != no_id && contained_[page_of(i)] == 0) retired_.push_back({i, size_});
  }

  std::uint32_t remembered_;
  std::uint32_t size_ = 0;
  bool adopts_ = false;
  std::size_t adopted_from_ = 0;          ///< of `retired_`: where those begin that were erased elsewhere
  std::vector<std::uint32_t> chunks_;     ///< by id / 2^16: which 256 of `pages_`; or `none`
  std::vector<std::uint32_t> pages_;      ///< which page of `slots_`, or `none`, for 256 ids
  std::vector<std::uint32_t> slots_;      ///< page after page
  std::vector<std::uint16_t> contained_;  ///< by page of `slots_`: how many of its ids are not erased
  std::vector<std::uint32_t> free_;       ///< pages of `slots_` that are not in use
  std::deque<retired_page> retired_;      ///< whose ids are all erased, the oldest first
};

}  // namespace orbis::slam::detail
