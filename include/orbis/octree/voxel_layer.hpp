// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// A sparse payload layer for a map, such as colours, labels or counts: at most one value per voxel, addressed by the
/// map's voxel keys.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <utility>
#include <vector>

#include <orbis/core/cow_pages.hpp>
#include <orbis/core/hash_index.hpp>
#include <orbis/core/image.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree {

/// A payload type: trivially copyable, so that copies of a layer can share it. The default value means "no data".
template <class T>
concept voxel_payload = std::copyable<T> && std::default_initializable<T> && std::is_trivially_copyable_v<T>;

/// Running mean of observed colours; 8 bytes. Exact for the first 257 observations; afterwards, earlier observations
/// have a total weight of at least 128, so that the mean covers roughly the last two hundred.
class rgb_mean {
 public:
  void update(const rgb8& color) noexcept {
    if (count_ == full) halve();
    sum_[0] = static_cast<std::uint16_t>(sum_[0] + color.r);
    sum_[1] = static_cast<std::uint16_t>(sum_[1] + color.g);
    sum_[2] = static_cast<std::uint16_t>(sum_[2] + color.b);
    ++count_;
  }
  /// Number of observations in the mean, at most 257.
  [[nodiscard]] std::uint32_t count() const noexcept { return count_; }
  /// Returns the mean, rounded; black if there are no observations.
  [[nodiscard]] rgb8 color() const noexcept {
    const std::uint32_t n = count_ == 0 ? 1U : count_;
    const auto mean = [&](std::uint32_t sum) { return static_cast<std::uint8_t>((sum + n / 2) / n); };
    return {mean(sum_[0]), mean(sum_[1]), mean(sum_[2])};
  }
  friend bool operator==(const rgb_mean&, const rgb_mean&) = default;

 private:
  static constexpr std::uint32_t full = std::numeric_limits<std::uint16_t>::max() / 255;
  void halve() noexcept {
    for (std::uint16_t& s : sum_) s = static_cast<std::uint16_t>((s * (full / 2) + full / 2) / full);
    count_ = full / 2;
  }

  std::array<std::uint16_t, 3> sum_{};
  std::uint16_t count_ = 0;
};

/// Payload values of voxels, stored in octants of 4x4x4 voxels. Uses the memory of 64 values for each octant with at
/// least one value. A copy shares all data with the original until one of them changes. A reference to a value is valid
/// until the value is erased or the layer is copied or destroyed.
///
/// @code
///   orbis::octree::voxel_layer<orbis::octree::rgb_mean> colors;
///   if (const auto key = map.grid().key(p)) colors.make(*key).update({200, 120, 40});
/// @endcode
///
/// Const members can be called from several threads concurrently. All functions require key coordinates < 2^21.
template <voxel_payload T>
class voxel_layer {
 public:
  using value_type = T;

  /// Returns the value of voxel `k`, or null if it has none. O(1), like the functions below unless stated otherwise.
  [[nodiscard]] const T* find(const voxel_key& k) const noexcept {
    const std::uint64_t code = morton_code(k);
    const std::uint32_t i = index_.find(code >> 6U);
    if (i == hash_index::none) return nullptr;
    const octant& o = octants_[i];
    return (o.known >> (code & 63U) & 1U) != 0 ? &o.value[code & 63U] : nullptr;
  }
  /// Returns the value of voxel `k`; inserts a value-initialised one if the voxel has none.
  [[nodiscard]] T& make(const voxel_key& k) {
    const std::uint64_t code = morton_code(k);
    const std::uint32_t i = index_.find(code >> 6U);
    octant& o = octants_.writable(i != hash_index::none ? i : add(code >> 6U));
    o.known |= std::uint64_t{1} << (code & 63U);
    return o.value[code & 63U];
  }

