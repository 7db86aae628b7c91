// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <limits>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/random.hpp>
#include <orbis/mapping/detail/live/view_frustum.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// The largest distance that a point of the view moves: tried on all rays, at several depths.
template <class Camera>
double largest_move(const Camera& camera, const se3& before, const se3& after, double reach, double widest_angle) {
  double largest = 0.0;
  for (int v = 0; v < camera.height(); v += 7)
    for (int u = 0; u < camera.width(); u += 7)
      if (const auto ray = camera.unproject(vec2{u, v}); ray && std::hypot(ray->x(), ray->y()) < std::tan(widest_angle))
        for (const double z : {0.0, 0.5 * reach, reach})
          largest = std::max(largest, vec3(after * vec3(z * *ray) - before * vec3(z * *ray)).norm());
  return largest;
}

template <class Camera>
double displacement(const Camera& camera, const se3& before, const se3& after) {
  return mapping::detail::view_frustum{camera}.displacement(before, after, 4.0);
}

}  // namespace

TEST_CASE("A frustum's displacement is not less than that of any point in view") {
  random_bits random{5};
  const camera::pinhole narrow{{.width = 64, .height = 48, .fx = 55, .fy = 55, .cx = 31.5, .cy = 23.5}};
  // The image circle lies inside of the image: no ray at its border.
  const camera::kannala_brandt circle{{512, 512, 120.0, 120.0, 256.0, 256.0}, {}};
  REQUIRE_FALSE(circle.unproject(vec2{0.0, 256.0}).has_value());
  for (int i = 0; i != 20; ++i) {
    const auto small = [&] {
      return vec3{random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05), random.uniform(-0.05, 0.05)};
    };
    const se3 before{so3::exp(small()), small()}, after{so3::exp(small()), small()};
    const double moved = displacement(narrow, before, after);
    const double most = largest_move(narrow, before, after, 4.0, 1.5);
    CHECK(moved >= most * (1.0 - 1e-12));
    CHECK(moved < 1.1 * most);  // the corners are almost in view
    const double wide = displacement(circle, before, after);
    const double most_wide = largest_move(circle, before, after, 4.0, 1.396);  // 80 degrees
    CHECK(wide >= most_wide * (1.0 - 1e-12));
    CHECK(wide < 1.15 * most_wide);
    CHECK(mapping::detail::view_frustum{camera::ray_table{narrow}}.displacement(before, after, 4.0) ==
          Approx(moved).epsilon(1e-6));
  }
  const se3 roll{so3::exp(vec3{0.0, 0.0, 0.035}), vec3::Zero()};
  CHECK(displacement(circle, se3{}, roll) > 0.3);
  CHECK(displacement(narrow, roll, roll) == 0.0);
}

TEST_CASE("What is without a limit moves without a limit") {
  const mapping::detail::view_frustum view{
      camera::pinhole{{.width = 64, .height = 48, .fx = 55, .fy = 55, .cx = 31.5, .cy = 23.5}}};
  constexpr double infinity = std::numeric_limits<double>::infinity();
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  const se3 before, after{so3{}, vec3{0.001, 0.0, 0.0}}, nowhere{so3{}, vec3{0.0, nan, 0.0}};
  CHECK(view.displacement(before, after, 4.0) == Approx(0.001));
  CHECK(view.displacement(before, after, infinity) == infinity);
  CHECK(view.displacement(before, after, nan) == infinity);
  CHECK(view.displacement(before, nowhere, 4.0) == infinity);
  CHECK(view.displacement(nowhere, before, 4.0) == infinity);
}
