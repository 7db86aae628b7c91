// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Values of a few of many points.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/execution.hpp>

namespace orbis::cloud::detail {

/// Values of some of the points 0 ... n - 1. A quarter of a byte for each point and four bytes for each value, and
/// twice that while values are added.
class sparse_values {
 public:
  /// Adds `value(i)` for each i < count that has none and for which `wanted(i)` is true. Both are called from several
  /// threads. O(count), the same for every policy. @pre count is the same in all calls
  template <execution_policy Policy, class Wanted, class Value>
  void add(const Policy& policy, std::size_t count, const Wanted& wanted, const Value& value) {
    const sparse_values before = *this;
    words_.resize((count + 63) / 64);
    for_each_index(policy, words_.size(), 64, [&](std::size_t w) {
      for (std::size_t i = 64 * w; i != count && i != 64 * (w + 1); ++i) {
        const std::uint64_t bit = std::uint64_t{1} << (i % 64);
        if ((words_[w].mask & bit) == 0 && wanted(i)) words_[w].mask |= bit;
      }
    });
    std::uint32_t sum = 0;
    for (word& w : words_) {
      w.before = sum;
      sum += static_cast<std::uint32_t>(std::popcount(w.mask));
    }
    values_.resize(sum);
    for_each_index(policy, words_.size(), 8, [&](std::size_t w) {
      std::size_t at = words_[w].before;
      for (std::uint64_t left = words_[w].mask; left != 0; left &= left - 1, ++at) {
        const std::size_t i = 64 * w + static_cast<std::size_t>(std::countr_zero(left));
        values_[at] = before.has(i) ? before.at(i) : value(i);
      }
    });
  }
  [[nodiscard]] bool has(std::size_t i) const noexcept {
    return i / 64 < words_.size() && (words_[i / 64].mask >> (i % 64) & 1U) != 0;
  }
  /// NaN for points without a value.
  [[nodiscard]] float at(std::size_t i) const noexcept {
    if (!has(i)) return std::numeric_limits<float>::quiet_NaN();
    const word& w = words_[i / 64];
    const std::uint64_t below = w.mask & ((std::uint64_t{1} << (i % 64)) - 1);
    return values_[w.before + static_cast<std::size_t>(std::popcount(below))];
  }

 private:
  struct word {
    std::uint64_t mask = 0;
    std::uint32_t before = 0;  ///< values of the words before
  };
  std::vector<word> words_;
  std::vector<float> values_;
};

}  // namespace orbis::cloud::detail
