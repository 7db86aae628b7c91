// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From points to the voxels they say something about.
#pragma once

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/rounded.hpp>
#include <orbis/octree/ray_grid.hpp>
#include <orbis/octree/scan.hpp>

namespace orbis::octree {

/// Which rays of a scan are walked.
enum class ray_mode {
  every_ray,   ///< from the sensor to every point (OctoMap's `discretize = false`)
  discretized  ///< from the sensor to the centre of every voxel that holds points (`discretize = true`)
};

struct integration_options {
  /// Metres from the sensor; of a point further away only the ray up to here counts, as free.
  /// @pre >= 0
  double max_range = std::numeric_limits<double>::infinity();
  ray_mode mode = ray_mode::every_ray;
};

/// What became of a scan. In mode `discretized`, `used` and `truncated` count the voxels that hold
/// points instead of the points, and points that share a voxel count once.
struct integration_summary {
  std::size_t used = 0;       ///< points within range
  std::size_t truncated = 0;  ///< points beyond the range
  std::size_t rejected = 0;   ///< points that are NaN, infinite, or too far outside the grid
  std::size_t free = 0;       ///< voxels observed free
  std::size_t occupied = 0;   ///< voxels observed occupied
};

/// Marks the voxels of one scan. The result depends neither on the order of the points nor on the
/// number of threads. Keeps its memory from scan to scan.
class scan_marker {
 public:
  /// The voxels of the last scan; a voxel both free and occupied counts as occupied.
  [[nodiscard]] const scan_masks& masks() const noexcept { return workers_.front().masks; }

  /// Marks the scan of `count` points, `point(i)` being the i-th, seen from `origin`. The summary's
  /// voxel counts stay zero. Nothing is marked if the origin is not finite; rays are not walked if
  /// it lies outside the grid. O(points x voxels along a ray).
  template <execution_policy Policy, class Point>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, std::size_t count, Point&& point,
                           const float3& origin, const integration_options& options) {
    assert(options.max_range >= 0.0);
    prepare(policy.threads(), count);
    if (!is_finite(origin)) return {.used = 0, .truncated = 0, .rejected = count};
    const sensor from{grid, origin, grid.key(origin), options.max_range};
    choose_windows(from, count, point);
    if (options.mode == ray_mode::every_ray) {
      for_each_with_worker(policy, count, 4096, [&](worker& w, std::size_t i) { w.add(from, point(i)); });
    } else {
      for_each_with_worker(policy, count, 4096, [&](worker& w, std::size_t i) { w.add_end(grid, point(i)); });
      for (std::size_t i = 1; i != workers_.size(); ++i) workers_[0].ends.merge(workers_[i].ends);
      const auto& ends = workers_[0].ends.bricks();
      for (worker& w : workers_) w.last_end = no_key;  // from now on in masks, not in ends
      for_each_with_worker(policy, ends.size(), 16, [&](worker& w, std::size_t i) { w.add_centers(from, ends[i]); });
    }
    for_each_index(policy, workers_.size(), 1, [&](std::size_t i) {
      if (workers_[i].windowed) workers_[i].window.flush(workers_[i].masks);
    });
    return combine();
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = workers_.capacity() * sizeof(worker);
    for (const worker& w : workers_) bytes += w.masks.memory_bytes() + w.ends.memory_bytes() + w.window.memory_bytes();
    return bytes;
  }

 private:
  struct sensor {
    const voxel_grid& grid;
    float3 origin;
    std::optional<voxel_key> key;
    double max_range;
  };

  static constexpr voxel_key no_key{~std::uint32_t{0}, 0, 0};

  /// What one thread collects.
  struct worker {
    scan_masks masks;
    scan_masks ends;  ///< mode discretized: the voxels that hold points, as occupied
    integration_summary summary;
    ray_grid window;
    bool windowed = false;  ///< rays go through the window
    voxel_key last_end = no_key;

