// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Scans whose rays are marked together, and one by one.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_rows.hpp>
#include <orbis/octree/detail/mark/rays/limit_rays.hpp>
#include <orbis/octree/detail/mark/rays/point_keys.hpp>
#include <orbis/octree/detail/storage/scan_masks.hpp>

#include "support/catch.hpp"

namespace orbis::test {

using namespace octree;
using namespace octree::detail;

/// The free voxels of some bricks, by name.
using voxels = std::map<std::uint64_t, std::array<std::uint64_t, 8>>;

/// Without `hidden`, if any.
[[nodiscard]] inline voxels free_voxels(const scan_masks& masks, const scan_masks* hidden) {
  voxels all;
  for (const scan_brick& b : masks.bricks()) {
    auto free = b.free;
    std::uint64_t any = 0;
    const scan_brick* const hide = hidden != nullptr ? hidden->find(b.name) : nullptr;
    for (std::size_t i = 0; i != 8; ++i) {
      free[i] &= ~b.occupied[i];
      if (hide != nullptr) free[i] &= ~hide->free[i];
      any |= free[i];
    }
    if (any != 0) all[b.name] = free;
  }
  return all;
}

struct scan {
  voxel_grid grid;
  float3 origin;
  std::vector<float3> points{};
  double limit = std::numeric_limits<double>::infinity();

  [[nodiscard]] ray_endpoint end_of(std::size_t i) const {
    const float3 ray = difference(points[i], origin);
    ray_endpoint e;
    e.point = length(ray) <= limit ? points[i] : cut_off(origin, ray, length(ray), limit);
    if (const auto k = grid.key(e.point)) e.key = *k;
    return e;
  }
};

/// Marks a scan with dense_rays or organised_rays, however many or few its rays are for the voxels; false if it cannot
/// be done.
template <class Policy, class Rays>
[[nodiscard]] bool mark(const Policy& policy, Rays& rays, const scan& s, scan_masks& masks,
                        const scan_masks* hidden = nullptr) {
  const std::size_t count = s.points.size();
  const point_view point{s.points.data()->data(), count};
  // Whether it is the fastest way does not matter here.
  [[maybe_unused]] const bool pays = rays.plan(s.grid, s.origin, count, point, s.limit);
  const std::size_t workers = policy.threads(), share = (count / workers + 256) & ~std::size_t{255};
  const auto range = [&](std::size_t w) {
    return std::pair{std::min(count, w * share), std::min(count, (w + 1) * share)};
  };
  const voxel_key from = *s.grid.key(s.origin);
  const auto points = std::make_unique<point_batch>();
  const auto batch = std::make_unique<ray_batch>();
  masks.clear();
  rays.start(s.origin, count, workers);
  for (std::size_t w = 0; w != workers; ++w) {
    const auto [begin, end] = range(w);
    for (std::size_t i = begin; i < end; i += point_batch::capacity) {
      const std::size_t n = std::min(end - i, point_batch::capacity);
      load_points(point, i, n, *points);
      limit_rays()({s.grid, s.origin, from}, *points, s.limit, n, *batch);
      for (std::size_t k = 0; k != n; ++k)
        if ((batch->hit[k >> 6U] >> (k & 63U) & 1U) != 0) masks.mark_occupied(s.end_of(i + k).key);
      rays.add(w, *batch, i, n);
      for (std::size_t k = 0; k != n; ++k)
        if (((batch->hit[k >> 6U] | batch->cut[k >> 6U]) >> (k & 63U) & 1U) != 0)
          mark_ray(masks, s.grid, s.origin, from, s.end_of(i + k).point, s.end_of(i + k).key);
    }
  }
  const vec3 centre{static_cast<double>(s.origin[0]), static_cast<double>(s.origin[1]),
                    static_cast<double>(s.origin[2])};
  const auto saturated = [&](std::uint64_t name, std::array<std::uint64_t, 8>& mask) {
    const scan_brick* const hide = hidden != nullptr ? hidden->find(name) : nullptr;
    if (hide != nullptr)
      for (std::size_t i = 0; i != 8; ++i) mask[i] |= hide->free[i];
  };
  const auto end_of = [&](std::uint32_t i) { return s.end_of(i); };
  return rays.mark(policy, depth_sensor{s.grid, se3{so3{}, centre}, s.limit}, range, end_of, masks, saturated);
}

/// Ray by ray.
inline void walk(const scan& s, scan_masks& masks) {
  masks.clear();
  const voxel_key from = *s.grid.key(s.origin);
  for (std::size_t i = 0; i != s.points.size(); ++i) {
    const double distance = length(difference(s.points[i], s.origin));
    const ray_endpoint e = s.end_of(i);
    if (!std::isfinite(static_cast<float>(distance)) || !s.grid.key(e.point)) continue;
    mark_ray(masks, s.grid, s.origin, from, e.point, e.key);
    if (distance <= s.limit) masks.mark_occupied(e.key);
  }
}

/// Where rays begin: anywhere, or on corners, faces and in the middle of voxels.
[[nodiscard]] inline vec3 random_origin(random_bits& random, double voxel) {
  vec3 origin{random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)};
  switch (random.below(5)) {
    case 0: origin.setZero(); break;
    case 1: origin[static_cast<int>(random.below(3))] = voxel * random.below(9); break;
    case 2: origin = voxel * vec3{1.0, 2.0, 3.0}; break;
    case 3: origin = vec3::Constant(0.5 * voxel); break;
    default: break;
  }
  return origin;
}

/// Requires of every instruction set the voxels of the walk.
template <class Rays>
void require_of_every_level(const scan& s) {
  scan_masks want, got;
  walk(s, want);
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    Rays rays;
    REQUIRE(mark(seq, rays, s, got));
    REQUIRE(free_voxels(got, nullptr) == free_voxels(want, nullptr));
  }
}

/// Requires that of some saturated voxels any may be left out, of the others none, and that no others are marked.
template <class Rays>
void require_but_saturated(Rays& rays, const scan& s, random_bits& random) {
  scan_masks want, got, hidden;
  walk(s, want);
  for (const scan_brick& b : want.bricks())
    for (std::size_t i = 0; i != 8; ++i)
      if (random.below(2) == 0) hidden.at(named_key(b.name)).free[i] = b.free[i];
  REQUIRE(mark(seq, rays, s, got, &hidden));
  REQUIRE(free_voxels(got, &hidden) == free_voxels(want, &hidden));
  for (const auto& [name, free] : free_voxels(got, nullptr)) {
    const scan_brick* const b = want.find(name);
    REQUIRE(b != nullptr);
    for (std::size_t i = 0; i != 8; ++i) REQUIRE((free[i] & ~b->free[i]) == 0);
  }
}

}  // namespace orbis::test
