// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/depth/voxel_ray_test.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;
using octree::detail::voxel_test;

TEST_CASE("A ray that surely crosses a voxel is walked through it, and one that surely does not is not") {
  random_bits random{151};
  std::size_t yes = 0, no = 0, unsure = 0;
  for (int run = 0; run != 400; ++run) {
    const auto at = [&](double half) { return random.uniform(-half, half); };
    const se3 pose{so3::exp({at(2.0), at(2.0), at(2.0)}), {at(3.0), at(3.0), at(3.0)}};
    const voxel_grid grid{run % 2 == 0 ? 0.05 : 0.02};
    const depth_sensor sensor{grid, pose, run % 3 == 0 ? 1.0 : std::numeric_limits<double>::infinity()};
    octree::detail::depth_scene scene;
    for (std::size_t i = 0; i != 3; ++i) {
      scene.x_axis[i] = sensor.pose.rows[i][0];
      scene.y_axis[i] = sensor.pose.rows[i][1];
      scene.z_axis[i] = sensor.pose.rows[i][2];
    }
    scene.margin_0 = 0x1p-24F * 8.0F * 9.0F;
    scene.margin_1 = 64.0F * 0x1p-24F;
    const auto edge = static_cast<float>(grid.resolution());
    for (int i = 0; i != 60; ++i) {
      const auto x = static_cast<float>(at(0.7)), y = static_cast<float>(at(0.7));
      const ray_endpoint end = sensor.end(x, y, static_cast<float>(random.uniform(0.2, 2.0)));
      REQUIRE((end.what == ray_endpoint::fate::used || end.what == ray_endpoint::fate::truncated));
      // A voxel near the ray, often one that it only just touches.
      const auto along = static_cast<float>(random.uniform(0.05, 1.1));
      float3 p;
      for (std::size_t j = 0; j != 3; ++j)
        p[j] = sensor.pose.centre[j] + along * (end.point[j] - sensor.pose.centre[j]) +
               static_cast<float>(at(0.7 * grid.resolution()));
      const voxel_key voxel = *grid.key(p);
      const vec3 c = grid.center(voxel) - vec3{sensor.pose.centre[0], sensor.pose.centre[1], sensor.pose.centre[2]};
      if (c.cwiseAbs().maxCoeff() < 1.1 * grid.resolution()) continue;  // the camera's voxel and its neighbours
      const voxel_test test{
          scene, {static_cast<float>(c.x()), static_cast<float>(c.y()), static_cast<float>(c.z())}, 0.5F * edge};
      const bool crossed = crosses(sensor, end, voxel);
      bool walked = false;
      traverse_ray(grid, sensor.pose.centre, *sensor.key, end.point, end.key,
                   [&](const voxel_key& k) { walked = walked || k == voxel; });
      REQUIRE(crossed == walked);
      using floats = simd::vec<float, 4, simd::portable>;
      const auto answer = test_rays(test, floats(x), floats(y), floats(end.z), floats::mask_type::first(4));
      const bool is_sure = any(answer.sure), is_unsure = any(answer.may) && !is_sure;
      yes += is_sure ? 1 : 0;
      no += none(answer.may) ? 1 : 0;
      unsure += is_unsure ? 1 : 0;
      if (is_sure) REQUIRE(crossed);
      if (none(answer.may)) REQUIRE_FALSE(crossed);
      // What a tile of one direction cannot cross, the ray does not cross.
      if (!test.may_cross(x, x, y, y)) REQUIRE_FALSE(crossed);
    }
  }
  CHECK(yes > 3000);
  CHECK(no > 3000);
  CHECK(unsure < 100);
}
