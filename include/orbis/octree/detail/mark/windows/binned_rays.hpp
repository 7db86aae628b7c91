// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rays of a scan, sorted into cells by direction.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/rays/limit_rays.hpp>
#include <orbis/octree/detail/mark/windows/direction_windows.hpp>

namespace orbis::octree::detail {

/// A ray in the coordinates of its window, through (x, y, 1) to depth z, and the index of the ray.
struct binned_ray {
  float x, y, z;
  std::uint32_t number;
};
static_assert(sizeof(binned_ray) == 16);

/// Rays of one window. For each cell: the depth of the deepest end (0 if the cell is empty), the index of its ray, and
/// the start of the cell's rays among the sorted rays. `rays`: all rays, in the order of their indices.
struct window_rays {
  const float* z = nullptr;
  const std::int32_t* deepest = nullptr;
  const std::uint32_t* begin = nullptr;
  std::int32_t stride = 0;
  const binned_ray* rays = nullptr;
  const binned_ray* sorted = nullptr;
};

/// Cells of the rays of a batch. `left_out`, bit i: ray i is in no window.
struct ray_places {
  alignas(64) std::array<std::uint32_t, ray_batch::capacity> cell;
  ray_batch::bits left_out;
  float max_z;
};

/// Parameters of the windows for place_rays.
struct window_tables {
  float3 origin{};
  std::array<float3, 3> axes{};  ///< axes of the cube
  float per_cell = 1;
  std::uint32_t nowhere = 0;  ///< the cell for rays that are in no window
  alignas(64) std::array<float, 16> min_x{}, min_y{};
  alignas(64) std::array<float, 16> width{}, height{};
  alignas(64) std::array<std::int32_t, 16> stride{}, begin{};

