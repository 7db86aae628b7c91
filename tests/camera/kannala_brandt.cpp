// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <opencv2/calib3d.hpp>

#include <orbis/camera/kannala_brandt.hpp>

#include "camera/model_checks.hpp"

using namespace orbis;
using camera::kannala_brandt;

static_assert(camera::camera_model<kannala_brandt>);

namespace {

const kannala_brandt wide{{848, 800, 286.0, 287.0, 425.0, 399.0}, {-0.008, 0.045, -0.042, 0.008}};
const kannala_brandt equidistant{{400, 300, 150.0, 150.0, 200.0, 150.0}, {}};

cv::Matx33d matrix_of(const camera::intrinsics& k) { return {k.fx, 0, k.cx, 0, k.fy, k.cy, 0, 0, 1}; }

}  // namespace

TEST_CASE("a fisheye lens projects as OpenCV does") {
  for (const auto* c : {&wide, &equidistant}) {
    const auto& d = c->distortion();
    std::vector<cv::Point3d> points;
    for (const vec3& p : test::points_in_view(*c)) points.emplace_back(p.x(), p.y(), p.z());
    std::vector<cv::Point2d> pixels;
    cv::fisheye::projectPoints(points, pixels, cv::Vec3d{}, cv::Vec3d{}, matrix_of(c->k()),
                               cv::Vec4d{d.k1, d.k2, d.k3, d.k4});
    for (std::size_t i = 0; i != points.size(); ++i) {
      const auto ours = c->project({points[i].x, points[i].y, points[i].z});
      REQUIRE(ours);
      CHECK((*ours - vec2{pixels[i].x, pixels[i].y}).norm() < 1e-8);
    }
  }
}

TEST_CASE("rays of a fisheye lens are those that OpenCV finds") {
  std::vector<cv::Point2d> pixels, rays;
  for (int y = 100; y < 700; y += 40)
    for (int x = 100; x < 750; x += 40)
      if (std::hypot(x - 425.0, y - 399.0) < 390.0) pixels.emplace_back(x, y);  // 90 degrees lie at 413
  const auto& d = wide.distortion();
  cv::fisheye::undistortPoints(pixels, rays, matrix_of(wide.k()), cv::Vec4d{d.k1, d.k2, d.k3, d.k4});
  for (std::size_t i = 0; i != pixels.size(); ++i) {
    const auto ours = wide.unproject({pixels[i].x, pixels[i].y});
    REQUIRE(ours);
    CHECK((ours->head<2>() - vec2{rays[i].x, rays[i].y}).norm() < 1e-6 * ours->squaredNorm());
  }
}

TEST_CASE("every pixel of a fisheye lens within its domain is that of its ray") {
  CHECK(test::round_trip_error(kannala_brandt{{640, 480, 286.0, 287.0, 320.0, 240.0}, wide.distortion()}) < 1e-9);
  for (const auto* c : {&wide, &equidistant})
    for (const vec3& p : test::points_in_view(*c)) {
      const vec3 ray = *c->unproject(*c->project(p));
      CHECK(ray.cross(p).norm() < 1e-9 * ray.norm() * p.norm());
    }
}

TEST_CASE("the Jacobian of a fisheye lens agrees with central differences") {
  test::check_jacobian(kannala_brandt{{400, 300, 286.0, 287.0, 200.0, 150.0}, wide.distortion()});
  // Far out, where a fixed step in metres is a small one.
  for (const vec3& p : {vec3{3, 1, 1}, vec3{-5, 8, 2}, vec3{0.1, -4, 0.5}, vec3{20, 20, 1}}) {
    matrix<2, 3> analytic, numeric;
    REQUIRE(wide.project(p, analytic));
    for (int i = 0; i != 3; ++i) {
      const vec3 d = 1e-6 * vec3::Unit(i);
      numeric.col(i) = (*wide.project(p + d) - *wide.project(p - d)) / 2e-6;
    }
    CHECK((analytic - numeric).norm() < 1e-6 * numeric.norm());
  }
}

TEST_CASE("a fisheye lens sees nothing behind itself and nothing that is not a number") { test::check_bad_input(wide); }

TEST_CASE("a fisheye lens ends at ninety degrees or where its polynomial folds back") {
  CHECK(equidistant.max_angle() == Approx(std::numbers::pi / 2));
  CHECK(equidistant.project({1e6, 0, 1}));
  const double rim = 150.0 * std::numbers::pi / 2;
  CHECK(equidistant.unproject({200.0 + rim - 1e-3, 150.0}));
  CHECK(!equidistant.unproject({200.0 + rim + 1e-3, 150.0}));

  const kannala_brandt folding{{400, 300, 150.0, 150.0, 200.0, 150.0}, {.k1 = -1.0 / 3.0}};
  CHECK(folding.max_angle() == Approx(1.0));
  CHECK(folding.project({std::tan(0.99), 0, 1}));
  CHECK(!folding.project({std::tan(1.01), 0, 1}));
  CHECK(!folding.unproject({200.0 + 150.0 * 2.0 / 3.0 + 0.01, 150.0}));
}

TEST_CASE("the middle of a fisheye lens is a pinhole") {
  CHECK(*wide.project({0, 0, 2}) == vec2{425.0, 399.0});
  CHECK(*wide.unproject({425.0, 399.0}) == vec3{0, 0, 1});
  CHECK((*wide.project({1e-9, 2e-9, 2}) - vec2{425.0 + 286.0 * 0.5e-9, 399.0 + 287.0 * 1e-9}).norm() < 1e-12);
}
