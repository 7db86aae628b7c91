// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/organised/organised_rays.hpp>
#include <orbis/octree/detail/mark/point_integrator.hpp>

#include "octree/detail/mark/scan_walk.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;
using octree::detail::organised_rays;
using test::free_voxels;
using test::mark;
using test::random_origin;
using test::scan;
using test::walk;

namespace {

/// What a depth camera sees, with edges, holes and a few points that do not belong there.
[[nodiscard]] scan camera_scan(random_bits& random, double voxel, const vec3& origin) {
  const auto at = [&](double half) { return random.uniform(-half, half); };
  scan s{voxel_grid{voxel},
         {static_cast<float>(origin.x()), static_cast<float>(origin.y()), static_cast<float>(origin.z())}};
  const so3 turned = random.below(4) == 0 ? so3{} : so3::exp({at(2.0), at(2.0), at(2.0)});
  const double reach = voxel * random.uniform(3.0, 40.0), fx = random.uniform(60.0, 400.0),
               fy = fx * random.uniform(0.8, 1.2);
  const int width = 90 + static_cast<int>(random.below(40)), height = 60 + static_cast<int>(random.below(40));
  const double cx = width * random.uniform(0.3, 0.7), cy = height * random.uniform(0.3, 0.7);
  const bool by_columns = random.below(3) == 0, has_edges = random.below(2) == 0;
  const int outer = by_columns ? width : height, inner = by_columns ? height : width;
  const int hole = static_cast<int>(random.below(static_cast<std::uint32_t>(outer)));
  for (int i = 0; i != outer; ++i)
    for (int k = 0; k != inner; ++k) {
      if (i >= hole && i < hole + 9 && k > inner / 2) continue;
      const int u = by_columns ? i : k, v = by_columns ? k : i;
      const vec3 d{(u - cx) / fx, (v - cy) / fy, 1.0};
      double z = reach * (0.7 + 0.3 * std::sin(0.1 * u) * std::cos(0.07 * v));
      if (has_edges) z *= u / 11 % 3 == 0 ? 0.2 : 1.0;
      const vec3 p = origin + turned * vec3(d * z);
      s.points.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
      if (random.below(600) == 0) s.points.back() = s.origin;
      if (random.below(600) == 0) s.points.back()[random.below(3)] = std::numeric_limits<float>::quiet_NaN();
      if (random.below(600) == 0) s.points.back()[random.below(3)] += static_cast<float>(voxel);
      if (random.below(600) == 0) s.points.push_back(s.points.front());
    }
  if (random.below(3) == 0) s.limit = reach * random.uniform(0.1, 0.9);
  return s;
}

[[nodiscard]] bool plan(organised_rays& rays, const scan& s) {
  return rays.plan(
      s.grid, s.origin, s.points.size(), [&](std::size_t i) { return s.points[i]; }, s.limit);
}

/// One whose camera is found.
[[nodiscard]] scan fitting_scan(random_bits& random, organised_rays& rays, double voxel) {
  for (;;) {
    scan s = camera_scan(random, voxel, random_origin(random, voxel));
    if (plan(rays, s)) return s;
  }
}

}  // namespace

TEST_CASE("The rays of an organised cloud mark the voxels that they cross one by one") {
  random_bits random{81};
  organised_rays rays;
  scan_masks want, got;
  for (int run = 0; run != 150; ++run) {
    const double voxel = std::array{0.05, 0.1, 0.02, 1.0 / 3.0}[random.below(4)];
    const scan s = fitting_scan(random, rays, voxel);
    walk(s, want);
    INFO("run " << run);
    REQUIRE(mark(seq, rays, s, got));
    REQUIRE(free_voxels(got, nullptr) == free_voxels(want, nullptr));
    REQUIRE(mark(par.with(3), rays, s, got));
    REQUIRE(free_voxels(got, nullptr) == free_voxels(want, nullptr));
  }
}

