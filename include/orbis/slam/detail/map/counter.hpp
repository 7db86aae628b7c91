// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How often each number was given.
#pragma once

#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace orbis::slam::detail {

/// Counts numbers, in time and memory that depend on how many different ones are given, not on how large they are.
class counter {
 public:
  struct entry {
    std::uint32_t number = 0;
    std::uint32_t count = 0;
    friend bool operator==(const entry&, const entry&) = default;
  };

  /// Notes a number; true the first time.
  bool add(std::uint32_t number) {
    if (2 * (entries_.size() + 1) > places_.size()) grow();
    std::size_t place = place_of(number);
    for (; places_[place] != 0; place = (place + 1) & (places_.size() - 1)) {
      entry& e = entries_[places_[place] - 1];
      if (e.number != number) continue;
      ++e.count;
      return false;
    }
    entries_.push_back({number, 1});
    places_[place] = static_cast<std::uint32_t>(entries_.size());
    return true;
  }

  /// In the order in which they were first given.
  [[nodiscard]] const std::vector<entry>& entries() const noexcept { return entries_; }
  [[nodiscard]] std::vector<entry> take() && { return std::move(entries_); }

 private:
  [[nodiscard]] std::size_t place_of(std::uint32_t number) const noexcept {
    return static_cast<std::size_t>((number * std::uint64_t{0x9e3779b97f4a7c15}) >> 32U) & (places_.size() - 1);
  }
  void grow() {
    places_.assign(places_.empty() ? 64 : 2 * places_.size(), 0);
    for (std::uint32_t i = 0; i != entries_.size(); ++i) {
      std::size_t place = place_of(entries_[i].number);
      while (places_[place] != 0) place = (place + 1) & (places_.size() - 1);
      places_[place] = i + 1;
    }
  }

  std::vector<entry> entries_;
  std::vector<std::uint32_t> places_;  ///< a power of two of them, at most half of them taken: entry + 1, or 0
};

}  // namespace orbis::slam::detail