  window_tables() = default;
  window_tables(const direction_windows& w, const float3& at) noexcept
      : origin{at},
        axes{w.window[0].axes[2], w.window[2].axes[2], w.window[4].axes[2]},
        per_cell{1.0F / w.cell},
        nowhere{w.cells} {
    for (std::size_t i = 0; i != direction_windows::faces; ++i) {
      const direction_window& f = w.window[i];
      min_x[i] = f.min_x;
      min_y[i] = f.min_y;
      width[i] = static_cast<float>(f.width);
      height[i] = static_cast<float>(f.height);
      stride[i] = f.stride;
      begin[i] = static_cast<std::int32_t>(f.begin);
    }
  }
};

/// Places the first `count` rays of a batch: writes them to `out` in window coordinates, with indices starting at
/// `first`. `out` needs room for a multiple of 16 rays.
struct place_rays_kernel {
  template <simd::target Target>
  static ORBIS_ALWAYS_INLINE void run(const window_tables& t, const ray_batch& rays, std::size_t count,
                                      std::uint32_t first, binned_ray* out, ray_places& places) noexcept {
    using floats = simd::native_vec<float, Target>;
    using integers = simd::native_vec<std::int32_t, Target>;
    using mask = typename floats::mask_type;
    constexpr std::size_t n = floats::count;
    places.left_out = {};
    alignas(64) std::array<std::int32_t, n> count_up;
    for (std::size_t i = 0; i != n; ++i) count_up[i] = static_cast<std::int32_t>(i);
    const integers lanes = integers::load(count_up.data());
    floats max_z(0.0F);
    for (std::size_t i = 0; i < count; i += n) {
      const ray_lanes<Target> r{rays, t.origin, i};
      const mask valid = r.leaves;
      const floats a = r.along(t.axes[0]), b = r.along(t.axes[1]), c = r.along(t.axes[2]);
      const floats size_a = abs(a), size_b = abs(b), size_c = abs(c);
      const mask by_c = (size_c >= size_a) & (size_c >= size_b), by_a = and_not(size_a >= size_b, by_c);
      const floats main = select(by_c, c, select(by_a, a, b)), depth = abs(main), inverse = 1.0F / depth;
      const floats x = select(by_a, b, a) * inverse, y = select(by_c, b, c) * inverse;
      const integers face = select(by_c, integers(4), select(by_a, integers(0), integers(2))) +
                            select(main < 0.0F, integers(1), integers(0));
      const auto of_face = [&](const auto& table) ORBIS_INLINE_LAMBDA {
        using values = simd::native_vec<std::remove_cvref_t<decltype(table[0])>, Target>;
        if constexpr (n >= 8)
          return simd::look_up(values::load(table.data()), face);
        else
          return simd::gather(table.data(), face);
      };
      const floats u = floor((x - of_face(t.min_x)) * t.per_cell), v = floor((y - of_face(t.min_y)) * t.per_cell);
      const mask inside =
          valid & (u >= 0.0F) & (v >= 0.0F) & (u < of_face(t.width)) & (v < of_face(t.height)) & (depth > 1e-30F);
      max_z = max(max_z, select(inside, depth, floats(0.0F)));
      const integers cell = of_face(t.begin) +
                            simd::convert<std::int32_t>(select(inside, v, floats(0.0F))) * of_face(t.stride) +
                            simd::convert<std::int32_t>(select(inside, u, floats(0.0F)));
      simd::bits_as<std::uint32_t>(select(inside, cell, integers(static_cast<std::int32_t>(t.nowhere))))
          .store(places.cell.data() + i);
      places.left_out[i >> 6U] |= std::uint64_t{simd::bits(and_not(valid, inside))} << (i & 63U);
      const floats number = simd::bits_as<float>(lanes + static_cast<std::int32_t>(first + i));
      auto* const to = reinterpret_cast<float*>(out + i);
      const floats xz_low = zip_low(x, depth), xz_high = zip_high(x, depth);
      const floats yn_low = zip_low(y, number), yn_high = zip_high(y, number);
      zip_low(xz_low, yn_low).store(to);
      zip_high(xz_low, yn_low).store(to + n);
      zip_low(xz_high, yn_high).store(to + 2 * n);
      zip_high(xz_high, yn_high).store(to + 3 * n);
    }
    places.max_z = greatest(max_z);
  }
};

using place_kernel = void(const window_tables&, const ray_batch&, std::size_t, std::uint32_t, binned_ray*, ray_places&);

/// Sorts the rays of a scan by the cells of its windows. Reuses its memory between scans.
template <class = void>
class basic_binned_rays {
 public:
  static constexpr std::size_t most_rays = std::size_t{1} << 24U;
  /// Maximum number of rays per cell and worker, to limit the number of rays to test per voxel.
  static constexpr std::uint32_t most_in_cell = 255;

