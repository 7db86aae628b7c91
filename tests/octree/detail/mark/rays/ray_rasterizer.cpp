// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/rays/ray_rasterizer.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

struct ray {
  float3 end;
  bool hit;
};

[[nodiscard]] float3 random_point(random_bits& random, double half) {
  const auto at = [&] { return static_cast<float>(random.uniform(-half, half)); };
  return {at(), at(), at()};
}

/// The voxels that are free and not occupied.
[[nodiscard]] std::size_t differences(const scan_masks& a, scan_masks& b) {
  std::size_t different = 0;
  for (const scan_brick& s : a.bricks()) {
    const scan_brick& t = b.at(named_key(s.name));
    for (std::size_t i = 0; i != 8; ++i)
      different += static_cast<std::size_t>(std::popcount((s.free[i] & ~s.occupied[i]) ^ (t.free[i] & ~t.occupied[i])));
  }
  return different;
}

/// Rays swept must cross what rays walked one by one cross, whatever the instructions.
void check(const voxel_grid& grid, const float3& origin, const std::vector<ray>& rays, ray_rasterizer& sweep) {
  const auto from = grid.key(origin);
  REQUIRE(from);
  scan_masks walked;
  for (const ray& r : rays) {
    const auto to = grid.key(r.end);
    REQUIRE(to);
    mark_ray(walked, grid, origin, *from, r.end, *to);
    if (r.hit) walked.mark_occupied(*to);
  }
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    scan_masks swept;
    sweep.start(grid, origin, *from);
    octree::detail::ray_batch batch;
    std::size_t waiting = 0;
    for (const ray& r : rays) {
      const voxel_key to = *grid.key(r.end);
      const auto way = [](std::uint32_t a, std::uint32_t b) { return static_cast<std::int32_t>(b - a); };
      batch.set(waiting, r.end, {way(from->x, to.x), way(from->y, to.y), way(from->z, to.z)}, r.hit);
      if (r.hit) swept.mark_occupied(to);
      if (++waiting != octree::detail::ray_batch::capacity && &r != &rays.back()) continue;
      sweep.add(batch, waiting, swept);
      batch.clear();
      waiting = 0;
    }
    sweep.flush(swept);
    INFO(grid.resolution() << " m, level " << static_cast<int>(level));
    REQUIRE(differences(walked, swept) == 0);
    REQUIRE(differences(swept, walked) == 0);
  }
}

}  // namespace

TEST_CASE("Rays that are swept cross the voxels that rays walked one by one cross") {
  random_bits random{171};
  ray_rasterizer sweep;
  for (const double resolution : {0.01, 0.05, 0.3})
    for (const double half : {0.2, 1.0, 4.0})
      for (int run = 0; run != 4; ++run) {
        const float3 origin = random_point(random, 1.0);
        std::vector<ray> rays(run == 0 ? 1 : 301 + random.below(16));
        for (ray& r : rays) r = {random_point(random, half), random.below(4) != 0};
        check(voxel_grid{resolution}, origin, rays, sweep);
      }
}

TEST_CASE("Rays that are swept through corners and edges and along faces cross what walked ones cross") {
  random_bits random{172};
  ray_rasterizer sweep;
  for (const double resolution : {0.02, 0.05, 0.125}) {
    const auto on_grid = [&](double step) {
      auto c = static_cast<float>((static_cast<int>(random.below(81)) - 40) * step);
      if (random.below(4) == 0) c = std::nextafter(c, random.below(2) == 0 ? 9.0F : -9.0F);
      return c;
    };
    for (int run = 0; run != 40; ++run) {
      const double step = run % 2 == 0 ? resolution : 0.5 * resolution;
      float3 origin{on_grid(step), on_grid(step), on_grid(step)};
      if (run % 5 == 0) origin = {};
      std::vector<ray> rays(200);
      for (ray& r : rays) {
        r = {{on_grid(step), on_grid(step), on_grid(step)}, random.below(2) == 0};
        for (std::size_t axis = 0; axis != 3; ++axis)
          if (random.below(3) == 0) r.end[axis] = origin[axis];  // parallel to a face, to an axis, or no length
      }
      check(voxel_grid{resolution}, origin, rays, sweep);
    }
  }
}

