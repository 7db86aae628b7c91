// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/camera/any.hpp>
#include <orbis/camera/rays.hpp>

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
