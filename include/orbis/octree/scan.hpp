// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Compact storage of the voxels that one scan observes as free and as occupied, and the marker that finds them.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/model.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/point.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/octree/detail/mark/depth/depth_scan.hpp>
#include <orbis/octree/detail/mark/scan_scratch.hpp>
#include <orbis/octree/integration.hpp>
#include <orbis/octree/key.hpp>

namespace orbis::octree {

namespace detail {
struct scan_brick;
class scan_masks;
}  // namespace detail

/// The voxels that one scan observes as free and as occupied: two disjoint sets, as bit masks of octants of 4x4x4
/// voxels, grouped by bricks of 8x8x8. A mask is stored only if it is neither empty nor that of a completely free
/// octant. A depth image of 640x480 pixels takes about 10 kB at 5 cm and 100 kB at 2 cm.
class scan {
 public:
  /// One brick. In the 8-bit masks, bit i is octant i.
  struct part {
    std::uint64_t name = 0;     ///< see detail::node_name
    std::uint32_t first = 0;    ///< index in words() of the brick's first mask; free masks precede occupied ones
    std::uint8_t free = 0;      ///< octants that have a mask of free voxels
    std::uint8_t occupied = 0;  ///< octants that have a mask of occupied voxels
    std::uint8_t full = 0;      ///< octants that are completely free, without masks
    friend bool operator==(const part&, const part&) = default;
  };
  /// Unpacked masks of one brick; word i is octant i.
  struct brick_masks {
    std::array<std::uint64_t, 8> free{};
    std::array<std::uint64_t, 8> occupied{};
  };

  /// Returns the bricks in ascending order of name, without duplicates.
  [[nodiscard]] std::span<const part> parts() const noexcept { return parts_; }
  [[nodiscard]] std::span<const std::uint64_t> words() const noexcept { return words_; }
  [[nodiscard]] bool empty() const noexcept { return parts_.empty(); }
  /// Calls `visit(octant, free, occupied)` for every octant of a brick that the scan observed, in order.
  template <class Visit>
  void for_each_octant(const part& p, Visit&& visit) const {
    const std::uint64_t* free = words_.data() + p.first;
    const std::uint64_t* occupied = free + std::popcount(p.free);
    for (unsigned bits = p.free | p.occupied | p.full; bits != 0; bits &= bits - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(bits));
      const std::uint64_t f = (p.full >> i & 1U) != 0 ? ~std::uint64_t{0} : (p.free >> i & 1U) != 0 ? *free++ : 0;
      visit(i, f, (p.occupied >> i & 1U) != 0 ? *occupied++ : 0);
    }
  }
  [[nodiscard]] brick_masks masks(const part& p) const noexcept {
    brick_masks m;
    for_each_octant(p, [&](unsigned i, std::uint64_t free, std::uint64_t occupied) {
      m.free[i] = free;
      m.occupied[i] = occupied;
    });
    return m;
  }
  /// Returns the numbers of voxels observed as free and as occupied. O(words).
  [[nodiscard]] std::pair<std::size_t, std::size_t> counts() const noexcept {
    std::size_t free = 0, occupied = 0;
    for (const part& p : parts_)
      for_each_octant(p, [&](unsigned, std::uint64_t f, std::uint64_t o) {
        free += static_cast<std::size_t>(std::popcount(f));
        occupied += static_cast<std::size_t>(std::popcount(o));
      });
    return {free, occupied};
  }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return parts_.capacity() * sizeof(part) + words_.capacity() * sizeof(std::uint64_t);
  }
  /// Removes all voxels but keeps the memory.
  void clear() noexcept {
    parts_.clear();
    words_.clear();
  }
  friend bool operator==(const scan&, const scan&) = default;

 private:
  friend class scan_marker;

  /// Adds a brick. @pre names are in ascending order
  void add(const detail::scan_brick& b);

  std::vector<part> parts_;
  std::vector<std::uint64_t> words_;
};

using scan_voxels [[deprecated("use octree::scan")]] = scan;

/// Finds the voxels that `occupancy_octree::integrate` would observe as free and as occupied, without a map; see
/// occupancy_octree::apply and scan_history::set. Reuses its buffers: marking allocates nothing once the buffers have
/// grown. Use one marker per thread.
class scan_marker {
 public:
  /// Marks a depth image (metres along the optical axis). Unlike `integrate`, includes saturated voxels, so that the
  /// scan can be applied to any map. The voxels are the same for every policy. The summary has the same counts as that
  /// of `integrate`. O(pixels + voxels near surfaces + bricks).
  /// @pre depth and camera have the same size
  template <execution_policy Policy, camera::depth_source Depth, camera::camera_model Camera>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, const Depth& depth, const Camera& camera,
                           const se3& T_world_camera, const integration_options& options, scan& voxels) {
    return mark_depth(detail::as_parallel(policy), grid, detail::depth_scan{depth, camera}, T_world_camera, options,
                      voxels);
  }
  /// Marks points in the world frame (metres), seen from `origin`. O(points x voxels per ray).
  template <execution_policy Policy, point_range Points, point_like Origin>
  integration_summary mark(const Policy& policy, const voxel_grid& grid, const Points& points, const Origin& origin,
                           const integration_options& options, scan& voxels) {
    return mark_points(detail::as_parallel(policy), grid, scratch_.view(points), coordinates<float>(origin), options,
                       voxels);
  }
  /// Heap memory in bytes.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return scratch_.memory_bytes() + order_.capacity() * sizeof(order_[0]);
  }

 private:
  template <class Policy>
  integration_summary mark_depth(const Policy& policy, const voxel_grid& grid, const detail::depth_scan& image,
                                 const se3& T_world_camera, const integration_options& options, scan& voxels);
  template <class Policy>
  integration_summary mark_points(const Policy& policy, const voxel_grid& grid, const detail::point_view& points,
                                  const std::array<float, 3>& origin, const integration_options& options, scan& voxels);
  /// Packs the masks of a scan, and counts its voxels.
  void pack(const detail::scan_masks& masks, scan& voxels, integration_summary& summary);

  detail::scan_scratch scratch_;
  std::vector<std::pair<std::uint64_t, std::uint32_t>> order_;
};

}  // namespace orbis::octree

#ifndef ORBIS_COMPILED
#include <orbis/octree/scan-inl.hpp>
#endif
