// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <opencv2/calib3d.hpp>

#include <orbis/camera/radial_tangential.hpp>

#include "camera/model_checks.hpp"

using namespace orbis;
using camera::intrinsics;
using camera::radial_tangential;

static_assert(camera::camera_model<radial_tangential>);

namespace {

const radial_tangential freiburg1{{640, 480, 517.3, 516.5, 318.6, 255.3}, {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}};
const radial_tangential plain_barrel{{640, 480, 500.0, 505.0, 321.0, 238.0}, {.k1 = -0.3, .k2 = 0.1}};
const radial_tangential rational{
    {1280, 720, 610.0, 612.0, 640.0, 362.0},
    {.k1 = 0.5, .k2 = -2.1, .p1 = 0.0007, .p2 = -0.0004, .k3 = 1.4, .k4 = 0.4, .k5 = -1.9, .k6 = 1.3}};
const radial_tangential none{{640, 480, 525.0, 525.0, 319.5, 239.5}, {}};

std::vector<const radial_tangential*> all() { return {&freiburg1, &plain_barrel, &rational, &none}; }

cv::Mat matrix_of(const intrinsics& k) { return (cv::Mat_<double>(3, 3) << k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1); }
cv::Mat coefficients_of(const radial_tangential::coefficients& d) {
  return (cv::Mat_<double>(1, 8) << d.k1, d.k2, d.p1, d.p2, d.k3, d.k4, d.k5, d.k6);
}

}  // namespace

TEST_CASE("radial and tangential distortion project as OpenCV does") {
  for (const auto* c : all()) {
    std::vector<cv::Point3d> points;
    for (const vec3& p : test::points_in_view(*c)) points.emplace_back(p.x(), p.y(), p.z());
    std::vector<cv::Point2d> pixels;
    cv::projectPoints(points, cv::Vec3d{}, cv::Vec3d{}, matrix_of(c->k()), coefficients_of(c->distortion()), pixels);
    for (std::size_t i = 0; i != points.size(); ++i) {
      const auto ours = c->project({points[i].x, points[i].y, points[i].z});
      REQUIRE(ours);
      CHECK((*ours - vec2{pixels[i].x, pixels[i].y}).norm() < 1e-9);
    }
  }
}

TEST_CASE("rays of a distorting camera are those that OpenCV finds") {
  for (const auto* c : all()) {
    std::vector<cv::Point2d> pixels, rays;
    for (int y = 0; y < c->height(); y += 40)
      for (int x = 0; x < c->width(); x += 40) pixels.emplace_back(x, y);
    cv::undistortPoints(pixels, rays, matrix_of(c->k()), coefficients_of(c->distortion()), cv::noArray(), cv::noArray(),
                        cv::TermCriteria{cv::TermCriteria::MAX_ITER | cv::TermCriteria::EPS, 2000, 1e-14});
    for (std::size_t i = 0; i != pixels.size(); ++i) {
      const auto ours = c->unproject({pixels[i].x, pixels[i].y});
      REQUIRE(ours);
      CHECK((ours->head<2>() - vec2{rays[i].x, rays[i].y}).norm() < 1e-7);
    }
  }
}

TEST_CASE("every pixel of a distorting camera is that of its ray") {
  for (const auto* c : all()) {
    CHECK(test::round_trip_error(*c) < 1e-9);
    test::check_points_lie_on_their_rays(*c);
  }
}

TEST_CASE("the Jacobian of a distorting camera agrees with central differences") {
  for (const auto* c : all()) test::check_jacobian(*c);
}

TEST_CASE("a distorting camera sees nothing behind itself and nothing that is not a number") {
  for (const auto* c : all()) test::check_bad_input(*c);
}

TEST_CASE("points beyond the fold of the distortion are not seen") {
  // r (1 - 0.3 r^2) grows up to r = 1.0541 and is back in the middle of the image at r = 1.8257.
  const radial_tangential folding{{640, 480, 500.0, 500.0, 320.0, 240.0}, {.k1 = -0.3}};
  CHECK(folding.max_squared_radius() == Approx(1.0 / 0.9));
  CHECK(folding.project({1.05, 0.0, 1.0}));
  CHECK(!folding.project({1.06, 0.0, 1.0}));
  CHECK(!folding.project({1.8257, 0.0, 1.0}));
  CHECK(!folding.project({20.0, 10.0, 1.0}));
  const double rim = 500.0 * 1.0540925 * (1.0 - 0.3 / 0.9);
  CHECK(folding.unproject({320.0 + rim - 1e-3, 240.0}));
  CHECK(!folding.unproject({320.0 + rim + 1e-3, 240.0}));
  CHECK(!folding.unproject({320.0, 240.0 + 5000.0}));

  // A pole of the rational form ends the domain as well, and none of the lenses in use has an end in the image.
  const radial_tangential pole{{640, 480, 500.0, 500.0, 320.0, 240.0}, {.k4 = -0.5}};
  CHECK(pole.max_squared_radius() == Approx(2.0));
  CHECK(!pole.project({1.5, 0.0, 1.0}));
  CHECK(std::isinf(freiburg1.max_squared_radius()));
  CHECK(std::isinf(none.max_squared_radius()));
}

TEST_CASE("strong tangential distortion near the rim gives the right ray or none") {
  const radial_tangential strong{{640, 480, 400.0, 400.0, 320.0, 240.0},
                                 {.k1 = -0.25, .k2 = 0.02, .p1 = 0.01, .p2 = -0.02}};
  int seen = 0;
  for (int y = -100; y < 580; y += 5)
    for (int x = -100; x < 740; x += 5)
      if (const auto ray = strong.unproject({x, y})) {
        ++seen;
        const auto pixel = strong.project(*ray);
        REQUIRE(pixel);
        CHECK((*pixel - vec2{x, y}).norm() < 1e-9);
      }
  CHECK(seen > 96 * 128);
}

TEST_CASE("coefficients come in the order in which OpenCV lists them") {
  const radial_tangential::coefficients d{1, 2, 3, 4, 5, 6, 7, 8};
  CHECK((d.k1 == 1 && d.k2 == 2 && d.p1 == 3 && d.p2 == 4 && d.k3 == 5 && d.k4 == 6 && d.k5 == 7 && d.k6 == 8));
}
