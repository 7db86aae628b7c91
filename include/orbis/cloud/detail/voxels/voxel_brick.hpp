// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Components of `voxel_sums.hpp`: a brick of 8^3 voxels, and the index of bricks.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/cloud/detail/voxels/voxel_key.hpp>
#include <orbis/core/image.hpp>

namespace orbis::cloud::detail {

/// A measurement, relative to its brick.
struct voxel_item {
  std::uint16_t cell;                   ///< x + 8 y + 64 z
  std::array<std::uint16_t, 3> offset;  ///< within the voxel, in 1/1024 of its edge
  rgb8 color;
  std::uint32_t range;  ///< millimetres
};

/// Sums of the measurements of a voxel. Uses 32-bit words, because a 64-bit member would enlarge it by a tenth.
struct voxel_sum {
  std::array<std::uint32_t, 2> range_words{};  ///< low, high
  std::array<std::uint32_t, 3> offset{};
  std::array<std::uint32_t, 3> color{};
  std::uint32_t count = 0;

  [[nodiscard]] std::uint64_t range() const noexcept { return range_words[0] | std::uint64_t{range_words[1]} << 32U; }
  void add(const voxel_item& item) noexcept {
    set_range(range() + item.range);
    for (std::size_t a = 0; a != 3; ++a) offset[a] += item.offset[a];
    color[0] += item.color.r;
    color[1] += item.color.g;
    color[2] += item.color.b;
    ++count;
  }
  void remove(const voxel_item& item) noexcept {
    set_range(range() - item.range);
    for (std::size_t a = 0; a != 3; ++a) offset[a] -= item.offset[a];
    color[0] -= item.color.r;
    color[1] -= item.color.g;
    color[2] -= item.color.b;
    --count;
  }

 private:
  void set_range(std::uint64_t range) noexcept {
    range_words = {static_cast<std::uint32_t>(range), static_cast<std::uint32_t>(range >> 32U)};
  }
};

/// The occupied voxels of a brick, in the order of their cells.
template <class = void>
class basic_voxel_brick {
 public:
  /// Number of occupied voxels.
  [[nodiscard]] std::size_t size() const noexcept {
    return before_[7] + static_cast<std::size_t>(std::popcount(mask_[7]));
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return sums_.capacity() * sizeof(voxel_sum); }
  [[nodiscard]] bool contains(std::uint32_t cell) const noexcept { return (mask_[cell / 64] >> (cell % 64) & 1U) != 0; }
  /// Calls `f(cell)` for the occupied cells.
  template <class F>
  void for_each_cell(F&& f) const {
    for_each_cell(mask_, f);
  }
  /// Frees the sums but keeps the set of occupied cells.
  void drop_sums() noexcept { std::vector<voxel_sum>{}.swap(sums_); }
  /// Calls `f(cell, sum)` for the occupied cells. @pre the sums were not dropped
  template <class F>
  void for_each(F&& f) const {
    assert(sums_.size() == size());
    for_each_cell(mask_, [&, i = std::size_t{0}](std::uint32_t cell) mutable { f(cell, sums_[i++]); });
  }

  /// Adds items. `for_each_run(f)` calls `f` with spans of items.
  template <class Runs>
  void add(Runs&& for_each_run) {
    auto mask = mask_;
    for_each_run([&](std::span<const voxel_item> items) {
      for (const voxel_item& item : items) mask[item.cell / 64] |= std::uint64_t{1} << (item.cell % 64);
    });
    if (mask != mask_) widen(mask);
    const rank_table ranks = all_ranks();
    for_each_run([&](std::span<const voxel_item> items) {
      for (const voxel_item& item : items) {
        voxel_sum& sum = sums_[ranks[item.cell]];
        assert(sum.count < most);
        sum.add(item);
      }
    });
  }
  template <class Runs>
  void remove(Runs&& for_each_run) {
    bool emptied = false;
    const rank_table ranks = all_ranks();
    for_each_run([&](std::span<const voxel_item> items) {
      for (const voxel_item& item : items) {
        const bool known = contains(item.cell) && sums_[ranks[item.cell]].count != 0;
        assert(known && "removed without having been added");
        if (!known) continue;
        voxel_sum& sum = sums_[ranks[item.cell]];
        sum.remove(item);
        emptied = emptied || sum.count == 0;
      }
    });
    if (!emptied) return;
    auto mask = mask_;
    for_each([&](std::uint32_t cell, const voxel_sum& sum) {
      if (sum.count == 0) mask[cell / 64] &= ~(std::uint64_t{1} << (cell % 64));
    });
    std::erase_if(sums_, [](const voxel_sum& sum) { return sum.count == 0; });
    if (2 * sums_.size() + slack < sums_.capacity()) sums_.shrink_to_fit();
    set(mask);
  }

 private:
  using cell_mask = std::array<std::uint64_t, 8>;
  static constexpr std::uint32_t most = 1U << 22U;
  static constexpr std::size_t slack = 16;

  /// Ranks of the occupied cells; other entries are undefined. The table avoids a bit count for each measurement, which
  /// is slow on processors without a population count instruction.
  using rank_table = std::array<std::uint16_t, 512>;
  [[nodiscard]] rank_table all_ranks() const {
    rank_table out;  // NOLINT: partly uninitialised by design
    for_each_cell(mask_, [&, i = std::uint16_t{0}](std::uint32_t cell) mutable { out[cell] = i++; });
    return out;
  }

  template <class F>
  static void for_each_cell(const cell_mask& mask, F&& f) {
    for (std::uint32_t w = 0; w != mask.size(); ++w) {
      for (std::uint64_t left = mask[w]; left != 0; left &= left - 1)
        f(64 * w + static_cast<std::uint32_t>(std::countr_zero(left)));
    }
  }
  void set(const cell_mask& mask) {
    mask_ = mask;
    std::size_t count = 0;
    for (std::size_t w = 0; w != mask.size(); ++w) {
      before_[w] = static_cast<std::uint16_t>(count);
      count += static_cast<std::size_t>(std::popcount(mask[w]));
    }
  }
  /// Makes room for additional cells in place, from the end backwards.
  void widen(const cell_mask& mask) {
    const cell_mask old = mask_;
    std::size_t from = sums_.size();
    set(mask);
    const std::size_t count = before_[7] + static_cast<std::size_t>(std::popcount(mask[7]));
    if (count > sums_.capacity()) sums_.reserve(count + count / 8 + 4);
    sums_.resize(count);
    std::size_t to = count;
    for (std::size_t w = mask.size(); w-- > 0;) {
      for (std::uint64_t left = mask[w]; left != 0;) {
        const auto bit = 63U - static_cast<unsigned>(std::countl_zero(left));
        left &= ~(std::uint64_t{1} << bit);
        sums_[--to] = (old[w] >> bit & 1U) != 0 ? sums_[--from] : voxel_sum{};
      }
    }
  }

  cell_mask mask_{};
  std::array<std::uint16_t, 8> before_{};  ///< number of cells before each word of the mask
  std::vector<voxel_sum> sums_;
};
using voxel_brick = basic_voxel_brick<>;

}  // namespace orbis::cloud::detail
