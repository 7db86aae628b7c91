// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rasterises many rays from one point: finds exactly the same voxels as traverse_ray, many times faster.
///
/// A traversal compares the distances at which a ray leaves its voxel along x, y and z. Only the outcomes of these
/// comparisons matter. Instead of stepping along each ray, the rasteriser computes the ray's crossings with the planes
/// of voxel faces perpendicular to its main axis, with known error, slab by slab for all rays, in maps that fit into
/// the cache. If the error could change an outcome, the ray is traversed step by step.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/rays/limit_rays.hpp>
#include <orbis/octree/detail/mark/rays/plane_crossings.hpp>
#include <orbis/octree/detail/mark/rays/ray_setup.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Collects the rays of one scan and marks their voxels. Reuses its memory between scans: a few megabytes, independent
/// of the length of the rays.
template <class = void>
class basic_ray_rasterizer {
 public:
  /// Starts a scan from `origin` in voxel `from`.
  void start(const voxel_grid& grid, const float3& origin, const voxel_key& from) {
    grid_ = &grid;
    source_ = {grid, origin, from};
    for (auto& q : queues_) q.clear();
    fallback_.clear();
    passed_ = 0;
    set_up_ = set_up_rays();
    mark_crossings_ = mark_crossings();
  }

  /// Marks the voxels in `masks` that traverse_ray visits for the first `count` rays of a batch, immediately or when
  /// `flush` is called. May also mark the end of a ray that is a hit, because that voxel counts as occupied in any
  /// case.
  void add(const ray_batch& rays, std::size_t count, scan_masks& masks) {
    for (std::size_t i = 0; i < count; i += ray_batch::lanes) {
      const std::uint32_t cut = ray_batch::eight(rays.cut, i);
      const std::uint32_t wanted = ray_batch::eight(rays.hit, i) | cut;
      if (wanted == 0) continue;
      set_up_(source_, rays, i, setup_);
      for (std::uint32_t left = wanted; left != 0; left &= left - 1) {
        const auto lane = static_cast<std::size_t>(std::countr_zero(left));
        const float3 end{rays.end[0][i + lane], rays.end[1][i + lane], rays.end[2][i + lane]};
        if ((setup_.done >> lane & 1U) == 0)
          fallback_.push_back(end);
        else
          take(lane, end, (cut >> lane & 1U) != 0, masks);
      }
      if (fallback_.size() >= max_waiting) flush_fallback(masks);
    }
  }

