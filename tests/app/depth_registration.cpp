// SPDX-License-Identifier: BSD-3-Clause
//
// Depth registered to a colour camera against depth that is computed for that camera.
#include "inputs/depth_registration.hpp"

#include <cmath>
#include <cstdint>
#include <optional>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// The depth of a plane `normal * p == distance` along z; 0 if the ray does not meet it.
image<std::uint16_t> depth_of_plane(const camera::any_camera& camera, const vec3& normal, double distance) {
  image<std::uint16_t> out(camera.width(), camera.height());
  for (int y = 0; y != out.height(); ++y)
    for (int x = 0; x != out.width(); ++x)
      if (const auto ray = camera.unproject(vec2(x, y)))
        if (const double z = distance / dot(normal, *ray); z > 0.1 && z < 6.0)
          out(x, y) = static_cast<std::uint16_t>(std::lround(10000.0 * z));
  return out;
}

}  // namespace

TEST_CASE("a slanted plane has no gaps and the depth of its points after registration") {
  const camera::any_camera depth = camera::pinhole{{85, 48, 42.0, 42.0, 42.0, 23.5}};
  const camera::any_camera color = GENERATE(
      camera::any_camera{camera::pinhole{{64, 48, 61.0, 61.0, 31.5, 23.5}}},
      camera::any_camera{camera::radial_tangential{{128, 96, 122.0, 122.0, 63.5, 47.5}, {0.1, -0.2, 1e-3, -1e-3}}});
  const se3 T_color_depth{so3::exp(vec3(0.01, -0.02, 0.03)), vec3(0.05, 0.002, -0.001)};
  const vec3 slant = GENERATE(vec3(0.0, 0.0, 1.0), vec3(0.5, 0.2, 0.8), vec3(-0.6, 0.3, 0.7));
  const vec3 normal = slant / norm(slant);  // of the plane, seen from the depth camera
  const double distance = 1.0;
  const auto registered =
      app::depth_registration{depth, color, T_color_depth}(depth_of_plane(depth, normal, distance).view(), 10000.0);
  const vec3 normal_color = T_color_depth.rotation() * normal;
  const auto expected = depth_of_plane(color, normal_color, distance + dot(normal_color, T_color_depth.translation()));
  int gaps = 0, wrong = 0, all = 0;
  for (int y = 2; y != expected.height() - 2; ++y)
    for (int x = 2; x != expected.width() - 2; ++x) {
      if (expected(x, y) == 0) continue;
      // A depth pixel is flat: the depth in it changes by this factor per radian of the slant.
      const vec3 ray = *color.unproject(vec2(x, y));
      const double steps = expected(x, y) / 42.0 * norm(vec3(normal_color.x(), normal_color.y(), 0.0)) /
                           std::abs(dot(normal_color, ray));
      ++all;
      gaps += registered(x, y) == 0;
      wrong += registered(x, y) != 0 && std::abs(registered(x, y) - expected(x, y)) > 1.5 * steps + 2.0;
    }
  CHECK(all > 1000);
  CHECK(gaps == 0);
  CHECK(wrong == 0);
}

TEST_CASE("a near object covers the wall that is not visible from the colour camera") {
  const camera::any_camera camera = camera::pinhole{{60, 40, 50.0, 50.0, 29.5, 19.5}};
  const se3 T_color_depth{so3{}, vec3(0.1, 0.0, 0.0)};
  image<std::uint16_t> depth(60, 40, 2000);
  for (int y = 10; y != 30; ++y)
    for (int x = 20; x != 40; ++x) depth(x, y) = 500;
  depth(0, 0) = 0;
  depth(1, 0) = 65535;  // no measurement either
  const auto out = app::depth_registration{camera, camera, T_color_depth}(depth.view(), 1000.0);
  // The object moves by 50 * 0.1 / 0.5 = 10 pixels, the wall by 2.5.
  CHECK(out(31, 20) == 500);
  CHECK(out(49, 20) == 500);
  CHECK(out(45, 20) == 500);
  CHECK(out(52, 20) == 2000);
  CHECK(out(20, 20) == 2000);
  CHECK(out(26, 20) == 0);  // covered in the depth image
  CHECK(out(45, 5) == 2000);
  CHECK(out(3, 0) == 0);
}
