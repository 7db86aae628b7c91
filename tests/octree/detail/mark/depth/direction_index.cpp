// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>

#include <orbis/camera/any.hpp>
#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/random.hpp>
#include <orbis/octree/detail/mark/depth/direction_index.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::octree;
using namespace orbis::octree::detail;

namespace {

const std::array<camera::any_camera, 4> cameras{
    camera::radial_tangential{{96, 72, 75.0, 76.0, 47.0, 36.5}, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}},
    camera::radial_tangential{{90, 66, 40.0, 40.0, 44.5, 32.5}, {-0.30, 0.02, 0.01, 0.01}},
    camera::kannala_brandt{{96, 96, 30.0, 30.0, 47.5, 47.5}, {-0.01, 0.02, -0.004, 0.001}},
    camera::kannala_brandt{{100, 60, 60.0, 60.0, 50.0, 29.0}, {0.05, -0.02, 0.01, 0.0}}};

}  // namespace

TEST_CASE("Every ray of a region belongs to a pixel that the map names") {
  random_bits random{141};
  for (const auto& camera : cameras) {
    pixel_rays rays;
    rays.fit(camera);
    direction_index map;
    map.fit(rays);
    std::size_t rays_seen = 0, wrong = 0;
    for (int run = 0; run != 300; ++run) {
      const auto size = static_cast<float>(random.uniform(0.0, 0.5));
      const auto x0 = static_cast<float>(random.uniform(-2.0, 2.0)), y0 = static_cast<float>(random.uniform(-2.0, 2.0));
      const float x1 = x0 + size, y1 = y0 + size;
      const auto& e = map.at(x0, x1, y0, y1);
      for (int v = 0; v != rays.height(); ++v)
        for (int u = 0; u != rays.width(); ++u) {
          const auto [x, y] = rays.at(u, v);
          if (!(x >= x0 && x <= x1 && y >= y0 && y <= y1)) continue;
          ++rays_seen;
          const float du = static_cast<float>(u) - (map.focal().x() * x + map.center().x());
          const float dv = static_cast<float>(v) - (map.focal().y() * y + map.center().y());
          wrong += du < e.least_u - 1e-3F || du > e.most_u + 1e-3F || dv < e.least_v - 1e-3F || dv > e.most_v + 1e-3F;
        }
    }
    CHECK(rays_seen > 1000);
    CHECK(wrong == 0);
  }
}

TEST_CASE("Where the map knows a spacing there is a ray within it") {
  random_bits random{142};
  for (const auto& camera : cameras) {
    pixel_rays rays;
    rays.fit(camera);
    direction_index map;
    map.fit(rays);
    std::size_t known = 0, farther = 0;
    double tightest = 0.0;
    for (int run = 0; run != 2000; ++run) {
      const auto x =
          static_cast<float>(random.uniform(static_cast<double>(map.min_x()), static_cast<double>(map.max_x())));
      const auto y =
          static_cast<float>(random.uniform(static_cast<double>(map.min_y()), static_cast<double>(map.max_y())));
      const auto& e = map.at(x, x, y, y);
      if (!std::isfinite(e.spacing)) continue;
      ++known;
      float nearest = 100.0F;
      for (int v = 0; v != rays.height(); ++v)
        for (int u = 0; u != rays.width(); ++u) {
          const auto [rx, ry] = rays.at(u, v);
          const float off = std::hypot(rx - x, ry - y);
          if (off < nearest) nearest = off;
        }
      farther += nearest > e.spacing ? 1 : 0;
      tightest = std::max(tightest, static_cast<double>(nearest / e.spacing));
    }
    CHECK(known > 100);
    CHECK(farther == 0);
    CHECK(tightest > 0.2);  // it is a spacing, not just any bound
  }
}

TEST_CASE("Rays far off the axis and pixels without a ray are left out") {
  pixel_rays rays;
  rays.fit(cameras[2]);
  direction_index map;
  map.fit(rays);
  CHECK_FALSE(map.outer().empty());
  for (const auto& [u, v] : map.outer()) {
    const auto [x, y] = rays.at(u, v);
    CHECK(std::max(std::fabs(x), std::fabs(y)) > direction_index::widest);
  }
  CHECK(std::max(map.max_x(), map.max_y()) <= direction_index::widest);
}
