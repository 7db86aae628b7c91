// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The exact traversal of several rays at a time, marked in a dense window of voxels.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/ray_traversal.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Eight rays that start in the same cell, one member of each array for each ray.
struct traversal_lanes {
  static constexpr std::size_t width = 8;
  alignas(64) std::array<std::array<double, width>, 3> next;
  alignas(64) std::array<std::array<double, width>, 3> delta;
  alignas(64) std::array<std::array<std::int64_t, width>, 3> stride;  ///< of one step, in cells
  alignas(64) std::array<double, width> reach;                        ///< length of the ray
  alignas(64) std::array<std::int64_t, width> end;                    ///< the cell not to be marked
};

/// Marks the cells that the rays of `r` cross after the first one, by the comparisons and additions of traverse_ray.
struct traverse_lanes_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(std::uint8_t* cells, std::int64_t start, const traversal_lanes& r) noexcept {
    constexpr std::size_t n = Target::bytes == 64 ? 8 : 4;
    for (std::size_t i = 0; i != traversal_lanes::width; i += n) traverse<n, Target>(cells, start, r, i);
  }

 private:
  template <std::size_t N, simd::target Target>
  static ORBIS_ALWAYS_INLINE void traverse(std::uint8_t* cells, std::int64_t start, const traversal_lanes& r,
                                           std::size_t i) noexcept {
    using doubles = simd::vec<double, N, Target>;
    using integers = simd::vec<std::int64_t, N, Target>;
    using mask = typename doubles::mask_type;
    doubles x = doubles::load(r.next[0].data() + i), y = doubles::load(r.next[1].data() + i);
    doubles z = doubles::load(r.next[2].data() + i);
    const doubles dx = doubles::load(r.delta[0].data() + i), dy = doubles::load(r.delta[1].data() + i);
    const doubles dz = doubles::load(r.delta[2].data() + i), reach = doubles::load(r.reach.data() + i);
    const integers sx = integers::load(r.stride[0].data() + i), sy = integers::load(r.stride[1].data() + i);
    const integers sz = integers::load(r.stride[2].data() + i), end = integers::load(r.end.data() + i);
    const integers first(start);
    integers at = first;
    mask active = mask::first(N);
    for (;;) {
      const mask before_y = x < y, along_x = before_y & (x < z), along_y = and_not(y < z, before_y);
      const mask along_z = !(along_x | along_y);
      x = select(along_x, x + dx, x);
      y = select(along_y, y + dy, y);
      z = select(along_z, z + dz, z);
      at += select(along_x, sx, select(along_y, sy, sz));
      active = and_not(active, ((x > reach) & (y > reach) & (z > reach)) | (at == end));
      if (none(active)) return;
      // Rays that have ended mark the first cell again: cheaper than asking.
      const integers marks = select(active, at, first);
      [&]<std::size_t... I>(std::index_sequence<I...>) ORBIS_INLINE_LAMBDA { ((cells[marks[I]] = 1), ...); }
      (std::make_index_sequence<N>{});
    }
  }
};

/// A dense window of voxels around a sensor in which the rays of a scan are marked. All zero between
/// scans; its memory is kept.
class dense_window {
 public:
  /// Chooses the window for rays from voxel `from` to voxels between `low` and `high`. False if the
  /// window would be too large, or reach the border of the grid: then walk the rays one by one.
  [[nodiscard]] bool fit(const voxel_grid& grid, const voxel_key& from, voxel_key low, voxel_key high) {
    constexpr std::uint32_t margin = 2;  // rounding may carry a walk past its end, by less than one voxel
    const auto range = [&](std::uint32_t& lo, std::uint32_t& hi, std::uint32_t k) {
      lo = std::min(lo, k);
      hi = std::max(hi, k);
      if (lo < margin || hi + margin >= grid.cells()) return false;
      lo = (lo - margin) & ~7U;
      hi = (hi + margin) | 7U;
      return true;
    };
    if (!range(low.x, high.x, from.x) || !range(low.y, high.y, from.y) || !range(low.z, high.z, from.z)) return false;
    low_ = low;
    size_ = {std::size_t{high.x} - low.x + 1, std::size_t{high.y} - low.y + 1, std::size_t{high.z} - low.z + 1};
    const std::size_t cells = size_[0] * size_[1] * size_[2];
    if (cells > max_cells) return false;
    if (cells_.size() < cells) cells_.resize(cells);
    start_ = cell(from);
    from_ = from;
    mark_ = simd::kernel<traverse_lanes_kernel, void(std::uint8_t*, std::int64_t, const traversal_lanes&)>();
    return true;
  }