  /// Erases the value of voxel `k`. Returns true if it had one.
  bool erase(const voxel_key& k) {
    const std::uint64_t code = morton_code(k);
    return erase_in(code >> 6U, std::uint64_t{1} << (code & 63U)) != 0;
  }
  /// Erase the values of the octant, or of the brick of 8x8x8 voxels, that contains `k`. Return the number of erased
  /// values.
  std::size_t erase_octant(const voxel_key& k) { return erase_in(morton_code(k) >> 6U, ~std::uint64_t{0}); }
  std::size_t erase_brick(const voxel_key& k) {
    const std::uint64_t brick = morton_code(k) >> 9U;
    std::size_t erased = 0;
    for (std::uint64_t i = 0; i != 8; ++i) erased += erase_in(brick << 3U | i, ~std::uint64_t{0});
    return erased;
  }

  /// Calls `visit(key, value)` for every voxel with a value, in Morton order, independent of the history of the layer.
  /// O(octants log octants + values).
  template <std::invocable<const voxel_key&, const T&> Visit>
  void for_each(Visit&& visit) const {
    std::vector<std::pair<std::uint64_t, const octant*>> order;
    order.reserve(index_.size());
    for (std::size_t i = 0; i != octants_.size(); ++i)
      if (octants_[i].known != 0) order.emplace_back(octants_[i].code, &octants_[i]);
    std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    for (const auto& [code, o] : order) {
      const voxel_key low = morton_key(code << 6U);
      for (std::uint64_t bits = o->known; bits != 0; bits &= bits - 1) {
        const auto i = static_cast<std::uint32_t>(std::countr_zero(bits));
        visit(voxel_key{low.x + ((i & 1U) | (i >> 2U & 2U)), low.y + ((i >> 1U & 1U) | (i >> 3U & 2U)),
                        low.z + ((i >> 2U & 1U) | (i >> 4U & 2U))},
              o->value[i]);
      }
    }
  }

  /// Erases all values and frees the memory.
  void clear() noexcept { *this = voxel_layer{}; }
  [[nodiscard]] bool empty() const noexcept { return index_.empty(); }
  /// Number of voxels with a value. O(octants).
  [[nodiscard]] std::size_t size() const noexcept {
    std::size_t n = 0;
    for (std::size_t i = 0; i != octants_.size(); ++i) n += static_cast<std::size_t>(std::popcount(octants_[i].known));
    return n;
  }
  /// Heap memory in bytes, including memory shared with copies.
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return index_.memory_bytes() + octants_.memory_bytes() + free_.capacity() * sizeof(std::uint32_t);
  }

 private:
  /// `known` is 0 if and only if the octant is unused; all values that are not known are T{}.
  struct octant {
    std::uint64_t code = 0;
    std::uint64_t known = 0;
    std::array<T, 64> value{};
  };

  [[nodiscard]] std::uint32_t add(std::uint64_t code) {
    std::uint32_t i = 0;
    if (free_.empty()) {
      i = static_cast<std::uint32_t>(octants_.size());
      octants_.push_back({});
    } else {
      i = free_.back();
      free_.pop_back();
    }
    index_.set(code, i);
    octants_.writable(i).code = code;
    return i;
  }
  std::size_t erase_in(std::uint64_t code, std::uint64_t mask) {
    const std::uint32_t i = index_.find(code);
    if (i == hash_index::none) return 0;
    const std::uint64_t gone = octants_[i].known & mask;
    if (gone == 0) return 0;
    octant& o = octants_.writable(i);
    for (std::uint64_t bits = gone; bits != 0; bits &= bits - 1)
      o.value[static_cast<std::size_t>(std::countr_zero(bits))] = T{};
    o.known &= ~mask;
    if (o.known == 0) {
      index_.erase(code);
      free_.push_back(i);
    }
    return static_cast<std::size_t>(std::popcount(gone));
  }

  hash_index index_;
  cow_pages<octant> octants_;
  std::vector<std::uint32_t> free_;  ///< unused octants
};

}  // namespace orbis::octree