  /// Marks the voxels of the queued rays.
  void flush(scan_masks& masks) {
    if (grid_ == nullptr) return;
    for (std::size_t kind = 0; kind != queues_.size(); ++kind) rasterize(kind, masks);
    flush_fallback(masks);
    for (; passed_ != 0; passed_ &= passed_ - 1) {
      const int voxel = std::countr_zero(passed_);
      masks.mark_free(key({voxel % 3 - 1, voxel / 3 % 3 - 1, voxel / 9 - 1}));
    }
  }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = rays_.memory_bytes() + bytes_.capacity() +
                        (counts_.capacity() + buckets_.capacity()) * sizeof(std::uint32_t) +
                        bounds_.capacity() * sizeof(bounds) + doubtful_.capacity() * sizeof(std::uint32_t) +
                        fallback_.capacity() * sizeof(float3);
    for (const auto& q : queues_) bytes += q.capacity() * sizeof(waiting_ray);
    return bytes;
  }

 private:
  static constexpr std::size_t max_waiting = 1U << 14U;  ///< maximum number of rays rasterised at once
  static constexpr double max_width = 448.0;             ///< maximum planned width of a map, in cells
  static constexpr std::int32_t slab = 16;               ///< number of layers rasterised at once: two bricks

  struct waiting_ray {
    double u, du, v, dv;
    std::int32_t planes;
    float3 end;
  };
  /// Bounds of the slopes of rays.
  struct bounds {
    float low_u = std::numeric_limits<float>::infinity(), high_u = -low_u;
    float low_v = low_u, high_v = high_u;
    void add(const bounds& b) noexcept {
      low_u = std::min(low_u, b.low_u);
      high_u = std::max(high_u, b.high_u);
      low_v = std::min(low_v, b.low_v);
      high_v = std::max(high_v, b.high_v);
    }
  };

  /// Voxel at an offset from the origin's voxel.
  [[nodiscard]] voxel_key key(const std::array<std::int32_t, 3>& away) const noexcept {
    return {static_cast<std::uint32_t>(source_.from[0] + away[0]),
            static_cast<std::uint32_t>(source_.from[1] + away[1]),
            static_cast<std::uint32_t>(source_.from[2] + away[2])};
  }
  void flush_fallback(scan_masks& masks) {
    for (const float3& end : fallback_) mark_ray(masks, *grid_, source_.origin, key({}), end, *grid_->key(end));
    fallback_.clear();
  }

  /// Queues a prepared ray, and immediately marks the voxels that no plane marks.
  void take(std::size_t lane, const float3& end, bool cut, scan_masks& masks) {
    const ray_setup& r = setup_;
    const std::int32_t kind = r.kind[lane], planes = r.planes[lane];
    if (source_.on_edge) {
      const std::uint32_t passed = first_steps(source_, end, ray_setup::down(kind));
      if (passed == 0) return fallback_.push_back(end);
      passed_ |= passed & ~(1U << 31U);
    }
    const auto is = [lane](std::uint32_t bits) { return (bits >> lane & 1U) != 0; };
    const bool end_u = is(r.end_u), end_v = is(r.end_v);
    // The end of a limited ray must stay unmarked; a plane marks the voxels on both sides.
    const std::int32_t marked_planes = cut ? planes - 1 : planes;
    if (cut || planes == 0 || (end_u && end_v)) {
      const std::int32_t u = r.cell_u[lane], v = r.cell_v[lane];
      const auto mark = [&](std::int32_t n, std::int32_t cell_u, std::int32_t cell_v) {
        mark_cell(kind, n, cell_u, cell_v, masks);
      };
      if (cut && planes != 0) {
        const bool step_u = is(r.step_u), step_v = is(r.step_v);
        if (planes == 1) mark(0, 0, 0);
        if (step_u || step_v) mark(planes - 1, u, v);
        if (step_u && step_v) is(r.step_u_first) ? mark(planes - 1, u, v - 1) : mark(planes - 1, u - 1, v);
      }
      if ((end_u || end_v) && (cut || planes == 0)) mark(planes, u, v);
      if (end_u && end_v) is(r.end_u_first) ? mark(planes, u + 1, v) : mark(planes, u, v + 1);
    }
    if (marked_planes <= 0) return;
    const auto number = static_cast<std::size_t>(source_.on_edge ? kind : kind & ~3);
    auto& queue = queues_[number];
    queue.push_back({r.u[lane], r.du[lane], r.v[lane], r.dv[lane], marked_planes, end});
    if (queue.size() == max_waiting) rasterize(number, masks);
  }
  /// Start voxel of the rays of a kind, relative to the origin's voxel.
  [[nodiscard]] std::array<std::int32_t, 3> start_voxel(std::int32_t kind) const noexcept {
    const auto down = ray_setup::down(kind);
    std::array<std::int32_t, 3> at{};
    for (std::size_t i = 0; i != 3; ++i) at[i] = down[i] != 0 ? -source_.skipped[1][i] : source_.skipped[0][i];
    return at;
  }
  /// Marks the cell (u, v) of a ray's n-th layer; the indices are relative to the start of the ray.
  void mark_cell(std::int32_t kind, std::int32_t n, std::int32_t u, std::int32_t v, scan_masks& masks) const {
    std::array<std::int32_t, 3> at = start_voxel(kind);
    const std::size_t axis = ray_setup::axis(kind);
    at[axis] += (kind & 4) != 0 ? -n : n;
    at[ray_setup::axis_u(axis)] += (kind & 1) != 0 ? -u : u;
    at[ray_setup::axis_v(axis)] += (kind & 2) != 0 ? -v : v;
    masks.mark_free(key(at));
  }

  /// Index of the slab that contains the last voxels marked by a ray that crosses this number of planes.
  [[nodiscard]] static std::int32_t last_slab(std::int32_t origin, std::int32_t step, std::int32_t planes) noexcept {
    return std::abs((origin + step * planes) / slab - origin / slab);
  }

  void rasterize(std::size_t kind, scan_masks& masks) {
    auto& queue = queues_[kind];
    if (queue.empty()) return;
    stack_placement place;
    place.axis = kind >> 3U;
    const std::int32_t step = place.step = (kind & 4U) == 0 ? 1 : -1;
    place.start = start_voxel(static_cast<std::int32_t>(kind));
    for (std::size_t i = 0; i != 3; ++i) place.start[i] += source_.from[i];
    const std::int32_t origin = place.start[place.axis];

    std::int32_t planes = 0;
    bounds all;
    for (const waiting_ray& r : queue) {
      planes = std::max(planes, r.planes);
      all.add(slopes(r));
    }
    // Rays that would need a wider map are grouped into tiles of neighbouring directions.
    const auto tiles = [&](float low, float high) {
      return 1 + static_cast<std::size_t>((high - low) * static_cast<float>(planes) / max_width);
    };
    const std::size_t tiles_u = tiles(all.low_u, all.high_u), tiles_v = tiles(all.low_v, all.high_v);
    const auto tile = [](float x, float low, float high, std::size_t count) {
      return count == 1
                 ? 0
                 : std::min(count - 1, static_cast<std::size_t>((x - low) / (high - low) * static_cast<float>(count)));
    };
    const auto slabs = static_cast<std::size_t>(last_slab(origin, step, planes)) + 1;
    // Within a tile the longest rays come first, so that the rays of a slab are a prefix.
    const auto bucket = [&](const waiting_ray& r) {
      const std::size_t u = tile(static_cast<float>(r.du), all.low_u, all.high_u, tiles_u);
      const std::size_t v = tile(static_cast<float>(r.dv), all.low_v, all.high_v, tiles_v);
      return (v * tiles_u + u + 1) * slabs - 1 - static_cast<std::size_t>(last_slab(origin, step, r.planes));
    };
    counts_.assign(tiles_u * tiles_v * slabs + 1, 0);
    bounds_.assign(tiles_u * tiles_v * slabs, {});
    rays_.fit(queue.size());
    buckets_.resize(queue.size());
    for (std::size_t i = 0; i != queue.size(); ++i) {
      const std::size_t b = bucket(queue[i]);
      buckets_[i] = static_cast<std::uint32_t>(b);
      ++counts_[b + 1];
      bounds_[b].add(slopes(queue[i]));
    }
    for (std::size_t i = 1; i != counts_.size(); ++i) counts_[i] += counts_[i - 1];
    for (std::size_t i = 0; i != queue.size(); ++i) {
      const waiting_ray& r = queue[i];
      const std::size_t to = counts_[buckets_[i]]++;
      rays_.u[to] = r.u;
      rays_.du[to] = r.du;
      rays_.v[to] = r.v;
      rays_.dv[to] = r.dv;
      rays_.planes[to] = r.planes;
      rays_.id[to] = static_cast<std::uint32_t>(i);
    }
    // counts_[b] is now the end of bucket b.
    doubtful_.clear();
    for (std::size_t t = 0; t != tiles_u * tiles_v; ++t) {
      const std::size_t first_bucket = t * slabs;
      const std::size_t begin = t == 0 ? 0 : counts_[first_bucket - 1];
      for (std::size_t b = first_bucket + 1; b != first_bucket + slabs; ++b) bounds_[b].add(bounds_[b - 1]);
      for (std::size_t s = 0; s != slabs; ++s) {
        const std::size_t b = first_bucket + slabs - 1 - s;
        if (counts_[b] == begin) break;
        mark_slab(place, static_cast<std::int32_t>(s), planes, bounds_[b], begin, counts_[b], masks);
      }
    }
    for (const std::uint32_t i : doubtful_) fallback_.push_back(queue[i].end);
    queue.clear();
    if (fallback_.size() >= max_waiting) flush_fallback(masks);
  }
  [[nodiscard]] static bounds slopes(const waiting_ray& r) noexcept {
    const auto u = static_cast<float>(r.du), v = static_cast<float>(r.dv);
    return {u, u, v, v};
  }

  void mark_slab(stack_placement place, std::int32_t number, std::int32_t planes, const bounds& b, std::size_t begin,
                 std::size_t end, scan_masks& masks) {
    const std::int32_t origin = place.start[place.axis], step = place.step;
    // Layers of the slab, relative to the origin's layer along the rays.
    const std::int32_t low = (origin / slab + step * number) * slab;
    const std::int32_t first = number == 0 ? 0 : step > 0 ? low - origin : origin - (low + slab - 1);
    const std::int32_t last = place.last = std::min(step > 0 ? low + slab - 1 - origin : origin - low, planes);

    plane_stack w;
    w.first = first;
    w.count = last - first + 2;
    const auto range = [&](float low_slope, float high_slope, std::int32_t from, std::int32_t& lowest) {
      const auto a = static_cast<float>(first), z = static_cast<float>(last + 1);
      const float l = std::min(low_slope * a, low_slope * z) - 2.0F,
                  h = std::max(high_slope * a, high_slope * z) + 3.0F;
      lowest = ((from + static_cast<std::int32_t>(std::floor(l))) & ~7) - from;
      const std::int32_t highest = ((from + static_cast<std::int32_t>(std::floor(h))) | 7) - from;
      return static_cast<std::uint32_t>(highest - lowest + 1);
    };
    place.width = range(b.low_u, b.high_u, place.start[place.axis_u()], w.low_u);
    place.rows = range(b.low_v, b.high_v, place.start[place.axis_v()], w.low_v);
    w.log2_width = static_cast<unsigned>(std::bit_width((place.width >> 3U) - 1));
    w.size = std::size_t{place.rows} * 8 << w.log2_width;
    w.stride = w.size + 64;
    const auto maps = static_cast<std::size_t>(w.count);
    if (bytes_.size() < 2 * maps * w.stride) bytes_.resize(2 * maps * w.stride);
    w.planes = bytes_.data();
    w.layers = w.planes + maps * w.stride;
    if (first == 0) w.planes[w.cell(0, 0)] = plane_stack::marked;
    mark_crossings_(w, rays_, begin, end, doubtful_);
    move_to_masks(w, place, masks);
    std::memset(w.planes, 0, 2 * maps * w.stride);
  }

  const voxel_grid* grid_ = nullptr;
  scan_origin source_;
  ray_setup setup_;
  std::uint32_t passed_ = 0;  ///< see first_steps
  std::array<std::vector<waiting_ray>, ray_setup::kinds> queues_;
  queued_rays rays_;
  std::vector<std::uint8_t> bytes_;  ///< set to zero after each slab
  std::vector<std::uint32_t> counts_, buckets_;
  std::vector<bounds> bounds_;
  std::vector<std::uint32_t> doubtful_;
  std::vector<float3> fallback_;  ///< ends of the rays that need the exact traversal
  setup_kernel* set_up_ = nullptr;
  crossings_kernel* mark_crossings_ = nullptr;
};
using ray_rasterizer = basic_ray_rasterizer<>;

}  // namespace orbis::octree::detail
