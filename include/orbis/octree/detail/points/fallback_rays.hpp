// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Rays that only the exact traversal can decide.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/octree/detail/points/dense_window.hpp>
#include <orbis/octree/detail/points/ray_traversal.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Collects rays from one point by their ends. Keeps its memory.
class fallback_rays {
 public:
  void clear() noexcept { ends_.clear(); }
  /// @pre `end` lies in the grid
  void add(const float3& end) { ends_.push_back(end); }
  [[nodiscard]] std::size_t size() const noexcept { return ends_.size(); }
  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return ends_.capacity() * sizeof(float3) + window_.memory_bytes();
  }

  /// Walks the rays, all of which start at `origin` in voxel `from`, and forgets them: many together,
  /// those that are few or long alone.
  void flush(const voxel_grid& grid, const float3& origin, const voxel_key& from, scan_masks& masks) {
    std::uint32_t near = reach;
    bool together = false;
    for (;; near /= 2) {  // all of them, if they fit in a window
      voxel_key low = from, high = from;
      std::size_t count = 0;
      for (const float3& end : ends_) {
        const voxel_key to = *grid.key(end);
        if (!is_within(to, from, near)) continue;
        ++count;
        low = {std::min(low.x, to.x), std::min(low.y, to.y), std::min(low.z, to.z)};
        high = {std::max(high.x, to.x), std::max(high.y, to.y), std::max(high.z, to.z)};
      }
      together = count >= many && window_.fit(grid, from, low, high);
      if (together || count < many || near == 0) break;
    }
    for (const float3& end : ends_) {
      const voxel_key to = *grid.key(end);
      if (together && is_within(to, from, near))
        window_.add(grid, origin, end, to);
      else
        masks.mark_ray(grid, origin, from, end, to);
    }
    if (together) window_.flush(masks);
    ends_.clear();
  }

 private:
  static constexpr std::size_t many = 256;      ///< rays that are worth a window
  static constexpr std::uint32_t reach = 4096;  ///< voxels; a window reaches no further

  [[nodiscard]] static bool is_within(const voxel_key& a, const voxel_key& b, std::uint32_t distance) noexcept {
    const auto near = [&](std::uint32_t c, std::uint32_t d) { return (c < d ? d - c : c - d) <= distance; };
    return near(a.x, b.x) && near(a.y, b.y) && near(a.z, b.z);
  }

  std::vector<float3> ends_;
  dense_window window_;
};

}  // namespace orbis::octree::detail
