// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Descent through the octree to find the voxels that the rays of a view observe as free.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/octree/detail/mark/depth/view_frame.hpp>
#include <orbis/octree/detail/mark/depth/voxel_ray_test.hpp>
#include <orbis/octree/detail/storage/node_name.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

namespace orbis::octree::detail {

/// Results and scratch memory of one thread.
struct descent_worker {
  struct free_brick {
    std::uint64_t name;
    std::array<std::uint64_t, 8> free;
  };
  std::vector<free_brick> bricks;
  std::vector<std::uint32_t> unsure;  ///< rays that may cross the current voxel

  [[nodiscard]] std::size_t memory_bytes() const noexcept {
    return bricks.capacity() * sizeof(bricks[0]) + unsure.capacity() * sizeof(unsure[0]);
  }
};

/// Processes nodes on one thread. `Rays`: see depth_rays. `Saturated`: see depth_integrator::mark.
template <class Rays, class Saturated>
struct depth_descent {
  using words = std::array<std::uint64_t, 8>;

  const view_frame& frame;
  descent_worker& own;
  const depth_sensor& sensor;
  const Rays& rays;
  const scan_masks& hits;  ///< voxels that contain ends of rays
  const Saturated& saturated;
  bool on_face;  ///< true if the camera's centre is close to a face of its voxel

  /// Finds the free voxels of the node at `level` > brick_level whose lowest voxel is `k`.
  void descend(const voxel_key& k, const float3& center, int level, bool inside) const {
    children c;
    frame.classify(frame.scene, offsets(level - 1), center, inside, c);
    for (unsigned bits = c.live; bits != 0; bits &= bits - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(bits));
      const bool full = (c.full >> i & 1U) != 0, inner = (c.inside >> i & 1U) != 0;
      const voxel_key child = child_key(k, i, node_cells(level - 1));
      const float3 at{c.x[i], c.y[i], c.z[i]};
      if (level - 1 == brick_level)
        add_brick(child, at, full, inner);
      else if (full)
        fill(child, level - 1);
      else
        descend(child, at, level - 1, inner);
    }
  }

 private:
  [[nodiscard]] const child_offsets& offsets(int level) const { return frame.offsets[static_cast<std::size_t>(level)]; }
  void fill(const voxel_key& k, int level) const {
    for (unsigned i = 0; i != 8; ++i) {
      const voxel_key child = child_key(k, i, node_cells(level - 1));
      if (level - 1 == brick_level)
        add_brick(child, {}, true, true);
      else
        fill(child, level - 1);
    }
  }
  void add_brick(const voxel_key& k, const float3& center, bool full, bool inside) const {
    const std::uint64_t name = node_name(k, brick_level);
    words skip{};  // voxels whose state is not needed
    saturated(name, skip);
    if (const scan_brick* hit = hits.find(name))
      for (std::size_t i = 0; i != 8; ++i) skip[i] |= hit->occupied[i];
    skip_camera(k, skip);
    bool done = true;
    for (const std::uint64_t w : skip) done = done && w == ~std::uint64_t{0};
    if (done) return;
    words free{};
    if (full) {
      free.fill(~std::uint64_t{0});
    } else {
      refine(k, center, inside, skip, free);
    }
    std::uint64_t any = 0;
    for (std::size_t i = 0; i != 8; ++i) any |= free[i] &= ~skip[i];
    if (any != 0) own.bricks.push_back({name, free});
  }
  /// Skips the camera's own voxel, and its neighbours if the camera is on a face; these voxels are handled separately.
  void skip_camera(const voxel_key& k, words& skip) const {
    const voxel_key& from = *sensor.key;
    const std::uint32_t around = on_face ? 1 : 0;
    const auto touches = [&](std::uint32_t low, std::uint32_t at) {
      return at + around >= low && at <= low + 7 + around;
    };
    if (!touches(k.x, from.x) || !touches(k.y, from.y) || !touches(k.z, from.z)) return;
    for (std::uint32_t i = 0; i != 512; ++i) {
      const voxel_key p = voxel_in_brick(i);
      const auto close = [&](std::uint32_t c, std::uint32_t at) { return c + around - at <= 2 * around; };
      if (close(k.x + p.x, from.x) && close(k.y + p.y, from.y) && close(k.z + p.z, from.z))
        skip[i >> 6U] |= std::uint64_t{1} << (i & 63U);
    }
  }

