// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/epipolar_geometry.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>

#include "features/fundamental_geometry.hpp"
#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

using test::ahead, test::K1, test::K2, test::pixel, test::sideways;

}  // namespace

TEST_CASE("a point lies on its epipolar line and the epipole on all of them") {
  random_bits random{2};
  for (const se3& T : {sideways(), ahead()}) {
    const test::fundamental_geometry geometry{K1, K2, T};
    const auto epipole = geometry.epipole();
    REQUIRE(epipole);
    const vec3 centre = pixel(K2, T.translation());
    CHECK(double{epipole->x()} == Approx(centre.x()).epsilon(1e-4));
    CHECK(double{epipole->y()} == Approx(centre.y()).epsilon(1e-4));
    for (int i = 0; i != 100; ++i) {
      const vec3 p{random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(1.5, 4.0)};
      const vec3 a = pixel(K1, p), b = pixel(K2, T * p);
      const auto line = geometry.line(0, {.x = static_cast<float>(a.x()), .y = static_cast<float>(a.y())});
      REQUIRE(line);
      const auto off = [&](double x, double y) {
        return std::abs(double{line->a} * x + double{line->b} * y + double{line->c});
      };
      CHECK(off(b.x(), b.y()) < 1e-3);
      CHECK(off(centre.x(), centre.y()) < 1e-2);
      // A unit normal: three pixels off is three pixels off.
      CHECK(off(b.x() + 3.0 * double{line->a}, b.y() + 3.0 * double{line->b}) == Approx(3.0).margin(2e-3));
    }
  }
}

TEST_CASE("lines of rays are those of pixels, for a camera that has both") {
  const camera::pinhole camera{640, 480, 500.0, 500.0, 320.0, 240.0};
  mat3 K;
  K << 500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0;
  const auto q = test::random_features(200, 3);
  const auto t = test::random_features(300, 4);
  const auto rays_through = [&](const std::vector<keypoint>& keypoints) {
    std::vector<vec3> rays;
    for (const keypoint& k : keypoints) rays.push_back(camera.unproject(vec2{k.x, k.y}).value());
    return rays;
  };
  const auto q_rays = rays_through(q.keypoints);
  auto t_rays = rays_through(t.keypoints);
  constexpr auto matcher = epipolar(hamming{}, {.epipole_radius = 20.0F}) | cross_check{};
  const auto by_pixels = matcher(q, t, test::fundamental_geometry{K, K, sideways()});
  CHECK(by_pixels.size() > 20);
  CHECK(matcher(q, t, ray_geometry{q_rays, t_rays, sideways(), 500.0}) == by_pixels);

  t_rays.assign(t_rays.size(), vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  CHECK(matcher(q, t, ray_geometry{q_rays, t_rays, sideways(), 500.0}).empty());
}

TEST_CASE("a homogeneous vector without a direction is no line, and one at infinity no pixel") {
  CHECK(to_line({3.0, 4.0, 10.0})->c == Approx(2.0));
  CHECK_FALSE(to_line({0.0, 0.0, 1.0}));
  CHECK_FALSE(to_line({std::numeric_limits<double>::infinity(), 0.0, 1.0}));
  CHECK(to_pixel({3.0, 4.0, 2.0}) == vec2f{1.5F, 2.0F});
  CHECK_FALSE(to_pixel({3.0, 4.0, 0.0}));
}