  /// Starts a scan of `count` points, to which `workers` threads add rays.
  void start(const direction_windows& windows, const float3& origin, std::size_t count, std::size_t workers) {
    tables_ = {windows, origin};
    cells_ = windows.cells;
    rays_.resize(count + 2 * ray_batch::capacity);
    cell_.resize(count);
    rank_.resize(count);
    bins_.resize(std::max(bins_.size(), workers));
    workers_ = workers;
    for (std::size_t i = 0; i != workers; ++i) {
      bins_[i].max_z = 0.0F;
      if (bins_[i].bins.size() < cells_) bins_[i].bins.resize(cells_);
      bins_[i].first.resize(cells_);
    }
    place_ = simd::kernel<place_rays_kernel, place_kernel>();
  }
  /// Adds the rays of a batch of `count` points, the first of which is point `first` of the scan. The rays that must be
  /// traversed one by one remain in `rays`. Several workers can call it concurrently. @pre no other worker adds points
  /// between `first` and the next multiple of 256
  void add(std::size_t worker, ray_batch& rays, std::size_t first, std::size_t count) {
    ray_places places;
    const binned_ray* const placed = rays_.data() + first;
    place_(tables_, rays, count, static_cast<std::uint32_t>(first), rays_.data() + first, places);
    std::copy_n(places.cell.data(), count, cell_.data() + first);
    worker_bins& b = bins_[worker];
    b.max_z = std::max(b.max_z, places.max_z);
    for (std::size_t i = 0; i != count; ++i) {
      const std::uint32_t c = places.cell[i];
      if (c == tables_.nowhere) continue;
      const std::uint64_t before = b.bins[c], rank = before & 0xffU;
      if (rank == most_in_cell) {
        places.left_out[i >> 6U] |= std::uint64_t{1} << (i & 63U);
        cell_[first + i] = tables_.nowhere;
        continue;
      }
      rank_[first + i] = static_cast<std::uint8_t>(rank);
      const std::uint64_t ray = std::uint64_t{std::bit_cast<std::uint32_t>(placed[i].z)} << 32U | (first + i) << 8U;
      b.bins[c] = std::max(before - rank, ray) | (rank + 1);
    }
    rays.keep(places.left_out);
  }
  /// Sorts the added rays. `range(worker)` returns the points that the worker added.
  template <execution_policy Policy, class Range>
  void sort(const Policy& policy, Range&& range) {
    begin_.resize(cells_ + 1);
    z_.resize(cells_ + direction_window::padding);
    deepest_.resize(cells_ + direction_window::padding);
    max_z_ = 0.0F;
    for (std::size_t w = 0; w != workers_; ++w) max_z_ = std::max(max_z_, bins_[w].max_z);
    std::uint32_t next = 0;
    for (std::size_t c = 0; c != cells_; ++c) {
      begin_[c] = next;
      std::uint64_t bin = std::exchange(bins_[0].bins[c], 0);
      next += bin & 0xffU;
      for (std::size_t w = 1; w != workers_; ++w) {
        bins_[w].first[c] = next;
        const std::uint64_t more = std::exchange(bins_[w].bins[c], 0);
        next += more & 0xffU;
        bin = std::max(bin, more);
      }
      z_[c] = std::bit_cast<float>(static_cast<std::uint32_t>(bin >> 32U));
      deepest_[c] = static_cast<std::int32_t>(bin >> 8U & 0xffffffU);
    }
    begin_[cells_] = next;
    sorted_.resize(next + 2 * ray_batch::capacity);
    for_each_index(policy, workers_, 1, [&](std::size_t w) {
      const auto [begin, end] = range(w);
      const std::uint32_t* const first = w == 0 ? begin_.data() : bins_[w].first.data();
      for (std::size_t i = begin; i != end; ++i)
        if (const std::uint32_t c = cell_[i]; c != tables_.nowhere) sorted_[first[c] + rank_[i]] = rays_[i];
    });
  }

  [[nodiscard]] std::size_t size() const noexcept { return begin_[cells_]; }
  /// Maximum depth of the ray endpoints.
  [[nodiscard]] float max_z() const noexcept { return max_z_; }
  [[nodiscard]] window_rays window(const direction_window& w) const noexcept {
    return {z_.data() + w.begin, deepest_.data() + w.begin, begin_.data() + w.begin, w.stride, rays_.data(),
            sorted_.data()};
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = (rays_.capacity() + sorted_.capacity()) * sizeof(binned_ray) + rank_.capacity() +
                        (cell_.capacity() + begin_.capacity() + z_.capacity() + deepest_.capacity()) * sizeof(float) +
                        bins_.capacity() * sizeof(worker_bins);
    for (const worker_bins& w : bins_)
      bytes += w.bins.capacity() * sizeof(w.bins[0]) + w.first.capacity() * sizeof(w.first[0]);
    return bytes;
  }

 private:
  struct worker_bins {
    /// One packed number per cell: the number of rays (8 bits), the index of the deepest one (24), and its depth (32).
    /// Larger numbers represent deeper rays. All numbers are zero between scans.
    std::vector<std::uint64_t> bins;
    std::vector<std::uint32_t> first;  ///< position of this worker's first ray in each cell
    float max_z = 0.0F;
  };

  window_tables tables_;
  std::uint32_t cells_ = 0;
  std::size_t workers_ = 0;
  float max_z_ = 0.0F;
  place_kernel* place_ = nullptr;
  std::vector<binned_ray> rays_, sorted_;
  std::vector<std::uint32_t> cell_, begin_;
  std::vector<std::uint8_t> rank_;
  std::vector<float> z_;
  std::vector<std::int32_t> deepest_;
  std::vector<worker_bins> bins_;
};
using binned_rays = basic_binned_rays<>;

}  // namespace orbis::octree::detail
