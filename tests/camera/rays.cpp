// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <initializer_list>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rays.hpp>
#include <orbis/core/simd/level.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::camera;

TEST_CASE("the table has the ray of every pixel of any model") {
  const intrinsics k{160, 120, 130.0, 129.0, 80.0, 59.0};
  for (const any_camera& c : {any_camera{pinhole{k}}, any_camera{radial_tangential{k, {.k1 = 0.2, .k2 = -0.1}}},
                              any_camera{kannala_brandt{k, {.k1 = 0.01}}}}) {
    const ray_table rays{c};
    REQUIRE((rays.width() == 160 && rays.height() == 120));
    for (int y = 0; y < 120; y += 7)
      for (int x = 0; x < 160; x += 7) {
        const auto found = c.unproject({x, y});
        REQUIRE(found);
        const vec3& ray = *found;
        CHECK((rays(x, y).cast<double>() - ray.head<2>()).norm() < 1e-6);
        CHECK((rays.at(x, y, 2.5F).cast<double>() - 2.5 * ray).norm() < 1e-6);
        CHECK(rays.at(x, y, 2.5F).z() == 2.5F);
      }
  }
}

TEST_CASE("pixels without a ray are not a number in the table") {
  const ray_table rays{kannala_brandt{{200, 100, 50.0, 50.0, 100.0, 50.0}, {}}};
  CHECK(std::isnan(rays(0, 50).x()));  // 2 rad off the axis
  CHECK(std::isfinite(rays(30, 50).x()));
  CHECK(ray_table{}.width() == 0);
  CHECK(ray_table{pinhole{}}.width() == 0);
}

TEST_CASE("the rays of a distorted image are those of its pixels, on every instruction set") {
  const int width = GENERATE(1, 7, 8, 157);
  const intrinsics k{width, 120, 90.0, 95.0, 0.5 * width, 57.0};
  for (const auto& distortion : std::initializer_list<radial_tangential::coefficients>{
           {},
           {.k1 = 0.2624, .k2 = -0.9531, .p1 = -0.0054, .p2 = 0.0026, .k3 = 1.1633},
           {.k1 = -0.4},  // no rays at the edge
           {.k1 = 0.3, .k2 = 0.1, .p1 = 0.001, .p2 = -0.002, .k3 = 0.01, .k4 = 0.5, .k5 = 0.2, .k6 = 0.03}})
    for (const simd::level level : simd::available_levels()) {
      const simd::level_limit limit{level};
      const radial_tangential c{k, distortion};
      int pixels = 0, without_ray = 0, different = 0;
      for_each_ray(any_camera{c}, [&](int x, int y, const vec2& ray) {
        const auto expected = c.unproject(vec2{x, y});
        different += expected ? ray != vec2{expected->head<2>()} : !std::isnan(ray.x());
        without_ray += expected ? 0 : 1;
        ++pixels;
      });
      CHECK(pixels == width * 120);
      CHECK(different == 0);
      CHECK((without_ray != 0) == (distortion.k1 < 0.0));
    }
}
