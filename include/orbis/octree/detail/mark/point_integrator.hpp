// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Finds the voxels that a point cloud observes as free and as occupied.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/octree/detail/mark/organised/organised_rays.hpp>
#include <orbis/octree/detail/mark/rays/limit_rays.hpp>
#include <orbis/octree/detail/mark/rays/point_keys.hpp>
#include <orbis/octree/detail/mark/rays/ray_rasterizer.hpp>
#include <orbis/octree/detail/mark/windows/dense_rays.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree::detail {

/// Marks the voxels of one scan. The result depends neither on the order of the points nor on the number of threads.
/// Reuses its memory between scans.
template <class = void>
class basic_point_integrator {
 public:
  /// Voxels of the last scan; a voxel both free and occupied counts as occupied.
  [[nodiscard]] const scan_masks& masks() const noexcept { return workers_.front().masks; }

  /// Marks the scan of points seen from `origin`. In mode every_ray, voxels that a miss would not change according to
  /// `saturated` may be missing from the free ones, see depth_integrator::mark. The summary's voxel counts stay zero.
  /// Marks nothing if the origin is not finite; traverses no rays if it is outside the grid. O(points + voxels at
  /// surfaces), or O(points x voxels along a ray) if there are few points per voxel.
  template <execution_policy Policy>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, const point_source& point,
                           const float3& origin, const integration_options& options,
                           const saturated_voxels& saturated = {}) {
    const std::size_t count = point.count;
    prepare(policy.threads(), count);
    if (!is_finite(origin)) return {.used = 0, .truncated = 0, .rejected = count};
    const sensor from = start(grid, origin, options);
    if (options.mode == ray_mode::every_ray) {
      const auto done_by = [&](auto& marker) -> std::optional<integration_summary> {
        if (!from.key || !marker.plan(grid, origin, count, point, from.max_range)) return std::nullopt;
        auto done = mark_by(marker, policy, from, point, saturated);
        if (done) return done;
        for (worker& w : active_) w.clear();
        start(grid, origin, options);
        return std::nullopt;
      };
      if (const auto done = done_by(organised_)) return *done;
      if (const auto done = done_by(dense_)) return *done;
      for_each_with_worker(policy, count, 4096, [&](worker& w, std::size_t begin, std::size_t end) {
        w.add_points(from, begin, end, point, [](std::size_t, std::size_t) {});
      });
    } else {
      for_each_with_worker(policy, count, 4096,
                           [&](worker& w, std::size_t begin, std::size_t end) { w.add_ends(grid, begin, end, point); });
      for (std::size_t i = 1; i != active_.size(); ++i) workers_[0].ends.merge(workers_[i].ends);
      add_centers(policy, from, workers_[0].ends);
    }
    return finish(policy);
  }

  /// Second step of mode `discretized`: marks the rays to the centres of the voxels that are occupied in `ends`.
  /// @pre `ends` does not belong to this object
  template <execution_policy Policy>
  integration_summary mark_centers(const Policy& policy, const voxel_grid& grid, const scan_masks& ends,
                                   const float3& origin, const integration_options& options) {
    prepare(policy.threads(), 64 * ends.bricks().size());
    if (!is_finite(origin)) return {};
    add_centers(policy, start(grid, origin, options), ends);
    return finish(policy);
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = workers_.capacity() * sizeof(worker) + organised_.memory_bytes() + dense_.memory_bytes();
    for (const worker& w : workers_) bytes += w.masks.memory_bytes() + w.ends.memory_bytes() + w.sweep.memory_bytes();
    return bytes;
  }

 private:
  struct sensor {
    const voxel_grid& grid;
    float3 origin;
    std::optional<voxel_key> key;  ///< empty: no ray is traversed
    double max_range;
    limit_kernel* limit_batch = limit_rays();
    fresh_kernel* fresh_hits = find_fresh_hits();

    /// Returns the end of the ray to a valid point, as limit_rays computes it.
    [[nodiscard]] ray_endpoint end(const float3& p) const noexcept {
      const float3 ray = difference(p, origin);
      const double distance = length(ray);
      ray_endpoint e;
      e.point = distance <= max_range ? p : cut_off(origin, ray, distance, max_range);
      e.key = *grid.key(e.point);
      return e;
    }
  };

  /// Results and scratch memory of one thread.
  struct worker {
    scan_masks masks;
    scan_masks ends;  ///< mode discretized: voxels that contain points, marked as occupied
    integration_summary summary;
    ray_rasterizer sweep;
    point_batch batch;
    std::size_t batched = 0;  ///< number of centres waiting in the batch
    batch_keys keys;
    ray_batch rays;
    std::array<std::uint64_t, 1024> seen;  ///< recently marked voxels; rays of the next image row often end in them

    void clear() noexcept {
      seen.fill(~std::uint64_t{0});
      masks.clear();
      ends.clear();
      summary = {};
    }
    /// Adds the points [begin, end) in mode every_ray. `take(begin, count)` may remove rays from `rays`, see
    /// binned_rays::add.
    template <class Take>
    void add_points(const sensor& from, std::size_t begin, std::size_t end, const point_source& point, Take&& take) {
      while (begin != end) {
        const std::size_t n = std::min(end - begin, point_batch::capacity);
        point.load(begin, n, batch);
        find_rays(from, n);
        take(begin, n);
        if (from.key) sweep.add(rays, n, masks);
        begin += n;
      }
    }
    /// Computes the rays of the batch; marks and counts their points.
    void find_rays(const sensor& from, std::size_t count) {
      const voxel_key base = from.key.value_or(voxel_key{});
      from.limit_batch({from.grid, from.origin, base}, batch, from.max_range, count, rays);
      const std::size_t used = ray_batch::count(rays.hit), cut = ray_batch::count(rays.cut);
      summary.used += used;
      summary.truncated += cut;
      summary.rejected += count - used - cut;
      ray_batch::bits fresh;
      from.fresh_hits(rays, count, fresh);
      // Packs a voxel into one number. Whether it is in `seen` is unpredictable, so the code has no branches.
      constexpr unsigned bits = 21;
      static_assert(max_tree_depth <= bits);
      std::array<std::uint64_t, ray_batch::capacity> unseen;
      std::size_t unseen_count = 0;
      for (std::size_t word = 0; word != fresh.size(); ++word)
        for (std::uint64_t left = fresh[word]; left != 0; left &= left - 1) {
          const std::size_t i = 64 * word + static_cast<std::size_t>(std::countr_zero(left));
          const auto at = [&](std::size_t axis) { return static_cast<std::uint32_t>(rays.way[axis][i]); };
          const std::uint64_t x = base.x + at(0), y = base.y + at(1), z = base.z + at(2);
          const std::uint64_t voxel = x | y << bits | z << 2 * bits;
          std::uint64_t& last = seen[(x * 5 + y * 37 + z * 331) % seen.size()];
          unseen[unseen_count] = voxel;
          unseen_count += last != voxel ? 1 : 0;
          last = voxel;
        }
      for (std::size_t i = 0; i != unseen_count; ++i) {
        const auto at = [&](unsigned axis) {
          return static_cast<std::uint32_t>(unseen[i] >> axis * bits) & ((1U << bits) - 1);
        };
        masks.mark_occupied({at(0), at(1), at(2)});
      }
    }
    /// Adds the points [begin, end) in the mode `discretized`.
    void add_ends(const voxel_grid& grid, std::size_t begin, std::size_t end, const point_source& point) {
      scan_brick* brick = nullptr;  // brick of the last point; neighbours are mostly in the same brick
      while (begin != end) {
        const std::size_t n = std::min(end - begin, point_batch::capacity);
        point.load(begin, n, batch);
        begin += n;
        find_keys(grid, batch, n, keys);
        for (std::size_t i = 0; i != keys.count; ++i) {
          const voxel_key k{keys.x[i], keys.y[i], keys.z[i]};
          if (const std::uint64_t name = node_name(k, brick_level); brick == nullptr || name != brick->name)
            brick = &ends.at(k);
          const std::uint32_t place = place_in_brick(k);
          brick->occupied[place >> 6U] |= std::uint64_t{1} << (place & 63U);
        }
        summary.rejected += keys.outside;
      }
    }
    /// Adds the centres of a brick's occupied voxels as points.
    void add_centers(const sensor& from, const scan_brick& b) {
      const voxel_key base = named_key(b.name);
      for_each_place(b.occupied, [&](std::uint32_t place) {
        const voxel_key in = voxel_in_brick(place);
        const vec3 c = from.grid.center(voxel_key{base.x + in.x, base.y + in.y, base.z + in.z});
        batch.x[batched] = static_cast<float>(c.x());
        batch.y[batched] = static_cast<float>(c.y());
        batch.z[batched] = static_cast<float>(c.z());
        if (++batched == point_batch::capacity) add_batched(from);
      });
    }
    void add_batched(const sensor& from) {
      find_rays(from, batched);
      if (from.key) sweep.add(rays, batched, masks);
      batched = 0;
    }
  };

  void prepare(unsigned threads, std::size_t count) {
    // With fewer rays, merging the masks of a thread takes longer than the thread saves.
    const std::size_t useful = 1 + count / 4096;
    const std::size_t count_of_workers = std::clamp<std::size_t>(threads, 1, useful);
    if (workers_.size() < count_of_workers) workers_.resize(count_of_workers);
    active_ = std::span{workers_}.first(count_of_workers);
    for (worker& w : active_) w.clear();
  }
  sensor start(const voxel_grid& grid, const float3& origin, const integration_options& options) {
    assert(options.max_range >= 0.0);
    const sensor from{grid, origin, grid.key(origin), options.max_range};
    if (from.key)
      for (worker& w : active_) w.sweep.start(grid, origin, *from.key);
    return from;
  }
  template <class Policy>
  void add_centers(const Policy& policy, const sensor& from, const scan_masks& ends) {
    for_each_with_worker(policy, ends.bricks().size(), 16, [&](worker& w, std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i != end; ++i) w.add_centers(from, ends.bricks()[i]);
    });
    for (worker& w : active_) w.add_batched(from);
  }
  /// Marks a scan according to the plan of organised_ or dense_; empty on failure.
  template <class Marker, class Policy>
  std::optional<integration_summary> mark_by(Marker& marker, const Policy& policy, const sensor& from,
                                             const point_source& point, const saturated_voxels& saturated) {
    const std::size_t count = point.count;
    const std::size_t workers = active_.size();
    marker.start(from.origin, count, workers);
    const auto range = [&](std::size_t i) {
      const std::size_t share = (count / workers + point_batch::capacity) & ~(point_batch::capacity - 1);
      return std::pair{std::min(count, i * share), std::min(count, (i + 1) * share)};
    };
    for_each_index(policy, workers, 1, [&](std::size_t i) {
      worker& w = workers_[i];
      const auto [begin, end] = range(i);
      w.add_points(from, begin, end, point, [&](std::size_t first, std::size_t n) { marker.add(i, w.rays, first, n); });
      w.sweep.flush(w.masks);
    });
    worker& all = join_workers();
    const se3 pose{so3{}, vec3{static_cast<double>(from.origin[0]), static_cast<double>(from.origin[1]),
                               static_cast<double>(from.origin[2])}};
    const depth_sensor camera{from.grid, pose, from.max_range};
    const auto end_of = [&](std::uint32_t i) { return from.end(point(i)); };
    if (!marker.mark(policy, camera, range, end_of, all.masks, saturated)) return std::nullopt;
    return all.summary;
  }
  template <class Policy>
  integration_summary finish(const Policy& policy) {
    for_each_index(policy, active_.size(), 1, [&](std::size_t i) { workers_[i].sweep.flush(workers_[i].masks); });
    return join_workers().summary;
  }
  /// Merges the results of all workers into the first one.
  worker& join_workers() {
    worker& all = workers_.front();
    for (std::size_t i = 1; i != active_.size(); ++i) {
      all.masks.merge(workers_[i].masks);
      all.summary.used += workers_[i].summary.used;
      all.summary.truncated += workers_[i].summary.truncated;
      all.summary.rejected += workers_[i].summary.rejected;
    }
    return all;
  }
  /// Calls `body(worker, begin, end)` for parts of [0, count), each worker on one thread.
  template <class Policy, class Body>
  void for_each_with_worker(const Policy& policy, std::size_t count, std::size_t grain, Body&& body) {
    std::atomic<std::size_t> next{0};
    for_each_index(policy, active_.size(), 1, [&](std::size_t w) {
      for (std::size_t begin; (begin = next.fetch_add(grain, std::memory_order_relaxed)) < count;)
        body(workers_[w], begin, std::min(count, begin + grain));
    });
  }

  organised_rays organised_;
  dense_rays dense_;
  std::vector<worker> workers_ = std::vector<worker>(1);  ///< never shrinks, so that memory is kept
  std::span<worker> active_;                              ///< workers of the current scan
};
using point_integrator = basic_point_integrator<>;

}  // namespace orbis::octree::detail
