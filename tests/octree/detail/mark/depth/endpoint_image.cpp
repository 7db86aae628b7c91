// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/octree/detail/mark/depth/endpoint_image.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

template <class T>
[[nodiscard]] image<T> random_image(random_bits& random, int width, int height) {
  image<T> pixels{width, height};
  for (T& p : pixels.pixels()) p = static_cast<T>(random.below(65536));
  return pixels;
}

/// Requires the ends, one by one, of every instruction set.
template <class Depth>
void require_ends(const Depth& depth, const camera::pinhole& camera, const se3& pose, const voxel_grid& grid,
                  double max_range) {
  const depth_sensor sensor{grid, pose, max_range};
  const camera::ray_table table{camera};
  for (const simd::level level : simd::available_levels()) {
    const simd::level_limit limit{level};
    endpoint_image rays;
    scan_masks found, expected;
    const auto counts = rays.find_ends(seq, sensor, octree::detail::depth_scan{depth, camera}, found);
    octree::detail::end_counts one_by_one;
    std::size_t wrong = 0;
    for (int v = 0; v != camera.height(); ++v)
      for (int u = 0; u != camera.width(); ++u) {
        const auto e = sensor.end(table(u, v).x(), table(u, v).y(), depth(u, v));
        const bool used = e.what == ray_endpoint::fate::used, truncated = e.what == ray_endpoint::fate::truncated;
        one_by_one.used += used ? 1 : 0;
        one_by_one.truncated += truncated ? 1 : 0;
        one_by_one.rejected += e.what == ray_endpoint::fate::rejected ? 1 : 0;
        wrong += rays.z(v)[u] != (used || truncated ? e.z : 0.0F) ? 1 : 0;
        if (used) expected.mark_occupied(e.key);
      }
    INFO("level " << static_cast<int>(level) << ", range " << max_range);
    REQUIRE(wrong == 0);
    REQUIRE(counts.used == one_by_one.used);
    REQUIRE(counts.truncated == one_by_one.truncated);
    REQUIRE(counts.rejected == one_by_one.rejected);
    REQUIRE(found.bricks().size() == expected.bricks().size());
    for (const scan_brick& b : expected.bricks()) {
      REQUIRE(found.find(b.name) != nullptr);
      REQUIRE(found.find(b.name)->occupied == b.occupied);
    }
  }
}

}  // namespace

TEST_CASE("Rays end where their depth says, whatever the instruction set, the type and the scale") {
  random_bits random{121};
  for (const int width : {1, 7, 16, 33, 70}) {
    const camera::pinhole camera{width, 21, 50.0, 51.0, 0.5 * width, 9.0};
    const auto stored = random_image<std::uint16_t>(random, width, 21);
    image<float> metres{width, 21};
    for (float& m : metres.pixels()) m = static_cast<float>(random.uniform(-0.5, 4.0));
    if (width > 10) {
      metres(3, 3) = std::numeric_limits<float>::quiet_NaN();
      metres(4, 3) = std::numeric_limits<float>::infinity();
      metres(5, 3) = 1e30F;
      metres(6, 3) = 1e-40F;
    }
    const se3 pose{so3::exp({0.3, -0.7, 0.2}), {1.5, -0.3, 0.8}};
    const voxel_grid grid{0.02};
    for (const double range : {std::numeric_limits<double>::infinity(), 2.0, 0.0}) {
      for (const double scale : {1000.0, 5000.0, 3333.3})  // the last is no float
        require_ends(camera::depth_view<std::uint16_t>{stored.view(), scale, 0.1F, 50.0F}, camera, pose, grid, range);
      require_ends(camera::depth_view<float>{metres.view()}, camera, pose, grid, range);
      require_ends(camera::depth_view<float>{metres.view(), 0.3}, camera, pose, grid, range);
    }
  }
}

TEST_CASE("Points on faces of voxels fall on the side that the grid says") {
  // An axis-parallel camera and depths that are multiples of the resolution, from origins on faces.
  const camera::pinhole camera{64, 64, 64.0, 64.0, 32.0, 32.0};
  image<float> depth{64, 64};
  for (int i = 0; i != 64 * 64; ++i)
    depth.pixels()[static_cast<std::size_t>(i)] = 0.05F * static_cast<float>(1 + i % 97);
  for (const vec3& centre : {vec3{0, 0, 0}, vec3{0.35, 0.7, -0.05}, vec3{300.05, -7.0, 1500.0}})
    require_ends(camera::depth_view<float>{depth.view()}, camera, se3{so3{}, centre}, voxel_grid{0.05},
                 std::numeric_limits<double>::infinity());
}

TEST_CASE("Ends outside the grid are rejected") {
  const camera::pinhole camera{32, 8, 30.0, 30.0, 16.0, 4.0};
  image<float> depth{32, 8};
  for (int u = 0; u != 32; ++u)
    for (int v = 0; v != 8; ++v) depth(u, v) = 0.2F * static_cast<float>(u);
  for (const double at : {324.0, 330.0, -326.0})
    require_ends(camera::depth_view<float>{depth.view()}, camera, se3{so3{}, {0.0, 0.0, at}}, voxel_grid{0.01}, 5.0);
}
