// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A table that maps ids to slots of objects, for use where most ids are eventually erased.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include <orbis/slam/ids.hpp>

namespace orbis::slam::detail {

/// Stores a number for each of the ids 0, 1, 2 ...: the slot of its object (less than `erased`); `erased` combined with
/// the id of its replacement if it was replaced; or `gone` if it was erased without a replacement.
///
/// The numbers are stored in pages of 256. A page whose ids are all erased is freed after `remembered` more ids have
/// been assigned; its ids are then `gone` and take 16 bytes per thousand. A page with at least one id that is not
/// erased takes 1 kB. A robot that runs indefinitely therefore needs memory for the existing objects, and almost none
/// for erased ones.
class paged_slots {
 public:
  static constexpr std::uint32_t erased = 0x80000000U;
  static constexpr std::uint32_t gone = no_id;
  static constexpr std::uint32_t page_size = 256;

  explicit paged_slots(std::uint32_t remembered) : remembered_{remembered} {}
  paged_slots(const paged_slots&) = default;
  /// Moves the ids out of `other`, which has none afterwards.
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

  /// Adds the next id. O(1) amortised.
  void push_back(std::uint32_t slot) {
    if (size_ % page_size == 0) begin_page();
    const std::uint32_t page = page_of(size_);
    slots_[std::size_t{page} * page_size + size_ % page_size] = slot;
    if ((slot & erased) == 0) ++contained_[page];
    ++size_;
    if (size_ % page_size == 0) end_page(size_ - 1);
  }
  /// Adds `count` ids that are `gone`. O(1) amortised, regardless of `count`.
  void push_gone(std::uint32_t count) {
    for (; count != 0 && size_ % page_size != 0; --count) push_back(gone);
    size_ += count / page_size * page_size;
    for (count %= page_size; count != 0; --count) push_back(gone);
  }
  /// @pre contains(i); `now` is `gone`, or `erased` combined with another id
  void erase(std::uint32_t i, std::uint32_t now) {
    assert(contains(i) && (now & erased) != 0);
    const std::uint32_t page = page_of(i);
    slots_[std::size_t{page} * page_size + i % page_size] = now;
    --contained_[page];
    if (i / page_size != size_ / page_size) end_page(i);
  }

  /// Returns the first id >= `i` that is not erased; `size()` if there is none. O(erased ids skipped); a page whose ids
  /// are all erased takes one step, as do 65536 ids that were `gone` from the start.
  [[nodiscard]] std::uint32_t next_contained(std::uint32_t i) const noexcept {
    return next(
        i, [this](std::uint32_t page) { return contained_[page] != 0; },
        [](std::uint32_t slot) { return (slot & erased) == 0; });
  }
  /// Returns the first id >= `i` that is not `gone`; `size()` if there is none. O(ids skipped); a freed page takes one
  /// step, as do 65536 ids that were `gone` from the start.
  [[nodiscard]] std::uint32_t next_known(std::uint32_t i) const noexcept {
    return next(
        i, [](std::uint32_t) { return true; }, [](std::uint32_t slot) { return slot != gone; });
  }
  /// Returns the last id that is not erased; `size()` if there is none. Same cost as `next_contained`.
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

  /// Begins or ends the import of ids from another source. During the import no page is freed; imported erased ids
  /// count as erased at the end of the import.
  void adopt(bool on) noexcept {
    if (!on)
      for (; adopted_from_ < retired_.size(); ++adopted_from_) retired_[adopted_from_].since = size_;
    adopts_ = on;
    adopted_from_ = retired_.size();
  }
  /// Returns the heap memory in bytes.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return (chunks_.capacity() + pages_.capacity() + slots_.capacity() + free_.capacity()) * sizeof(std::uint32_t) +
           contained_.capacity() * sizeof(std::uint16_t) + retired_.size() * sizeof(retired_page);
  }

 private:
  static constexpr std::uint32_t none = no_id;
  static constexpr std::uint32_t chunk_size = 256 * page_size;

  struct retired_page {
    std::uint32_t first;  ///< an id of the page
    std::uint32_t since;  ///< `size()` when the page was retired
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
  /// Returns the page of `slots_` that contains an id, or `none`.
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
  /// Must be called when an id of a fully assigned page is erased or the page becomes fully assigned: retires the page
  /// if all its ids are erased.
  void end_page(std::uint32_t i) {
    if (remembered_ != no_id && contained_[page_of(i)] == 0) retired_.push_back({i, size_});
  }

  std::uint32_t remembered_;
  std::uint32_t size_ = 0;
  bool adopts_ = false;
  std::size_t adopted_from_ = 0;          ///< index in `retired_` of the first page retired during the import
  std::vector<std::uint32_t> chunks_;     ///< for each id / 2^16: index of a group of 256 `pages_`, or `none`
  std::vector<std::uint32_t> pages_;      ///< for each group of 256 ids: index of the page of `slots_`, or `none`
  std::vector<std::uint32_t> slots_;      ///< the stored numbers, page after page
  std::vector<std::uint16_t> contained_;  ///< for each page of `slots_`: number of its ids that are not erased
  std::vector<std::uint32_t> free_;       ///< unused pages of `slots_`
  std::deque<retired_page> retired_;      ///< pages whose ids are all erased, the oldest first
};

}  // namespace orbis::slam::detail
