// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Voxels around the start voxel, for rays that start on one of its faces.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/mark/depth/voxel_ray_test.hpp>
#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>
#include <orbis/octree/detail/mark/rays/scan_origin.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Finds the neighbours of the sensor's voxel through which rays in a range of directions may pass before they leave
/// this neighbourhood; a ray takes at most one step along each axis there.
template <class = void>
class basic_first_step_order {
 public:
  explicit basic_first_step_order(const depth_sensor& sensor) noexcept
      : source_{sensor.grid, sensor.pose.centre, *sensor.key} {}

  /// Returns these neighbours as a bit mask: bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1) is the voxel at offset (dx, dy,
  /// dz). `low` and `high`: smallest and greatest coordinates of the directions; the largest is of the order of 1.
  /// Rays may deviate from the directions by rounding errors of a few float ulps.
  [[nodiscard]] std::uint32_t voxels(float3 low, float3 high) const noexcept {
    for (std::size_t i = 0; i != 3; ++i) {
      low[i] -= 1e-5F;
      high[i] += 1e-5F;
    }
    std::uint32_t all = 0;
    for (unsigned down = 0; down != 8; ++down) {  // bit i: along axis i
      std::array<axis_range, 3> axes;
      bool any = true;
      for (std::size_t i = 0; i != 3; ++i) {
        const bool is_down = (down >> i & 1U) != 0;
        const float most = is_down ? -low[i] : high[i], least = is_down ? -high[i] : low[i];
        any = any && most > 0.0F;
        const double face = is_down ? -source_.face[1][i] : source_.face[0][i];
        axes[i] = {static_cast<double>(std::max(least, 0.0F)), static_cast<double>(most), face, face + source_.edge};
      }
      if (any) all |= voxels(axes, down);
    }
    return all;
  }

 private:
  struct axis_range {
    double least, most;    ///< bounds of the directions' absolute coordinates along the axis
    double first, second;  ///< distances to the first and to the second face, metres
  };

  [[nodiscard]] static std::uint32_t voxels(const std::array<axis_range, 3>& axes, unsigned down) noexcept {
    // Returns true if a face across i, at distance `a`, may come before a face across j, at distance `b`.
    const auto may_precede = [&](std::size_t i, double a, std::size_t j, double b) {
      if (a == 0.0 && b == 0.0) return i > j;  // a tie for every ray; the later axis comes first
      const double room = 1e-9 * (std::fabs(a) * axes[j].most + std::fabs(b) * axes[i].most);
      return a * (a < 0.0 ? axes[j].most : axes[j].least) - b * (b < 0.0 ? axes[i].least : axes[i].most) <= room;
    };
    // Bit j of entry i: the first face across i may come before the first, or the second, face across j.
    std::array<unsigned, 3> before_first{}, before_second{};
    for (std::size_t i = 0; i != 3; ++i)
      for (std::size_t j = 0; j != 3; ++j) {
        const unsigned bit = 1U << j;
        if (i == j || may_precede(i, axes[i].first, j, axes[j].first)) before_first[i] |= bit;
        if (i == j || may_precede(i, axes[i].first, j, axes[j].second)) before_second[i] |= bit;
      }
    constexpr std::array<int, 3> stride{1, 3, 9};
    std::uint32_t all = 0;
    for (unsigned stepped = 1; stepped != 8; ++stepped) {
      int at = 13;
      bool may = true;
      for (std::size_t i = 0; i != 3; ++i) {
        if ((stepped >> i & 1U) == 0) continue;
        at += (down >> i & 1U) != 0 ? -stride[i] : stride[i];
        may = may && (before_first[i] | stepped) == 7U && before_second[i] == 7U;
      }
      if (may) all |= 1U << at;
    }
    return all;
  }

  scan_origin source_;
};
using first_step_order = basic_first_step_order<>;

/// Determines which of the 26 neighbours of the sensor's voxel are crossed by rays.
class first_voxels {
 public:
  explicit first_voxels(const depth_sensor& sensor) noexcept : sensor_{sensor} {}

  /// Adds the voxels that the first steps of a ray reach.
  void add(const ray_endpoint& e) noexcept {
    const voxel_key& from = *sensor_.key;
    if (e.key == from) return;
    auto cursor = ray_traversal::between(sensor_.grid, from, sensor_.pose.centre, e.point);
    if (!cursor) return;
    for (;;) {
      const std::size_t axis = cursor->axis();
      if (!cursor->can_step(axis)) return;
      cursor->advance(axis);
      const voxel_key k = cursor->key();
      const std::uint32_t x = k.x - from.x + 1, y = k.y - from.y + 1, z = k.z - from.z + 1;
      if (x > 2 || y > 2 || z > 2 || k == e.key) return;
      if (std::min(std::min(cursor->next[0], cursor->next[1]), cursor->next[2]) > cursor->reach) return;
      seen_ |= 1U << (x + 3 * y + 9 * z);
    }
  }
  /// Adds the rays of a box of cells of a view. `directions(box)`: range of their directions in the world frame, see
  /// first_step_order; `for_each(box, use)` calls `use` with the ray_endpoint of each ray until `use` returns false.
  template <class Directions, class ForEach>
  void add(const first_step_order& order, const pixel_box& box, const Directions& directions, const ForEach& for_each) {
    const auto [low, high] = directions(box);
    const std::uint32_t may = order.voxels(low, high);
    if ((may & ~seen_) == 0) return;
    const bool is_cell = box.u0 == box.u1 && box.v0 == box.v1;
    bool any = false;
    for_each(box, [&](const ray_endpoint& e) {
      add(e);
      any = true;
      return is_cell;  // one ray usually represents a larger box
    });
    if (is_cell || !any || (may & ~seen_) == 0) return;
    const std::int32_t u = (box.u0 + box.u1) / 2, v = (box.v0 + box.v1) / 2;
    for (const pixel_box& part : {pixel_box{box.u0, u, box.v0, v}, pixel_box{u + 1, box.u1, box.v0, v},
                                  pixel_box{box.u0, u, v + 1, box.v1}, pixel_box{u + 1, box.u1, v + 1, box.v1}})
      if (part.u0 <= part.u1 && part.v0 <= part.v1) add(order, part, directions, for_each);
  }
  void mark(scan_masks& masks) const {
    const voxel_key& from = *sensor_.key;
    for (std::uint32_t left = seen_; left != 0; left &= left - 1) {
      const auto i = static_cast<std::uint32_t>(std::countr_zero(left));
      masks.mark_free({from.x + i % 3 - 1, from.y + i / 3 % 3 - 1, from.z + i / 9 - 1});
    }
  }

 private:
  const depth_sensor& sensor_;
  std::uint32_t seen_ = 0;  ///< mask of 3x3x3 voxels
};

}  // namespace orbis::octree::detail