TEST_CASE("Rays from a corner, an edge or a face of a voxel, or close to one, cross what walked ones cross") {
  random_bits random{177};
  ray_rasterizer sweep;
  for (const double resolution : {0.02, 0.05, 0.1})
    for (int run = 0; run != 24; ++run) {
      float3 origin = random_point(random, 0.5);
      for (std::size_t axis = 0; axis != 3; ++axis) {
        if (run % 8 != 0 && (run >> axis & 1) == 0) continue;
        origin[axis] = static_cast<float>(std::round(origin[axis] / resolution) * resolution);
        if (run % 3 == 1) origin[axis] = std::nextafter(origin[axis], run % 2 == 0 ? 9.0F : -9.0F);
        if (run % 8 == 0) origin[axis] = run % 16 == 0 ? 0.0F : static_cast<float>(1e-5 * resolution);
      }
      std::vector<ray> rays(700);
      for (ray& r : rays) r = {random_point(random, 1.0), random.below(3) != 0};
      for (std::size_t i = 0; i < rays.size(); i += 20) rays[i].end[i % 3] = origin[i % 3];
      for (std::size_t i = 1; i < rays.size(); i += 20)  // a voxel or two away
        for (std::size_t axis = 0; axis != 3; ++axis)
          rays[i].end[axis] = origin[axis] + static_cast<float>(resolution) * rays[i].end[axis];
      check(voxel_grid{resolution}, origin, rays, sweep);
    }
}

TEST_CASE("A few rays that go far do not change what the others cross") {
  random_bits random{173};
  ray_rasterizer sweep;
  std::vector<ray> rays(300);
  for (ray& r : rays) r = {random_point(random, 1.5), true};
  for (const double far : {15.0, 60.0, 300.0, 1200.0})
    for (int i = 0; i != 4; ++i) rays.push_back({random_point(random, far), i % 2 == 0});
  check(voxel_grid{0.05}, {0.31F, 0.12F, -0.23F}, rays, sweep);
}

TEST_CASE("More rays than are swept at once cross what walked ones cross") {
  random_bits random{174};
  ray_rasterizer sweep;
  std::vector<ray> rays(70000);
  for (ray& r : rays) r = {random_point(random, 0.7), true};
  check(voxel_grid{0.05}, {0.01F, 0.02F, -1.03F}, rays, sweep);
}

TEST_CASE("Rays in a corner of the grid stay inside") {
  random_bits random{175};
  ray_rasterizer sweep;
  const voxel_grid grid{0.05, 8};  // 12.8 m wide
  std::vector<ray> rays(500);
  for (ray& r : rays)
    for (std::size_t axis = 0; axis != 3; ++axis) r.end[axis] = static_cast<float>(random.uniform(5.0, 6.399));
  for (std::size_t i = 0; i < rays.size(); i += 3) rays[i].end[i % 3] = 6.39F;
  for (ray& r : rays) r.hit = random.below(2) == 0;
  check(grid, {6.33F, 6.37F, 6.01F}, rays, sweep);
  for (ray& r : rays)
    for (float& c : r.end) c = -c;
  check(grid, {-6.33F, -6.37F, -6.01F}, rays, sweep);
}

TEST_CASE("A second scan like the first takes no more memory") {
  random_bits random{176};
  ray_rasterizer sweep;
  std::vector<ray> rays(3000);
  for (ray& r : rays) r = {random_point(random, 2.0), true};
  check(voxel_grid{0.05}, {}, rays, sweep);
  const std::size_t bytes = sweep.memory_bytes();
  CHECK(bytes < (std::size_t{16} << 20U));
  check(voxel_grid{0.05}, {}, rays, sweep);
  CHECK(sweep.memory_bytes() == bytes);
}
