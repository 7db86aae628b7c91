// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Many rays from one point, several at a time: the voxels of traverse_ray, marked in a dense window.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/points/ray_traversal.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

#if ORBIS_X86
#include <immintrin.h>
#endif

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

/// Marks the cells that the rays of `r` cross after the first one. The same comparisons and additions
/// as in traverse_ray; all variants mark the same cells.
inline void traverse_lanes_portable(std::uint8_t* cells, std::int64_t start, const traversal_lanes& r) noexcept {
  for (std::size_t i = 0; i != traversal_lanes::width; ++i) {
    double x = r.next[0][i], y = r.next[1][i], z = r.next[2][i];
    for (std::int64_t at = start;;) {
      const bool along_x = x < y && x < z, along_y = !(x < y) && y < z;
      if (along_x) {
        at += r.stride[0][i];
        x += r.delta[0][i];
      } else if (along_y) {
        at += r.stride[1][i];
        y += r.delta[1][i];
      } else {
        at += r.stride[2][i];
        z += r.delta[2][i];
      }
      if (at == r.end[i] || std::min(std::min(x, y), z) > r.reach[i]) break;
      cells[at] = 1;
    }
  }
}

#if ORBIS_X86
ORBIS_TARGET("avx2,bmi2")
inline void traverse_lanes_avx2(std::uint8_t* cells, std::int64_t start, const traversal_lanes& r) noexcept {
  for (std::size_t i = 0; i != traversal_lanes::width; i += 4) {
    const auto load = [&](const std::array<double, 8>& a) ORBIS_TARGET("avx2") { return _mm256_load_pd(a.data() + i); };
    const auto load_i = [&](const std::array<std::int64_t, 8>& a) ORBIS_TARGET("avx2") {
      return _mm256_load_si256(reinterpret_cast<const __m256i*>(a.data() + i));
    };
    __m256d x = load(r.next[0]), y = load(r.next[1]), z = load(r.next[2]);
    const __m256d dx = load(r.delta[0]), dy = load(r.delta[1]), dz = load(r.delta[2]), reach = load(r.reach);
    const __m256i sx = load_i(r.stride[0]), sy = load_i(r.stride[1]), sz = load_i(r.stride[2]), end = load_i(r.end);
    const __m256i first = _mm256_set1_epi64x(start);
    __m256i at = first, active = _mm256_set1_epi64x(-1);
    for (;;) {
      const __m256d xy = _mm256_cmp_pd(x, y, _CMP_LT_OQ);
      const __m256d along_x = _mm256_and_pd(xy, _mm256_cmp_pd(x, z, _CMP_LT_OQ));
      const __m256d along_y = _mm256_andnot_pd(xy, _mm256_cmp_pd(y, z, _CMP_LT_OQ));
      const __m256d not_z = _mm256_or_pd(along_x, along_y);
      x = _mm256_add_pd(x, _mm256_and_pd(along_x, dx));
      y = _mm256_add_pd(y, _mm256_and_pd(along_y, dy));
      z = _mm256_add_pd(z, _mm256_andnot_pd(not_z, dz));
      const __m256i step = _mm256_or_si256(_mm256_or_si256(_mm256_and_si256(_mm256_castpd_si256(along_x), sx),
                                                           _mm256_and_si256(_mm256_castpd_si256(along_y), sy)),
                                           _mm256_andnot_si256(_mm256_castpd_si256(not_z), sz));
      at = _mm256_add_epi64(at, step);
      const __m256d beyond = _mm256_cmp_pd(_mm256_min_pd(_mm256_min_pd(x, y), z), reach, _CMP_GT_OQ);
      active = _mm256_andnot_si256(_mm256_or_si256(_mm256_cmpeq_epi64(at, end), _mm256_castpd_si256(beyond)), active);
      if (_mm256_testz_si256(active, active) != 0) break;
      // Rays that have ended mark the first cell again: cheaper than asking.
      const __m256i mark = _mm256_blendv_epi8(first, at, active);
      cells[_mm256_extract_epi64(mark, 0)] = 1;
      cells[_mm256_extract_epi64(mark, 1)] = 1;
      cells[_mm256_extract_epi64(mark, 2)] = 1;
      cells[_mm256_extract_epi64(mark, 3)] = 1;
    }
  }
}

ORBIS_TARGET("avx512f,avx512dq,avx512vl")
inline void traverse_lanes_avx512(std::uint8_t* cells, std::int64_t start, const traversal_lanes& r) noexcept {
  __m512d x = _mm512_load_pd(r.next[0].data()), y = _mm512_load_pd(r.next[1].data());
  __m512d z = _mm512_load_pd(r.next[2].data());
  const __m512d dx = _mm512_load_pd(r.delta[0].data()), dy = _mm512_load_pd(r.delta[1].data());
  const __m512d dz = _mm512_load_pd(r.delta[2].data()), reach = _mm512_load_pd(r.reach.data());
  const __m512i sx = _mm512_load_si512(r.stride[0].data()), sy = _mm512_load_si512(r.stride[1].data());
  const __m512i sz = _mm512_load_si512(r.stride[2].data()), end = _mm512_load_si512(r.end.data());
  const __m512i first = _mm512_set1_epi64(start);
  __m512i at = first;
  __mmask8 active = 0xff;
  alignas(64) std::array<std::int64_t, 8> mark;
  for (;;) {
    const __mmask8 xy = _mm512_cmp_pd_mask(x, y, _CMP_LT_OQ);
    const __mmask8 along_x = xy & _mm512_cmp_pd_mask(x, z, _CMP_LT_OQ);
    const __mmask8 along_y = static_cast<__mmask8>(~xy) & _mm512_cmp_pd_mask(y, z, _CMP_LT_OQ);
    const __mmask8 along_z = static_cast<__mmask8>(~(along_x | along_y));
    x = _mm512_mask_add_pd(x, along_x, x, dx);
    y = _mm512_mask_add_pd(y, along_y, y, dy);
    z = _mm512_mask_add_pd(z, along_z, z, dz);
    at = _mm512_mask_add_epi64(at, along_x, at, sx);
    at = _mm512_mask_add_epi64(at, along_y, at, sy);
    at = _mm512_mask_add_epi64(at, along_z, at, sz);
    const __mmask8 beyond = _mm512_cmp_pd_mask(x, reach, _CMP_GT_OQ) & _mm512_cmp_pd_mask(y, reach, _CMP_GT_OQ) &
                            _mm512_cmp_pd_mask(z, reach, _CMP_GT_OQ);
    active &= static_cast<__mmask8>(~(beyond | _mm512_cmpeq_epi64_mask(at, end)));
    if (active == 0) break;
    _mm512_store_si512(mark.data(), _mm512_mask_blend_epi64(active, first, at));
    for (const std::int64_t i : mark) cells[i] = 1;
  }
}
#endif

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
    mark_ = simd::select<void(std::uint8_t*, std::int64_t, const traversal_lanes&)>(simd::detected(), {
      .portable = traverse_lanes_portable,
#if ORBIS_X86
      .popcnt = nullptr, .avx2 = traverse_lanes_avx2, .avx512 = traverse_lanes_avx512
#endif
    });
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