TEST_CASE("Rays that are as far off their pixels as they may be mark the voxels that they cross") {
  random_bits random{89};
  pinhole_fit fit;
  organised_rays rays;
  scan_masks want, got;
  constexpr int width = 160, height = 120;
  int fitting = 0;
  for (int run = 0; fitting != 10; ++run) {
    REQUIRE(run < 200);
    const auto at = [&](double half) { return random.uniform(-half, half); };
    const auto sign = [&] { return random.below(2) == 0 ? 1.0 : -1.0; };
    scan s{voxel_grid{1.0}, {static_cast<float>(at(0.5)), static_cast<float>(at(0.5)), static_cast<float>(at(0.5))}};
    const vec3 origin{static_cast<double>(s.origin[0]), static_cast<double>(s.origin[1]),
                      static_cast<double>(s.origin[2])};
    // Long rays, few of them long: there are voxels that a single ray decides about.
    const double f = random.uniform(800.0, 3000.0), reach = std::min(1500.0, 0.42 * f);
    const double off = random.uniform(1.2e-6, 2.0e-6), far = random.uniform(0.005, 0.1);
    const so3 turned = so3::exp({at(2.0), at(2.0), at(2.0)});
    std::vector<vec3> pixels;
    for (int v = 0; v != height; ++v)
      for (int u = 0; u != width; ++u) {
        const double z = reach * (random.uniform() < far ? random.uniform(0.5, 1.0) : 0.06);
        pixels.push_back(turned * vec3(z * vec3{(u - 0.5 * width) / f, (v - 0.5 * height) / f, 1.0}));
        const vec3 p = origin + pixels.back() + turned * vec3(z * vec3{at(off), at(off), 0.0});
        s.points.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
      }
    // What the camera is found from stays; all other points go to one side, as far as they may.
    std::vector<bool> kept(s.points.size());
    const auto point = [&](std::size_t i) {
      kept[i] = true;
      return s.points[i];
    };
    INFO("run " << run);
    if (!fit.fit(s.origin, s.points.size(), point, s.limit)) continue;
    ++fitting;
    const auto& k = fit.camera().k();
    const double e = random.uniform(0.75, 0.97) * fit.error(), right = sign() * e, down = sign() * e;
    for (std::size_t i = 0; i != pixels.size(); ++i) {
      if (kept[i]) continue;
      const vec3 c = fit.rotation().inverse() * pixels[i];
      const double u = std::round(k.fx * c.x() / c.z() + k.cx), v = std::round(k.fy * c.y() / c.z() + k.cy);
      const vec3 p =
          origin + fit.rotation() * vec3(c.z() * vec3{(u - k.cx) / k.fx + right, (v - k.cy) / k.fy + down, 1.0});
      s.points[i] = {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
    }
    REQUIRE(plan(rays, s));
    walk(s, want);
    REQUIRE(mark(seq, rays, s, got));
    const bool same = free_voxels(got, nullptr) == free_voxels(want, nullptr);
    REQUIRE(same);
  }
}

TEST_CASE("Every instruction set marks the voxels of an organised cloud") {
  random_bits random{82};
  organised_rays any;
  for (int run = 0; run != 8; ++run) test::require_of_every_level<organised_rays>(fitting_scan(random, any, 0.05));
}

TEST_CASE("Nearly all organised clouds are found to be") {
  random_bits random{83};
  organised_rays rays;
  int found = 0;
  for (int run = 0; run != 100; ++run) found += plan(rays, camera_scan(random, 0.1, {1.0, 0.5, -0.5})) ? 1 : 0;
  CHECK(found >= 85);
}

TEST_CASE("An image is taken as one only if it has points all over") {
  organised_rays rays;
  scan s{voxel_grid{0.01}, {0.0F, 0.0F, 0.0F}};
  const auto take = [&](auto&& wanted) {
    random_bits random{90};
    s.points.clear();
    for (int v = 0; v != 240; ++v)
      for (int u = 0; u != 320; ++u) {
        const float z = 1.0F + 0.001F * static_cast<float>(u % 7);
        const float x = (static_cast<float>(u) - 160.0F) / 262.0F, y = (static_cast<float>(v) - 120.0F) / 262.0F;
        if (wanted(random, u, v)) s.points.push_back({x * z, y * z, z});
      }
  };
  const auto all = [](random_bits&, int, int) { return true; };
  take(all);
  CHECK(plan(rays, s));
  take([](random_bits&, int u, int v) { return u > 120 || v > 100; });  // a hole
  CHECK(plan(rays, s));
  take([](random_bits& random, int, int) { return random.below(10) == 0; });
  CHECK_FALSE(plan(rays, s));
  take([](random_bits& random, int, int) { return random.below(4) == 0; });
  CHECK_FALSE(plan(rays, s));
  take([](random_bits&, int, int v) { return v % 8 == 0; });
  CHECK_FALSE(plan(rays, s));
  take([](random_bits&, int u, int) { return u % 4 == 0; });
  CHECK_FALSE(plan(rays, s));
  take([](random_bits&, int u, int v) { return u < 32 || v % 32 == 0; });
  CHECK_FALSE(plan(rays, s));
  take(all);
  const std::vector<float3> once = s.points;
  s.points.insert(s.points.end(), once.begin(), once.end());
  CHECK_FALSE(plan(rays, s));
}

TEST_CASE("A point far behind the others is walked") {
  random_bits random{91};
  organised_rays rays;
  scan_masks want, got;
  scan s = fitting_scan(random, rays, 0.1);
  s.limit = std::numeric_limits<double>::infinity();
  for (const std::size_t i : {1000U, 2000U})
    for (std::size_t axis = 0; axis != 3; ++axis)
      s.points[i][axis] = s.origin[axis] + 60.0F * (s.points[i][axis] - s.origin[axis]);
  walk(s, want);
  REQUIRE(mark(seq, rays, s, got));
  CHECK(free_voxels(got, nullptr) == free_voxels(want, nullptr));
}

TEST_CASE("Points for the same pixels: few are walked, many are left to others") {
  random_bits random{84};
  organised_rays rays;
  scan_masks want, got;
  scan s = fitting_scan(random, rays, 0.05);
  const std::size_t count = s.points.size();
  for (std::size_t i = 0; i < count; i += 100) {  // nearer and further on the same rays
    float3 p = s.points[i];
    for (std::size_t axis = 0; axis != 3; ++axis) p[axis] = s.origin[axis] + 2.0F * (p[axis] - s.origin[axis]);
    s.points.push_back(p);
  }
  walk(s, want);
  REQUIRE(mark(seq, rays, s, got));
  CHECK(free_voxels(got, nullptr) == free_voxels(want, nullptr));
  REQUIRE(mark(par.with(3), rays, s, got));
  CHECK(free_voxels(got, nullptr) == free_voxels(want, nullptr));

  s.points.insert(s.points.begin() + static_cast<std::ptrdiff_t>(count), s.points.begin(),
                  s.points.begin() + static_cast<std::ptrdiff_t>(count / 20));
  REQUIRE(plan(rays, s));
  CHECK_FALSE(mark(seq, rays, s, got));
  walk(s, want);
  point_integrator marker;
  marker.mark(seq, s.grid, point_reader{}.view(s.points), s.origin, {.max_range = s.limit});
  CHECK(free_voxels(marker.masks(), nullptr) == free_voxels(want, nullptr));
}

TEST_CASE("Saturated voxels of an organised cloud may be left out and no others are") {
  random_bits random{85};
  organised_rays rays;
  for (int run = 0; run != 10; ++run) test::require_but_saturated(rays, fitting_scan(random, rays, 0.05), random);
}

TEST_CASE("Close to the border of the grid an organised cloud is left to others") {
  random_bits random{86};
  organised_rays rays;
  scan_masks masks;
  scan s = fitting_scan(random, rays, 0.1);
  s.limit = std::numeric_limits<double>::infinity();
  float most = 0.0F;
  for (const float3& p : s.points)
    for (std::size_t i = 0; i != 3; ++i)
      if (std::isfinite(p[i])) most = std::max(most, std::fabs(p[i]));
  int depth = 5;
  while (0.05 * std::ldexp(1.0, depth) < static_cast<double>(most)) ++depth;
  s.grid = voxel_grid{2.0 * static_cast<double>(most) / std::ldexp(1.0, depth) * 1.001, depth};
  CHECK_FALSE(mark(seq, rays, s, masks));
}

TEST_CASE("The next organised cloud takes no memory") {
  random_bits random{88};
  organised_rays any;
  scan s = fitting_scan(random, any, 0.05);
  const scan_masks masks;
  point_integrator marker;
  const auto integrate = [&] { return marker.mark(seq, s.grid, point_reader{}.view(s.points), s.origin, {}); };
  integrate();
  s.origin[0] += 1e-7F;  // the camera that is found is another one
  integrate();
  for (float3& p : s.points) p[0] += 1e-7F;
  const std::size_t before = test::allocations(), bytes = marker.memory_bytes();
  integrate();
  if (test::counts_allocations()) CHECK(test::allocations() == before);
  CHECK(marker.memory_bytes() == bytes);
}
