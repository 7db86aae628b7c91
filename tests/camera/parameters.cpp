// SPDX-License-Identifier: BSD-3-Clause
#include <limits>

#include <orbis/camera/any.hpp>
#include <orbis/camera/parameters.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

constexpr camera::intrinsics k{.width = 640, .height = 480, .fx = 517.3, .fy = 510.5, .cx = 318.6, .cy = 255.3};
constexpr double nan = std::numeric_limits<double>::quiet_NaN();

/// The pixel does not depend on how the camera came to be; derivatives against central differences of
/// `with`, whose steps are a share of each parameter's range.
template <camera::parametric_camera Camera>
void check(const Camera& c) {
  using parameters = camera::parameters_of<Camera>;
  constexpr int count = parameters::count;
  const auto p = parameters::get(c);
  REQUIRE(parameters::with(c, p));
  CHECK(*parameters::with(c, p) == c);

  for (int i = 0; i != count; ++i)
    for (const double bad : {nan, std::numeric_limits<double>::infinity(), i < 2 ? 0.0 : nan, i < 2 ? -3.0 : nan}) {
      auto other = p;
      other[i] = bad;
      CHECK_FALSE(parameters::with(c, other));
    }

  random_bits random(5);
  for (int trial = 0; trial != 40; ++trial) {
    const double z = random.uniform(0.5, 4.0);
    vec3 point(random.uniform(-0.55, 0.55) * z, random.uniform(-0.45, 0.45) * z, z);
    if (trial == 0) point = vec3(0.0, 0.0, z);
    if (trial == 1) point = vec3(1e-12, -1e-12, z);
    matrix<2, 3> by_point, expected;
    matrix<2, count> by_parameters;
    const auto pixel = parameters::project(c, point, by_point, by_parameters);
    REQUIRE(pixel);
    CHECK(*pixel == *c.project(point, expected));
    CHECK(by_point == expected);
    for (int i = 0; i != count; ++i) {
      const double h = i < 4 ? 1e-2 : 1e-4;
      const auto at = [&](double step) {
        auto moved = p;
        moved[i] += step;
        return *parameters::with(c, moved)->project(point);
      };
      const vec2 numeric = (8.0 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12.0 * h);
      CHECK((by_parameters.col(i) - numeric).norm() <= 1e-7 * (1.0 + by_parameters.col(i).norm()));
    }
  }
  matrix<2, 3> by_point = matrix<2, 3>::Constant(7.0);
  matrix<2, count> by_parameters = matrix<2, count>::Constant(7.0);
  CHECK_FALSE(parameters::project(c, vec3(0.1, 0.2, -1.0), by_point, by_parameters));
  CHECK_FALSE(parameters::project(c, vec3(nan, 0.2, 1.0), by_point, by_parameters));
  CHECK((by_point.array() == 7.0).all());
  CHECK((by_parameters.array() == 7.0).all());
}

}  // namespace

TEST_CASE("The parameters of a camera can be read, changed and differentiated by") {
  check(camera::pinhole{k});
  check(camera::radial_tangential{k, {.k1 = 0.26, .k2 = -0.55, .p1 = -0.005, .p2 = 0.003, .k3 = 0.66}});
  check(camera::radial_tangential{
      k, {.k1 = 0.4, .k2 = 0.1, .p1 = 0.001, .p2 = -0.002, .k3 = 0.02, .k4 = 0.3, .k5 = 0.05, .k6 = 0.01}});
  check(camera::kannala_brandt{k, {.k1 = -0.03, .k2 = 0.01, .k3 = -0.02, .k4 = 0.004}});
  STATIC_REQUIRE_FALSE(camera::parametric_camera<camera::any_camera>);  // how many there are is known at run time only
}
