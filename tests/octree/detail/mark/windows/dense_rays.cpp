// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/point_integrator.hpp>
#include <orbis/octree/detail/mark/windows/dense_rays.hpp>

#include "octree/detail/mark/scan_walk.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;
using octree::detail::dense_rays;
using test::free_voxels;
using test::mark;
using test::random_origin;
using test::scan;
using test::walk;

namespace {

/// A scan of one of several kinds.
[[nodiscard]] scan random_scan(random_bits& random, std::uint64_t kind, double voxel, const vec3& origin) {
  const auto at = [&](double half) { return random.uniform(-half, half); };
  scan s{voxel_grid{voxel},
         {static_cast<float>(origin.x()), static_cast<float>(origin.y()), static_cast<float>(origin.z())}};
  const so3 turned = random.below(4) == 0 ? so3{} : so3::exp({at(2.0), at(2.0), at(2.0)});
  const double reach = voxel * random.uniform(3.0, 40.0), fov = random.uniform(0.05, 1.0);
  constexpr int width = 90, height = 60;
  for (int i = 0; i != width * height; ++i) {
    vec3 d{(i % width - 0.5 * width) / width * 2.0 * fov, (i / width - 0.5 * height) / width * 2.0 * fov, 1.0};
    double distance = reach;
    switch (kind) {
      case 0: distance *= 0.7 + 0.3 * std::sin(9.0 * d.x()) * std::cos(7.0 * d.y()); break;  // a camera
      case 1: distance *= i % 11 == 0 ? 0.2 : 0.9; break;                                    // with edges
      case 2: d = {at(1.0), at(1.0), at(1.0)}; break;                                        // all around
      case 3: d = {std::cos(0.01 * i), std::sin(0.01 * i), 0.0}; break;                      // a fan
      case 4: d = {1e-5 * at(1.0), 1e-5 * at(1.0), 1.0}; break;                              // a beam
      case 5:
        d = {0.3, 0.2, 1.0};
        distance *= random.uniform(0.0, 1.0);
        break;  // one direction
      case 6: d = {random.below(5) - 2.0, random.below(5) - 2.0, random.below(5) - 2.0}; break;
      case 7: d = {0.1, 0.2, 1.0}; break;  // one point
      default:
        if (i % 2 == 0)
          d = {at(0.02), at(0.02), 1.0};
        else
          d = {at(1.0), at(1.0), at(1.0)};
    }
    if (kind != 6) d = turned * d;
    if (d.norm() > 0.0) d *= distance / d.norm();
    const vec3 p = origin + d;
    s.points.push_back({static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())});
    if (kind == 7) continue;
    if (random.below(500) == 0) s.points.back() = s.origin;
    if (random.below(500) == 0) s.points.back()[i % 3U] = std::numeric_limits<float>::quiet_NaN();
    if (random.below(500) == 0) s.points.back()[i % 3U] = -1e30F;
  }
  if (random.below(3) == 0) s.limit = reach * random.uniform(0.1, 0.9);
  return s;
}

}  // namespace

TEST_CASE("Rays of any kind from any place mark the voxels that they cross one by one") {
  random_bits random{71};
  dense_rays rays;
  scan_masks want, got;
  for (int run = 0; run != 135; ++run) {
    const auto kind = static_cast<std::uint64_t>(run % 9);
    const double voxel = std::array{0.05, 0.1, 0.02, 1.0 / 3.0}[random.below(4)];
    const double far = random.below(6) == 0 ? 300.0 : 1.0;
    const scan s = random_scan(random, kind, voxel, far * random_origin(random, voxel));
    walk(s, want);
    INFO("kind " << kind << ", run " << run);
    REQUIRE(mark(seq, rays, s, got));
    REQUIRE(free_voxels(got, nullptr) == free_voxels(want, nullptr));
    REQUIRE(mark(par.with(3), rays, s, got));
    REQUIRE(free_voxels(got, nullptr) == free_voxels(want, nullptr));
  }
}

TEST_CASE("Every instruction set marks the same voxels") {
  random_bits random{72};
  for (std::uint64_t kind = 0; kind != 9; ++kind)
    test::require_of_every_level<dense_rays>(random_scan(random, kind, 0.05, random_origin(random, 0.05)));
}

TEST_CASE("Saturated voxels may be left out and no others are") {
  random_bits random{73};
  dense_rays rays;
  for (int run = 0; run != 10; ++run)
    test::require_but_saturated(rays, random_scan(random, 0, 0.05, random_origin(random, 0.05)), random);
}

TEST_CASE("Close to the border of the grid rays have to be walked") {
  random_bits random{74};
  dense_rays rays;
  scan_masks masks;
  const voxel_grid grid{0.1, 8};  // 25.6 m wide
  scan s = random_scan(random, 2, 0.1, {12.6, 0.0, 0.0});
  s.grid = grid;
  CHECK_FALSE(mark(seq, rays, s, masks));
  s = random_scan(random, 0, 0.1, vec3::Zero());
  s.grid = grid;
  CHECK(mark(seq, rays, s, masks));
}

TEST_CASE("Many rays for the voxels pay and few do not") {
  random_bits random{75};
  dense_rays rays;
  const scan s = random_scan(random, 0, 1.0, vec3::Zero());
  const auto pays = [&](double voxel, std::size_t count) {
    const auto point = [&](std::size_t i) { return s.points[i]; };
    return rays.plan(voxel_grid{voxel}, s.origin, count, point, s.limit);
  };
  CHECK(pays(1.0, s.points.size()));
  CHECK_FALSE(pays(0.01, s.points.size()));
  CHECK_FALSE(pays(1.0, 100));
}

TEST_CASE("A cloud takes the same voxels to the map whichever way its rays are marked") {
  random_bits random{76};
  scan_masks want;
  point_integrator marker;
  for (int run = 0; run != 16; ++run) {
    const double voxel = std::array{0.2, 0.05}[run % 2U];
    const scan s = random_scan(random, static_cast<std::uint64_t>(run / 2), voxel, random_origin(random, voxel));
    walk(s, want);
    const integration_options options{.max_range = s.limit};
    for (const unsigned threads : {1U, 3U}) {
      marker.mark(par.with(threads), s.grid, point_reader{}.view(s.points), s.origin, options);
      REQUIRE(free_voxels(marker.masks(), nullptr) == free_voxels(want, nullptr));
    }
  }
}

TEST_CASE("The second of two equal scans takes no memory") {
  random_bits random{77};
  dense_rays rays;
  const scan s = random_scan(random, 0, 0.05, {0.01, 0.02, 0.03});
  scan_masks masks;
  CHECK(mark(seq, rays, s, masks));
  const std::size_t bytes = rays.memory_bytes();
  CHECK(bytes > 0);
  CHECK(mark(seq, rays, s, masks));
  CHECK(rays.memory_bytes() == bytes);

  point_integrator marker;
  const auto scan_again = [&] { return marker.mark(seq, s.grid, point_reader{}.view(s.points), s.origin, {}); };
  scan_again();
  const std::size_t before = test::allocations();
  scan_again();
  if (test::counts_allocations()) CHECK(test::allocations() == before);
}