  /// Marks what traverse_ray visits, now or when `flush` is called. @pre `to` lies in the window
  void add(const voxel_grid& grid, const float3& origin, const float3& end, const voxel_key& to) {
    if (to == from_) return;
    cells_[static_cast<std::size_t>(start_)] = 1;
    const auto ray = ray_traversal::between(grid, from_, origin, end);
    if (!ray) return;
    const std::array<std::int64_t, 3> stride{1, static_cast<std::int64_t>(size_[0]),
                                             static_cast<std::int64_t>(size_[0] * size_[1])};
    for (std::size_t i = 0; i != 3; ++i) {
      lanes_.next[i][used_] = ray->next[i];
      lanes_.delta[i][used_] = ray->delta[i];
      lanes_.stride[i][used_] = ray->step[i] * stride[i];
    }
    lanes_.reach[used_] = ray->reach;
    lanes_.end[used_] = cell(to);
    if (++used_ == traversal_lanes::width) run();
  }
  /// Walks the rays that are waiting and moves all marks to `masks` as free voxels.
  void flush(scan_masks& masks) {
    for (std::size_t i = used_; i != traversal_lanes::width && used_ != 0; ++i) {
      for (std::size_t axis = 0; axis != 3; ++axis) {
        lanes_.next[axis][i] = lanes_.delta[axis][i] = 1.0;
        lanes_.stride[axis][i] = 0;
      }
      lanes_.reach[i] = -1.0;  // over after one step
      lanes_.end[i] = start_;
    }
    if (used_ != 0) run();

    const std::size_t rows = size_[1] * size_[2];
    for (std::size_t row = 0; row != rows; ++row) {
      std::uint8_t* const cells = cells_.data() + row * size_[0];
      for (std::size_t x = 0; x != size_[0]; x += 8) {
        std::uint64_t eight;
        std::memcpy(&eight, cells + x, 8);
        if (eight == 0) continue;
        std::memset(cells + x, 0, 8);
        if constexpr (std::endian::native == std::endian::big) eight = reversed(eight);
        move_row(masks,
                 {low_.x + static_cast<std::uint32_t>(x), low_.y + static_cast<std::uint32_t>(row % size_[1]),
                  low_.z + static_cast<std::uint32_t>(row / size_[1])},
                 eight);
      }
    }
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept { return cells_.capacity(); }

 private:
  static constexpr std::size_t max_cells = std::size_t{1} << 24U;  // bytes

  [[nodiscard]] std::int64_t cell(const voxel_key& k) const noexcept {
    return static_cast<std::int64_t>((std::size_t{k.z - low_.z} * size_[1] + (k.y - low_.y)) * size_[0] +
                                     (k.x - low_.x));
  }
  void run() {
    mark_(cells_.data(), start_, lanes_);
    used_ = 0;
  }
  [[nodiscard]] static std::uint64_t reversed(std::uint64_t v) noexcept {
    std::uint64_t r = 0;
    for (int i = 0; i != 8; ++i, v >>= 8U) r = r << 8U | (v & 0xffU);
    return r;
  }
  /// Eight voxels from `k` on along x, a byte each.
  static void move_row(scan_masks& masks, const voxel_key& k, std::uint64_t eight) {
    const auto bits = static_cast<std::uint32_t>((eight * 0x0102040810204080ULL) >> 56U);
    const std::uint32_t place = place_in_brick(k);
    const auto spread = [](std::uint32_t four) { return std::uint64_t{(four & 3U) | (four & 12U) << 6U}; };
    auto& free = masks.at(k).free;
    free[place >> 6U] |= spread(bits & 15U) << (place & 63U);
    free[(place >> 6U) + 1] |= spread(bits >> 4U) << (place & 63U);
  }

  std::vector<std::uint8_t> cells_;
  voxel_key low_, from_;
  std::array<std::size_t, 3> size_{};
  std::int64_t start_ = 0;
  traversal_lanes lanes_{};
  std::size_t used_ = 0;
  void (*mark_)(std::uint8_t*, std::int64_t, const traversal_lanes&) = nullptr;
};

}  // namespace orbis::octree::detail
