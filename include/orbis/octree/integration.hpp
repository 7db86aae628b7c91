// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// From points to the voxels they say something about.
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/octree/scan.hpp>

namespace orbis::octree {

/// Which rays of a scan are walked.
enum class ray_mode {
  every_ray,   ///< from the sensor to every point (OctoMap's `discretize = false`)
  discretized  ///< from the sensor to the centre of every voxel that holds points (`discretize = true`)
};

struct integration_options {
  /// Metres from the sensor; of a point further away only the ray up to here counts, as free.
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
    prepare(policy.threads(), count);
    if (!is_finite(origin)) return {.used = 0, .truncated = 0, .rejected = count};
    const sensor from{grid, origin, grid.key(origin), options.max_range};
    if (options.mode == ray_mode::every_ray) {
      for_each_with_worker(policy, count, 4096, [&](worker& w, std::size_t i) { w.add(from, point(i)); });
    } else {
      for_each_with_worker(policy, count, 4096, [&](worker& w, std::size_t i) { w.add_end(grid, point(i)); });
      for (std::size_t i = 1; i != workers_.size(); ++i) workers_[0].ends.merge(workers_[i].ends);
      const auto& ends = workers_[0].ends.bricks();
      for_each_with_worker(policy, ends.size(), 16, [&](worker& w, std::size_t i) { w.add_centers(from, ends[i]); });
    }
    return combine();
  }

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    std::size_t bytes = workers_.capacity() * sizeof(worker);
    for (const worker& w : workers_) bytes += w.masks.memory_bytes() + w.ends.memory_bytes();
    return bytes;
  }

 private:
  struct sensor {
    const voxel_grid& grid;
    float3 origin;
    std::optional<voxel_key> key;
    double max_range;
  };

  /// What one thread collects.
  struct worker {
    scan_masks masks;
    scan_masks ends;  ///< mode discretized: the voxels that hold points, as occupied
    integration_summary summary;

    void clear() noexcept {
      masks.clear();
      ends.clear();
      summary = {};
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
        if (from.key) masks.mark_ray(from.grid, from.origin, *from.key, end, *key);
        masks.mark_occupied(*key);
        ++summary.used;
      } else {
        add_truncated(from, ray, distance);
      }
    }
    void add_truncated(const sensor& from, const float3& ray, double distance) {
      const auto scale = static_cast<float>(distance);
      const auto range = static_cast<float>(from.max_range);
      float3 end;
      for (std::size_t i = 0; i != 3; ++i) end[i] = from.origin[i] + ray[i] / scale * range;
      const auto key = from.grid.key(end);
      if (!key || !std::isfinite(scale)) {
        ++summary.rejected;
        return;
      }
      if (from.key) masks.mark_ray(from.grid, from.origin, *from.key, end, *key);
      ++summary.truncated;
    }
    void add_end(const voxel_grid& grid, const float3& end) {
      if (const auto key = grid.key(end))
        ends.mark_occupied(*key);
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