    void clear() noexcept {
      last_end = no_key;
      masks.clear();
      ends.clear();
      summary = {};
    }
    void add_ray(const sensor& from, const float3& end, const voxel_key& to) {
      if (!from.key) return;
      if (windowed)
        window.add(from.grid, from.origin, end, to);
      else
        masks.mark_ray(from.grid, from.origin, *from.key, end, to);
    }
    /// Neighbouring pixels mostly end in the same voxel.
    void mark_end(scan_masks& in, const voxel_key& k) {
      if (k == last_end) return;
      last_end = k;
      in.mark_occupied(k);
    }
    void add(const sensor& from, const float3& end) {
      const float3 ray = difference(end, from.origin);
      const double distance = length(ray);
      if (distance <= from.max_range) {
        const auto key = from.grid.key(end);
        if (!key) {
          ++summary.rejected;
          return;
        }
        add_ray(from, end, *key);
        mark_end(masks, *key);
        ++summary.used;
      } else {
        add_truncated(from, ray, distance);
      }
    }
    void add_truncated(const sensor& from, const float3& ray, double distance) {
      const auto scale = static_cast<float>(distance);
      const auto range = static_cast<float>(from.max_range);
      float3 end;
      for (std::size_t i = 0; i != 3; ++i) end[i] = from.origin[i] + rounded_product(ray[i] / scale, range);
      const auto key = from.grid.key(end);
      if (!key || !std::isfinite(scale)) {
        ++summary.rejected;
        return;
      }
      add_ray(from, end, *key);
      ++summary.truncated;
    }
    void add_end(const voxel_grid& grid, const float3& end) {
      if (const auto key = grid.key(end))
        mark_end(ends, *key);
      else
        ++summary.rejected;
    }
    void add_centers(const sensor& from, const scan_brick& b) {
      const voxel_key base = named_key(b.name);
      for_each_place(b.occupied, [&](std::uint32_t place) {
        const voxel_key k = voxel_in_brick(place);
        const vec3 c = from.grid.center(voxel_key{base.x + k.x, base.y + k.y, base.z + k.z});
        add(from, {static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())});
      });
    }
  };

  void prepare(unsigned threads, std::size_t count) {
    // A thread that gets less than this many rays does not pay for the merging of its masks.
    const std::size_t useful = 1 + count / 4096;
    workers_.resize(std::clamp<std::size_t>(threads, 1, useful));
    for (worker& w : workers_) w.clear();
  }
  /// Gives the workers a window around all rays, if one can be had.
  template <class Point>
  void choose_windows(const sensor& from, std::size_t count, Point&& point) {
    bool windowed = from.key.has_value();
    if (windowed) {
      float3 low = from.origin, high = from.origin;
      for (std::size_t i = 0; i != count; ++i) {
        const float3 p = point(i);
        if (!is_finite(p)) continue;
        for (std::size_t axis = 0; axis != 3; ++axis) {
          low[axis] = p[axis] < low[axis] ? p[axis] : low[axis];
          high[axis] = p[axis] > high[axis] ? p[axis] : high[axis];
        }
      }
      voxel_key lowest, highest;
      const auto bound = [&](std::size_t axis, std::uint32_t& lo, std::uint32_t& hi) {
        const double o = static_cast<double>(from.origin[axis]);
        const double reach = from.max_range * 1.000001 + 2.0 * from.grid.resolution();
        const auto l = from.grid.key(std::max(static_cast<double>(low[axis]), o - reach) - from.grid.resolution());
        const auto h = from.grid.key(std::min(static_cast<double>(high[axis]), o + reach) + from.grid.resolution());
        if (!l || !h) return false;
        lo = *l;
        hi = *h;
        return true;
      };
      windowed = bound(0, lowest.x, highest.x) && bound(1, lowest.y, highest.y) && bound(2, lowest.z, highest.z);
      for (worker& w : workers_) windowed = windowed && w.window.fit(from.grid, *from.key, lowest, highest);
    }
    for (worker& w : workers_) w.windowed = windowed;
  }
  /// Calls `body(worker, i)` for i in [0, count), each worker on one thread.
  template <class Policy, class Body>
  void for_each_with_worker(const Policy& policy, std::size_t count, std::size_t grain, Body&& body) {
    std::atomic<std::size_t> next{0};
    for_each_index(policy, workers_.size(), 1, [&](std::size_t w) {
      for (std::size_t begin; (begin = next.fetch_add(grain, std::memory_order_relaxed)) < count;)
        for (std::size_t i = begin; i != std::min(count, begin + grain); ++i) body(workers_[w], i);
    });
  }
  integration_summary combine() {
    worker& all = workers_.front();
    for (std::size_t i = 1; i != workers_.size(); ++i) {
      all.masks.merge(workers_[i].masks);
      all.summary.used += workers_[i].summary.used;
      all.summary.truncated += workers_[i].summary.truncated;
      all.summary.rejected += workers_[i].summary.rejected;
    }
    return all.summary;
  }

  std::vector<worker> workers_ = std::vector<worker>(1);
};

}  // namespace orbis::octree
