// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Sorting a few dozen values by counting, for each of them, how many are smaller: n^2 comparisons, but
/// without a branch and many at a time.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

#if defined(__GNUC__)
using int_lanes4 [[gnu::vector_size(16)]] = std::int32_t;
using int_lanes8 [[gnu::vector_size(32)]] = std::int32_t;

/// For each of `count` values, the number of smaller ones. @pre 32 more values can be read and written
template <class Lanes>
[[gnu::always_inline]] inline void count_smaller(const std::int32_t* values, std::size_t count,
                                                 std::int32_t* smaller) noexcept {
  constexpr std::size_t lanes = sizeof(Lanes) / sizeof(std::int32_t);
  // In variables of their own, not in arrays: those would be kept in memory.
  for (std::size_t i = 0; i < count; i += 4 * lanes) {
    Lanes v0;
    Lanes v1;
    Lanes v2;
    Lanes v3;
    std::memcpy(&v0, values + i, sizeof v0);
    std::memcpy(&v1, values + i + lanes, sizeof v1);
    std::memcpy(&v2, values + i + 2 * lanes, sizeof v2);
    std::memcpy(&v3, values + i + 3 * lanes, sizeof v3);
    Lanes n0{};
    Lanes n1{};
    Lanes n2{};
    Lanes n3{};
    for (std::size_t j = 0; j != count; ++j) {
      const Lanes other = Lanes{} + values[j];
      n0 -= other < v0;
      n1 -= other < v1;
      n2 -= other < v2;
      n3 -= other < v3;
    }
    std::memcpy(smaller + i, &n0, sizeof n0);
    std::memcpy(smaller + i + lanes, &n1, sizeof n1);
    std::memcpy(smaller + i + 2 * lanes, &n2, sizeof n2);
    std::memcpy(smaller + i + 3 * lanes, &n3, sizeof n3);
  }
}
inline void count_smaller_portable(const std::int32_t* values, std::size_t count, std::int32_t* smaller) {
  count_smaller<int_lanes4>(values, count, smaller);
}
ORBIS_TARGET("avx2")
inline void count_smaller_avx2(const std::int32_t* values, std::size_t count, std::int32_t* smaller) {
  count_smaller<int_lanes8>(values, count, smaller);
}
#else
inline void count_smaller_portable(const std::int32_t* values, std::size_t count, std::int32_t* smaller) {
  for (std::size_t i = 0; i != count; ++i) {
    smaller[i] = 0;
    for (std::size_t j = 0; j != count; ++j) smaller[i] += values[j] < values[i] ? 1 : 0;
  }
}
constexpr decltype(count_smaller_portable)* count_smaller_avx2 = nullptr;
#endif

/// Points by their squared distance, those at the same one by index. Keeps its memory.
class rank_sorter {
 public:
  explicit rank_sorter(simd::level level)
      : count_smaller_{simd::select<void(const std::int32_t*, std::size_t, std::int32_t*)>(
            level, {.portable = count_smaller_portable, .avx2 = count_smaller_avx2})} {}

  void clear() noexcept { count_ = 0; }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// @pre distance_squared >= 0: the order of bits is that of values
  void add(std::uint32_t index, float distance_squared) {
    if (count_ + 2 * room > keys_.size()) grow();
    std::memcpy(&keys_[count_], &distance_squared, sizeof distance_squared);
    indices_[count_++] = index;
  }
  /// Calls `f(rank, index, distance_squared)` for all, nearest first, until it returns false.
  template <class F>
  void for_each(F&& f) {
    if (count_ == 0) return;
    if (count_ <= most_ranked) {
      std::fill_n(keys_.begin() + static_cast<std::ptrdiff_t>(count_), room, std::numeric_limits<std::int32_t>::max());
      std::fill_n(taken_.begin(), count_, std::uint16_t{0});
      count_smaller_(keys_.data(), count_, ranks_.data());
      for (std::size_t i = 0; i != count_; ++i) {
        const auto rank = static_cast<std::size_t>(ranks_[i]);
        sorted_[rank + taken_[rank]++] = pack(i);  // equal ones side by side
      }
      for (std::size_t i = 1; i < count_; ++i) {
        for (std::size_t j = i; j != 0 && sorted_[j] < sorted_[j - 1]; --j) std::swap(sorted_[j], sorted_[j - 1]);
      }
    } else {
      for (std::size_t i = 0; i != count_; ++i) sorted_[i] = pack(i);
      std::sort(sorted_.begin(), sorted_.begin() + static_cast<std::ptrdiff_t>(count_));
    }
    for (std::size_t i = 0; i != count_; ++i) {
      const auto bits = static_cast<std::uint32_t>(sorted_[i] >> 32U);
      float distance_squared;
      std::memcpy(&distance_squared, &bits, sizeof bits);
      if (!f(i, static_cast<std::uint32_t>(sorted_[i]), distance_squared)) return;
    }
  }

 private:
  static constexpr std::size_t room = 32;          // read and written beyond the last
  static constexpr std::size_t most_ranked = 384;  // beyond this n log n wins

  [[nodiscard]] std::uint64_t pack(std::size_t i) const noexcept {
    return std::uint64_t{static_cast<std::uint32_t>(keys_[i])} << 32U | indices_[i];
  }
  void grow() {
    const std::size_t size = std::max<std::size_t>(128, 2 * keys_.size());
    keys_.resize(size);
    indices_.resize(size);
    ranks_.resize(size);
    taken_.resize(size);
    sorted_.resize(size);
  }

  void (*count_smaller_)(const std::int32_t*, std::size_t, std::int32_t*);
  std::size_t count_ = 0;
  std::vector<std::int32_t> keys_;
  std::vector<std::uint32_t> indices_;
  std::vector<std::int32_t> ranks_;
  std::vector<std::uint16_t> taken_;
  std::vector<std::uint64_t> sorted_;
};

}  // namespace orbis::cloud::detail
