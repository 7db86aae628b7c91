// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What every camera model has to fulfil.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

namespace orbis::test {

/// Points spread over the image (and a bit beyond), at depths from 0.1 to 20 m.
template <camera::camera_model C>
std::vector<vec3> points_in_view(const C& camera, int count = 500) {
  random_bits random{1};
  std::vector<vec3> points;
  while (static_cast<int>(points.size()) < count) {
    const vec2 pixel{random.uniform(-50.0, camera.width() + 50.0), random.uniform(-50.0, camera.height() + 50.0)};
    if (const auto ray = camera.unproject(pixel)) points.push_back(*ray * random.uniform(0.1, 20.0));
  }
  return points;
}

/// Every pixel has a ray, and the ray projects onto the pixel. The largest error, in pixels.
template <camera::camera_model C>
double round_trip_error(const C& camera) {
  double worst = 0.0;
  for (int y = 0; y != camera.height(); ++y)
    for (int x = 0; x != camera.width(); ++x) {
      const auto ray = camera.unproject({x, y});
      const auto pixel = ray ? camera.project(*ray) : std::nullopt;
      if (!pixel || ray->z() != 1.0) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, (*pixel - vec2{x, y}).norm());
    }
  return worst;
}

/// A point projects onto a pixel whose ray goes through the point.
template <camera::camera_model C>
void check_points_lie_on_their_rays(const C& camera) {
  for (const vec3& p : points_in_view(camera)) {
    const auto pixel = camera.project(p);
    REQUIRE(pixel);
    const auto ray = camera.unproject(*pixel);
    REQUIRE(ray);
    CHECK((*ray - p / p.z()).norm() < 1e-10 * (1.0 + ray->squaredNorm()));
  }
}

/// The analytic Jacobian against central differences.
template <camera::camera_model C>
void check_jacobian(const C& camera) {
  std::vector<vec3> points = points_in_view(camera, 200);
  for (const double off : {0.0, 1e-12, 1e-8, 1e-5}) points.push_back({off, -0.5 * off, 2.0});
  for (const vec3& p : points) {
    matrix<2, 3> analytic, numeric;
    const auto pixel = camera.project(p, analytic);
    REQUIRE(pixel);
    CHECK(*pixel == *camera.project(p));
    const double step = 1e-5 * p.z();
    for (int i = 0; i != 3; ++i) {
      vec3 d = vec3::Zero();
      d[i] = step;
      numeric.col(i) = (*camera.project(p + d) - *camera.project(p - d)) / (2.0 * step);
    }
    CHECK((analytic - numeric).norm() < 1e-6 * numeric.norm());
  }
}

/// No pixel for points behind the camera or in its plane, nor for what is not a number; no ray for
/// a pixel that is not one.
template <camera::camera_model C>
void check_bad_input(const C& camera) {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  matrix<2, 3> jacobian = matrix<2, 3>::Constant(7.0);
  for (const vec3& p :
       {vec3{0, 0, -1}, vec3{0.1, 0.2, -3}, vec3{0, 0, 0}, vec3{1, 1, 0}, vec3{0, 0, nan}, vec3{nan, 0, 1},
        vec3{0, nan, 1}, vec3{inf, 0, 1}, vec3{0, -inf, 1}, vec3{0, 0, -inf}, vec3{inf, 0, inf}, vec3{1, 0, 5e-324}}) {
    CAPTURE(p.transpose());
    CHECK(!camera.project(p));
    CHECK(!camera.project(p, jacobian));
  }
  CHECK(jacobian == matrix<2, 3>::Constant(7.0));
  for (const vec2& pixel : {vec2{nan, 0}, vec2{0, nan}, vec2{inf, 0}, vec2{0, -inf}}) CHECK(!camera.unproject(pixel));
}

}  // namespace orbis::test
