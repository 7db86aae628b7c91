// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <atomic>
#include <cmath>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/octree/render.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;

namespace {

const camera::pinhole small_camera{80, 60, 70.0, 70.0, 39.5, 29.5};

/// Inside a box of 4 x 3 x 5 metres around the origin: depth along the optical axis.
image<float> room_depth(const se3& T_world_camera) {
  image<float> depth(small_camera.width(), small_camera.height());
  const vec3 half{2.0, 1.5, 2.5};
  for (int y = 0; y != depth.height(); ++y)
    for (int x = 0; x != depth.width(); ++x) {
      const vec3 direction = T_world_camera.rotation() * *small_camera.unproject({double(x), double(y)});
      double nearest = 1e9;
      for (int i = 0; i != 3; ++i)
        if (direction[i] != 0.0)
          nearest = std::min(nearest, (std::copysign(half[i], direction[i]) - T_world_camera.translation()[i]) / direction[i]);
      depth(x, y) = static_cast<float>(nearest);
    }
  return depth;
}
se3 pose(double yaw, const vec3& at) { return se3{so3::exp(vec3{0.0, yaw, 0.0}), at}; }

occupancy_octree<> room_map(double resolution) {
  occupancy_octree<> map{resolution};
  for (int i = 0; i != 12; ++i) {
    const se3 T = pose(0.5 * i, {0.2, 0.1, -0.1});
    const image<float> depth = room_depth(T);
    std::vector<vec3f> points;
    append_world_points(camera::depth_view{depth}, small_camera, T, points);
    map.integrate(points, T.translation());
  }
  return map;
}

}  // namespace

TEST_CASE("What is rendered agrees with the depth that the map was made of") {
  constexpr double resolution = 0.1;
  const auto map = room_map(resolution);
  for (const double yaw : {0.0, 1.0, 2.3}) {
    const se3 T = pose(yaw, {0.2, 0.1, -0.1});
    const image<float> expected = room_depth(T);
    const image<float> got = render_depth(seq, map, small_camera, T);
    std::size_t close = 0;
    for (int y = 0; y != got.height(); ++y)
      for (int x = 0; x != got.width(); ++x)
        close += std::fabs(got(x, y) - expected(x, y)) < std::sqrt(3.0) * resolution ? 1 : 0;
    CHECK(static_cast<double>(close) > 0.9 * static_cast<double>(got.pixels().size()));
  }
}

TEST_CASE("Every pixel gets the voxel that its ray hits, under every policy") {
  const auto map = room_map(0.1);
  const se3 T = pose(0.3, {-0.4, 0.2, 0.3});
  const ray_options options{.max_range = 2.6, .ignore_unknown = true};
  const image<float> depth = render_depth(seq, map, small_camera, T, options);
  CHECK(render_depth(par.with(2), map, small_camera, T, options) == depth);
  CHECK(render_depth(par.with(5), map, small_camera, T, options) == depth);

  const auto name = [](const voxel_key& k) { return k; };
  const image<voxel_key> voxels = render_labels(seq, map, small_camera, T, options, name);
  CHECK(render_labels(par.with(3), map, small_camera, T, options, name) == voxels);
  std::size_t hits = 0, misses = 0;
  for (int y = 0; y != depth.height(); ++y)
    for (int x = 0; x != depth.width(); ++x) {
      const vec3 direction = T.rotation() * *small_camera.unproject({double(x), double(y)});
      const ray_hit hit = map.cast_ray(T.translation(), direction, options.max_range, options.ignore_unknown);
      REQUIRE((depth(x, y) > 0.0F) == static_cast<bool>(hit));
      if (!hit) {
        REQUIRE(voxels(x, y) == voxel_key{});
        ++misses;
        continue;
      }
      ++hits;
      REQUIRE(voxels(x, y) == hit.key);
      REQUIRE(map.state(hit.key) == occupancy::occupied);
      // The depth is where the ray enters the voxel.
      const vec3 entry = T.translation() + static_cast<double>(depth(x, y)) * direction;
      REQUIRE(std::fabs((entry - hit.point).cwiseAbs().maxCoeff() - 0.05) < 1e-5);
    }
  CHECK(hits > 500);
  CHECK(misses > 500);
}

TEST_CASE("An empty map renders as nothing") {
  const occupancy_octree<> map{0.1};
  const image<float> depth = render_depth(seq, map, small_camera, se3{}, {.max_range = 3.0, .ignore_unknown = true});
  CHECK(depth == image<float>(80, 60));
  std::atomic<int> unknown{0};
  render(par.with(2), map, small_camera, se3{}, {}, [&](int, int, const ray_hit& hit) {
    unknown += hit.end == ray_end::unknown ? 1 : 0;
  });
  CHECK(unknown == 80 * 60);
}
