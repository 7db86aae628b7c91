// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/rays/limit_rays.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;
using octree::detail::point_batch;
using octree::detail::ray_batch;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();
constexpr float infinite = std::numeric_limits<float>::infinity();

[[nodiscard]] bool has(const ray_batch::bits& bits, std::size_t i) { return (bits[i >> 6U] >> (i & 63U) & 1U) != 0; }

/// The rays to some points, one after the other.
void one_by_one(const ray_frame& f, const point_batch& points, double max_range, std::size_t count, ray_batch& rays) {
  rays.clear();
  for (std::size_t i = 0; i != count; ++i) {
    float3 end{points.x[i], points.y[i], points.z[i]};
    const float3 ray = difference(end, f.origin);
    const double distance = length(ray);
    const bool hit = distance <= max_range;
    if (!hit) {
      if (!std::isfinite(static_cast<float>(distance))) continue;
      end = cut_off(f.origin, ray, distance, max_range);
    }
    if (const auto k = f.grid.key(end))
      rays.set(i, end,
               {static_cast<std::int32_t>(k->x - f.from.x), static_cast<std::int32_t>(k->y - f.from.y),
                static_cast<std::int32_t>(k->z - f.from.z)},
               hit);
  }
}

}  // namespace

TEST_CASE("Every instruction set finds the same ends of rays, bit for bit") {
  random_bits random{211};
  auto points = std::make_unique<point_batch>();
  auto want = std::make_unique<ray_batch>(), got = std::make_unique<ray_batch>();
  std::size_t hits = 0, cuts = 0, none = 0;
  for (int run = 0; run != 300; ++run) {
    const voxel_grid grid{0.1, 8};  // 25.6 m wide
    const std::size_t count = random.below(point_batch::capacity + 1);
    const double max_range = random.below(3) == 0 ? std::numeric_limits<double>::infinity() : random.uniform(0.0, 20.0);
    for (std::size_t i = 0; i != count; ++i) {
      for (auto* axis : {&points->x, &points->y, &points->z}) {
        float& c = (*axis)[i];
        c = static_cast<float>(random.uniform(-13.5, 13.5));
        if (random.below(4) == 0) c = std::round(c * 10.0F) * 0.1F;
        if (random.below(60) == 0) c = random.below(2) == 0 ? not_a_number : infinite;
        if (random.below(60) == 0) c = 1e30F;
      }
    }
    const float3 origin{static_cast<float>(random.uniform(-2.0, 2.0)), 0.05F, run % 3 == 0 ? 0.0F : 0.3F};
    const octree::detail::ray_frame frame{grid, origin, *grid.key(origin)};
    one_by_one(frame, *points, max_range, count, *want);
    for (const simd::level level : simd::available_levels()) {
      const simd::level_limit limit{level};
      limit_rays()(frame, *points, max_range, count, *got);
      REQUIRE(got->hit == want->hit);
      REQUIRE(got->cut == want->cut);
      for (std::size_t i = 0; i != count; ++i) {
        if (!has(want->hit, i) && !has(want->cut, i)) continue;
        for (std::size_t axis = 0; axis != 3; ++axis) {
          REQUIRE(got->end[axis][i] == want->end[axis][i]);
          REQUIRE(got->way[axis][i] == want->way[axis][i]);
        }
      }
    }
    hits += ray_batch::count(want->hit);
    cuts += ray_batch::count(want->cut);
    none += count - ray_batch::count(want->hit) - ray_batch::count(want->cut);
  }
  CHECK(hits > 5000);
  CHECK(cuts > 5000);
  CHECK(none > 1000);
}

TEST_CASE("A ray ends at its point or at its limit") {
  const voxel_grid grid{0.1};
  auto points = std::make_unique<point_batch>();
  points->x = {1.05F, 2.05F, not_a_number};
  points->y = points->z = {};
  const octree::detail::ray_frame frame{grid, {0.05F, 0.0F, 0.0F}, *grid.key(float3{0.05F, 0.0F, 0.0F})};
  auto rays = std::make_unique<ray_batch>();
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    limit_rays()(frame, *points, 1.51, 3, *rays);
    CHECK(rays->hit == ray_batch::bits{1});
    CHECK(rays->cut == ray_batch::bits{2});
    CHECK(rays->way[0][0] == 10);
    CHECK(rays->way[0][1] == 15);
    CHECK(std::abs(rays->end[0][1] - 1.56F) < 1e-6F);
  }
}

TEST_CASE("Hits in the voxel of the ray before are left out, and no others but a few") {
  random_bits random{212};
  auto rays = std::make_unique<ray_batch>();
  std::size_t repeated = 0, kept = 0;
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    for (int run = 0; run != 100; ++run) {
      const std::size_t count = random.below(ray_batch::capacity + 1);
      rays->clear();
      std::array<std::int32_t, 3> cell{};
      for (std::size_t i = 0; i != count; ++i) {
        if (random.below(3) == 0) cell[random.below(3)] += random.below(2) == 0 ? 1 : -1;
        if (random.below(10) != 0) rays->set(i, {}, cell, random.below(10) != 0);
      }
      ray_batch::bits fresh;
      find_fresh_hits()(*rays, count, fresh);
      for (std::size_t i = 0; i != ray_batch::capacity; ++i) {
        if (i >= count || !has(rays->hit, i)) {
          REQUIRE_FALSE(has(fresh, i));
          continue;
        }
        const bool repeats = i != 0 && has(rays->hit, i - 1) && rays->way[0][i] == rays->way[0][i - 1] &&
                             rays->way[1][i] == rays->way[1][i - 1] && rays->way[2][i] == rays->way[2][i - 1];
        if (!repeats) REQUIRE(has(fresh, i));
        repeated += repeats ? 1 : 0;
        kept += repeats && has(fresh, i) ? 1 : 0;
      }
    }
  }
  CHECK(8 * kept < repeated);
}
