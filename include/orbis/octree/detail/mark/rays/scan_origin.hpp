// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Origin of a scan's rays, and the first steps of rays whose origin is on an edge of its voxel.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include <orbis/octree/detail/mark/rays/ray_traversal.hpp>

namespace orbis::octree::detail {

/// Common data of all rays of a scan.
///
/// If the origin is on an edge or a corner of its voxel, rays cross several faces at once, in an order that depends
/// only on the arithmetic of the traversal. These first steps are taken individually (`first_steps`), and all data of a
/// ray are relative to the voxel after these steps.
struct scan_origin {
  float3 origin{};
  std::array<std::int32_t, 3> from{};  ///< voxel of the origin
  double edge = 0.0;                   ///< edge of a voxel, metres
  double per_metre = 0.0;
  // Per axis, in the positive and in the negative direction:
  std::array<std::array<double, 3>, 2> face{};           ///< distance from the origin to the first face, metres
  std::array<std::array<double, 3>, 2> first{};          ///< distance to the first face that is not skipped, in voxels
  std::array<std::array<std::int32_t, 3>, 2> skipped{};  ///< number of skipped steps: 0 or 1
  bool on_edge = false;                                  ///< true if any steps are skipped

  scan_origin() = default;
  scan_origin(const voxel_grid& grid, const float3& at, const voxel_key& key) noexcept
      : origin{at},
        from{static_cast<std::int32_t>(key.x), static_cast<std::int32_t>(key.y), static_cast<std::int32_t>(key.z)},
        edge{grid.resolution()},
        per_metre{1.0 / grid.resolution()} {
    constexpr double near = 1e-4;  // in voxels; rays that cross another face first are traversed step by step
    const std::array<std::uint32_t, 3> k{key.x, key.y, key.z};
    const double half = 0.5 * grid.resolution();
    int on_faces = 0;
    for (std::size_t i = 0; i != 3; ++i) {
      bool on_face = false;
      for (std::size_t down = 0; down != 2; ++down) {
        const double sign = down == 0 ? 1.0 : -1.0;
        face[down][i] =
            grid.center(k[i]) + static_cast<double>(static_cast<float>(sign * half)) - static_cast<double>(origin[i]);
        first[down][i] = sign * face[down][i] * per_metre;
        on_face = on_face || first[down][i] < near;
      }
      on_faces += on_face ? 1 : 0;
    }
    if (on_faces < 2) return;
    for (std::size_t down = 0; down != 2; ++down)
      for (std::size_t i = 0; i != 3; ++i) {
        if (!(first[down][i] < near)) continue;
        skipped[down][i] = 1;
        first[down][i] += 1.0;
        on_edge = true;
      }
  }
};

/// Takes the skipped steps of a ray. Returns a mask; bit (dx + 1) + 3 (dy + 1) + 9 (dz + 1) is set if the ray passes
/// through the voxel at offset (dx, dy, dz) from the origin's voxel, excluding the last voxel. Returns 0 if the ray
/// crosses another face first.
[[nodiscard]] inline std::uint32_t first_steps(const scan_origin& source, const float3& end,
                                               const std::array<std::size_t, 3>& down) noexcept {
  float3 direction = difference(end, source.origin);
  const auto reach = static_cast<float>(length(direction));
  std::array<double, 3> next, delta;
  int left = 0;
  for (std::size_t i = 0; i != 3; ++i) {
    direction[i] /= reach;
    const auto d = static_cast<double>(direction[i]);
    next[i] = d != 0.0 ? source.face[down[i]][i] / d : std::numeric_limits<double>::max();
    delta[i] = d != 0.0 ? source.edge / std::fabs(d) : next[i];
    left += source.skipped[down[i]][i];
  }
  constexpr std::array<int, 3> stride{1, 3, 9};
  std::uint32_t passed = 0;
  std::array<bool, 3> taken{};
  for (int at = 13; left != 0; --left) {
    passed |= 1U << at;
    const std::size_t axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    if (taken[axis] || source.skipped[down[axis]][axis] == 0) return 0;
    taken[axis] = true;
    next[axis] += delta[axis];
    at += down[axis] != 0 ? -stride[axis] : stride[axis];
  }
  return passed | 1U << 31U;
}

}  // namespace orbis::octree::detail
