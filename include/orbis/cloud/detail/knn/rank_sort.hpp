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
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/simd.hpp>

namespace orbis::cloud::detail {

/// For each of `count` values, the number of smaller ones. @pre 32 more values can be read and written
struct count_smaller {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const std::int32_t* values, std::size_t count, std::int32_t* smaller) {
    using lanes = simd::native_vec<std::int32_t, Target>;
    constexpr std::size_t n = lanes::count;
    // In variables of their own, not in arrays: those would be kept in memory.
    const lanes one = -1, none = 0;
    if (count <= n) {
      const lanes v0 = lanes::load(values);
      lanes n0 = 0;
      for (std::size_t j = 0; j != count; ++j) n0 -= select(lanes(values[j]) < v0, one, none);
      n0.store(smaller);
      return;
    }
    for (std::size_t i = 0; i < count; i += 2 * n) {
      const lanes v0 = lanes::load(values + i), v1 = lanes::load(values + i + n);
      lanes n0 = 0, n1 = 0;
      for (std::size_t j = 0; j != count; ++j) {
        const lanes other = values[j];
        n0 -= select(other < v0, one, none);
        n1 -= select(other < v1, one, none);
      }
      n0.store(smaller + i);
      n1.store(smaller + i + n);
    }
  }
};

/// Points by their squared distance, those at the same one by index. Keeps its memory.
class rank_sorter {
 public:
  void clear() noexcept { count_ = 0; }
  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  /// @pre distance_squared >= 0: the order of bits is that of values
  void add(std::uint32_t index, float distance_squared) {
    if (count_ + 2 * room > keys_.size()) grow();
    std::memcpy(&keys_[count_], &distance_squared, sizeof distance_squared);
    indices_[count_++] = index;
  }
  /// Takes the points at some places of `members` instead of all that were added. @pre as for `add`
  void assign(std::span<const float> squared, const std::uint32_t* places, const std::uint32_t* members) {
    while (squared.size() + 2 * room > keys_.size()) grow();
    count_ = squared.size();
    std::memcpy(keys_.data(), squared.data(), squared.size_bytes());
    for (std::size_t i = 0; i != count_; ++i) indices_[i] = members[places[i]];
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

  void (*count_smaller_)(const std::int32_t*, std::size_t, std::int32_t*) =
      simd::kernel<count_smaller, void(const std::int32_t*, std::size_t, std::int32_t*), simd::avx2>();
  std::size_t count_ = 0;
  std::vector<std::int32_t> keys_;
  std::vector<std::uint32_t> indices_;
  std::vector<std::int32_t> ranks_;
  std::vector<std::uint16_t> taken_;
  std::vector<std::uint64_t> sorted_;
};

}  // namespace orbis::cloud::detail

ORBIS_COMPILED_KERNEL_AVX2(orbis::cloud::detail::count_smaller, void(const std::int32_t*, std::size_t, std::int32_t*));