  /// Finds the free voxels of a brick, except those in `skip`.
  void refine(const voxel_key& k, const float3& center, bool inside, const words& skip, words& free) const {
    const float3 low = sensor.corner(k);
    children octants;
    frame.classify(frame.scene, offsets(octant_level), center, inside, octants);
    for (unsigned bits = octants.live; bits != 0; bits &= bits - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(bits));
      if (skip[i] == ~std::uint64_t{0}) continue;
      if ((octants.full >> i & 1U) != 0)
        free[i] = ~std::uint64_t{0};
      else
        free[i] = refine_octant(k, low, i, octants, skip[i]);
    }
  }
  [[nodiscard]] std::uint64_t refine_octant(const voxel_key& k, const float3& low, unsigned octant,
                                            const children& octants, std::uint64_t skip) const {
    children groups;
    frame.classify(frame.scene, offsets(1), {octants.x[octant], octants.y[octant], octants.z[octant]},
                   (octants.inside >> octant & 1U) != 0, groups);
    std::uint64_t free = 0;
    for (unsigned bits = groups.live; bits != 0; bits &= bits - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(bits));
      const auto known = static_cast<unsigned>(skip >> (8 * i) & 0xffU);
      if (known == 0xff) continue;
      const std::uint64_t found =
          (groups.full >> i & 1U) != 0 ? 0xff : refine_group(k, low, octant << 6U | i << 3U, groups, i, known);
      free |= found << (8 * i);
    }
    return free;
  }
  [[nodiscard]] unsigned refine_group(const voxel_key& k, const float3& low, std::uint32_t place,
                                      const children& groups, unsigned group, unsigned known) const {
    children voxels;
    frame.classify(frame.scene, offsets(0), {groups.x[group], groups.y[group], groups.z[group]},
                   (groups.inside >> group & 1U) != 0, voxels);
    unsigned left = voxels.live & ~voxels.full & ~known;
    if (left == 0) return voxels.full;
    const voxel_key p = voxel_in_brick(place);
    const float edge = frame.scene.voxel;
    const auto middle = [&](std::size_t i, std::uint32_t at) { return low[i] + edge * static_cast<float>(at + 1); };
    const float3 center{middle(0, p.x), middle(1, p.y), middle(2, p.z)};
    unsigned free = voxels.full | rays.sample(offsets(0), center, voxels, left);
    for (left &= ~free; left != 0; left &= left - 1) {
      const auto i = static_cast<unsigned>(std::countr_zero(left));
      const auto& o = offsets(0);
      const float3 at{center[0] + o.world_x[i], center[1] + o.world_y[i], center[2] + o.world_z[i]};
      const voxel_key voxel = child_key({k.x + p.x, k.y + p.y, k.z + p.z}, i, 1);
      if (is_crossed(voxel, at, {voxels.u0[i], voxels.u1[i], voxels.v0[i], voxels.v1[i]}, voxels.near_z[i]))
        free |= 1U << i;
    }
    return free;
  }
  [[nodiscard]] bool is_crossed(const voxel_key& voxel, const float3& at, const pixel_box& box, float near_z) const {
    own.unsure.clear();
    const voxel_test test{frame.scene, at, 0.5F * frame.scene.voxel};
    if (test_box(test, box, near_z)) return true;
    for (const std::uint32_t ray : own.unsure)
      if (rays.visits(ray, voxel)) return true;
    return false;
  }
  [[nodiscard]] bool test_box(const voxel_test& test, const pixel_box& box, float near_z) const {
    if ((box.u1 - box.u0) * (box.v1 - box.v0) < 1024) return rays.test(test, box, near_z, own.unsure);
    // Near the camera, most rays in a voxel's pixel box miss the voxel, so the box is tested tile by tile.
    constexpr std::int32_t size = 128;
    for (std::int32_t v = box.v0 & -size; v <= box.v1; v += size)
      for (std::int32_t u = box.u0 & -size; u <= box.u1; u += size)
        if (test_tile(test, box, near_z, u, v, size)) return true;
    return false;
  }
  [[nodiscard]] bool test_tile(const voxel_test& test, const pixel_box& box, float near_z, std::int32_t u,
                               std::int32_t v, std::int32_t size) const {
    const pixel_box part{std::max(box.u0, u), std::min(box.u1, u + size - 1), std::max(box.v0, v),
                         std::min(box.v1, v + size - 1)};
    if (part.u0 > part.u1 || part.v0 > part.v1 || !frame.pyramid.reaches(u, v, size, near_z)) return false;
    if (!rays.may_cross(test, part, u, v, size)) return false;
    if (size == 16) return rays.test(test, part, near_z, own.unsure);
    const std::int32_t half = size / 2;
    return test_tile(test, box, near_z, u, v, half) || test_tile(test, box, near_z, u + half, v, half) ||
           test_tile(test, box, near_z, u, v + half, half) || test_tile(test, box, near_z, u + half, v + half, half);
  }
};

/// Marks the free voxels below the nodes of a frame in `masks`, with one worker per thread of the policy. See
/// depth_descent.
template <execution_policy Policy, class Rays, class Saturated>
void descend_nodes(const Policy& policy, const view_frame& frame, const depth_sensor& sensor, const Rays& rays,
                   bool on_face, scan_masks& masks, const Saturated& saturated, std::vector<descent_worker>& workers) {
  const std::size_t count = std::clamp<std::size_t>(policy.threads(), 1, std::max<std::size_t>(1, frame.nodes.size()));
  if (workers.size() < count) workers.resize(count);  // never shrinks, so that memory is kept
  std::atomic<std::size_t> next{0};
  for_each_index(policy, count, 1, [&](std::size_t i) {
    workers[i].bricks.clear();
    const depth_descent<Rays, Saturated> descent{frame, workers[i], sensor, rays, masks, saturated, on_face};
    for (std::size_t n; (n = next.fetch_add(1, std::memory_order_relaxed)) < frame.nodes.size();) {
      const view_frame::node& node = frame.nodes[n];
      descent.descend(node.key, node.center, view_frame::list_level, node.inside);
    }
  });
  for (std::size_t i = 0; i != count; ++i)
    for (const auto& b : workers[i].bricks) {
      auto& free = masks.at(named_key(b.name)).free;
      for (std::size_t octant = 0; octant != free.size(); ++octant) free[octant] |= b.free[octant];
    }
  masks.mark_free(*sensor.key);
}

}  // namespace orbis::octree::detail
