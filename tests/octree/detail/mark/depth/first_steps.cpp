// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/depth/first_steps.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;
using octree::detail::pixel_box;

namespace {

/// Rays in cells of direction on the plane z = 1 of some frame.
struct ray_image {
  static constexpr int size = 60;

  depth_sensor sensor;
  mat3 turned;
  double edge;
  std::vector<ray_endpoint> ends{};  ///< four in each cell

  ray_image(random_bits& random, const voxel_grid& grid, const vec3& origin)
      : sensor{grid, se3{so3{}, origin}, 1e9},
        turned{so3::exp({random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0), random.uniform(-2.0, 2.0)})
                   .rotation_matrix()},
        edge{random.uniform(0.001, 0.03)} {
    if (random.below(3) == 0) turned.setIdentity();
    for (int v = 0; v != size; ++v)
      for (int u = 0; u != size; ++u)
        for (int i = 0; i != 4; ++i) {
          const vec3 d = turned * vec3{at(u + random.uniform(0.0, 1.0)), at(v + random.uniform(0.0, 1.0)), 1.0};
          const double reach = random.uniform(0.0, 8.0) * grid.resolution();
          ray_endpoint e;
          for (std::size_t k = 0; k != 3; ++k)
            e.point[k] = sensor.pose.centre[k] + static_cast<float>(reach * d[static_cast<Eigen::Index>(k)]);
          e.key = *grid.key(e.point);
          ends.push_back(e);
        }
  }
  [[nodiscard]] double at(double cell) const { return (cell - 0.5 * size) * edge; }
  [[nodiscard]] std::pair<float3, float3> directions(const pixel_box& box) const {
    float3 low{9, 9, 9}, high{-9, -9, -9};
    for (const double x : {at(box.u0), at(box.u1 + 1)})
      for (const double y : {at(box.v0), at(box.v1 + 1)}) {
        const vec3 d = turned * vec3{x, y, 1.0};
        for (std::size_t k = 0; k != 3; ++k) {
          low[k] = std::min(low[k], static_cast<float>(d[static_cast<Eigen::Index>(k)]));
          high[k] = std::max(high[k], static_cast<float>(d[static_cast<Eigen::Index>(k)]));
        }
      }
    return {low, high};
  }
};

[[nodiscard]] std::vector<std::array<std::uint64_t, 8>> bits(const first_voxels& voxels) {
  scan_masks masks;
  voxels.mark(masks);
  std::vector<std::pair<std::uint64_t, std::array<std::uint64_t, 8>>> named;
  for (const scan_brick& b : masks.bricks()) named.emplace_back(b.name, b.free);
  std::sort(named.begin(), named.end());
  std::vector<std::array<std::uint64_t, 8>> all;
  for (const auto& [name, free] : named) all.push_back(free);
  return all;
}

}  // namespace

TEST_CASE("Of an image of rays only a few are walked and the voxels around the sensor are those of all") {
  random_bits random{61};
  const voxel_grid grid{0.1};
  std::size_t walked = 0, rays = 0;
  for (int run = 0; run != 300; ++run) {
    // On a corner, on an edge or a face, or close to them.
    vec3 origin{0.1 * random.below(4), 0.1 * random.below(4), 0.1 * random.below(4)};
    for (int i = 0; i != 3; ++i) {
      if (random.below(3) == 0) origin[i] += random.uniform(0.0, 0.1);
      if (random.below(3) == 0) origin[i] += random.uniform(-1e-7, 1e-7);
    }
    if (run % 10 == 0) origin.setZero();
    const ray_image image{random, grid, origin};
    const first_step_order order{image.sensor};
    first_voxels all{image.sensor}, got{image.sensor};
    for (const ray_endpoint& e : image.ends) all.add(e);
    got.add(
        order, {0, ray_image::size - 1, 0, ray_image::size - 1},
        [&](const pixel_box& box) { return image.directions(box); },
        [&](const pixel_box& box, auto&& use) {
          for (int v = box.v0; v <= box.v1; ++v)
            for (int u = box.u0; u <= box.u1; ++u)
              for (int i = 0; i != 4; ++i) {
                ++walked;
                if (!use(image.ends[static_cast<std::size_t>(4 * (v * ray_image::size + u) + i)])) return;
              }
        });
    rays += image.ends.size();
    REQUIRE(bits(got) == bits(all));
  }
  CHECK(20 * walked < rays);
}

TEST_CASE("A range of directions may take a ray through every voxel that it takes it through") {
  random_bits random{62};
  const voxel_grid grid{0.1};
  for (int run = 0; run != 3000; ++run) {
    vec3 origin{0.1 * random.below(3), 0.1 * random.below(3), 0.1 * random.below(3)};
    if (run % 2 == 0) origin[static_cast<int>(random.below(3))] += random.uniform(0.0, 0.1);
    const depth_sensor sensor{grid, se3{so3{}, origin}, 1e9};
    const first_step_order order{sensor};
    float3 low, high;
    ray_endpoint e;
    for (std::size_t i = 0; i != 3; ++i) {
      low[i] = static_cast<float>(random.uniform(-1.0, 1.0));
      if (random.below(4) == 0) low[i] = 0.0F;
      high[i] = low[i] + static_cast<float>(random.uniform(0.0, 0.2));
      const auto d = static_cast<float>(random.uniform(static_cast<double>(low[i]), static_cast<double>(high[i])));
      e.point[i] = sensor.pose.centre[i] + d;
    }
    e.key = *grid.key(e.point);
    const std::uint32_t may = order.voxels(low, high);
    const voxel_key from = *sensor.key;
    bool inside = true;
    traverse_ray(grid, sensor.pose.centre, from, e.point, e.key, [&](const voxel_key& k) {
      const std::uint32_t x = k.x - from.x + 1, y = k.y - from.y + 1, z = k.z - from.z + 1;
      inside = inside && x < 3 && y < 3 && z < 3;
      if (inside && k != from) REQUIRE((may >> (x + 3 * y + 9 * z) & 1U) != 0);
    });
  }
}
