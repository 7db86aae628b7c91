// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

#include <Eigen/Geometry>

#include <orbis/core/random.hpp>
#include <orbis/optimize/automatic_residual.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("Cameras that are vectors can be estimated") {
  // A camera of three numbers: its centre. The residual is the direction to the point.
  const auto direction = []<class S>(const matrix<3, 1, S>& centre, const matrix<3, 1, S>& point,
                                     const optimize::bundle_observation&) {
    return matrix<3, 1, S>((point - centre).normalized());
  };
  const optimize::automatic_bundle_residual residual{direction, optimize::euclidean<3>{}};
  static_assert(optimize::bundle_residual<std::decay_t<decltype(residual)>>);
  const vec3 centre(0.3, -0.2, 0.1), point(1.0, 2.0, 3.0);
  mat3 by_camera = mat3::Zero(), by_point = mat3::Zero();
  const auto r = residual.linearize(centre, point, {}, by_camera, by_point);
  REQUIRE(r);
  CHECK((*r - *residual.residual(centre, point, {})).norm() < 1e-14);
  for (int i = 0; i != 3; ++i) {
    const vec3 h = 1e-6 * vec3::Unit(i);
    const vec3 slope = (*residual.residual(centre, point + h, {}) - *residual.residual(centre, point - h, {})) / 2e-6;
    CHECK((slope - by_point.col(i)).norm() < 1e-8);
    CHECK((slope + by_camera.col(i)).norm() < 1e-8);
  }
}

TEST_CASE("A residual that has no value, or none that is finite, is empty and leaves the Jacobians alone") {
  const optimize::automatic_bundle_residual sometimes{
      []<class S>(const matrix<3, 1, S>&, const matrix<3, 1, S>& v,
                  const optimize::bundle_observation&) -> std::optional<matrix<3, 1, S>> {
        if (optimize::value_of(v.x()) < 0.0) return std::nullopt;
        return v;
      },
      optimize::euclidean<3>{}};
  const vec3 camera = vec3::Zero();
  mat3 by_camera = mat3::Constant(7.0), by_point = by_camera;
  CHECK_FALSE(sometimes.residual(camera, vec3(-1, 0, 0), {}));
  CHECK_FALSE(sometimes.linearize(camera, vec3(-1, 0, 0), {}, by_camera, by_point));
  CHECK(by_point == mat3::Constant(7.0));
  CHECK(by_camera == mat3::Constant(7.0));
  CHECK(sometimes.linearize(camera, vec3(1, 0, 0), {}, by_camera, by_point));
  CHECK(by_point == mat3::Identity());
  CHECK(by_camera == mat3::Zero());
  const optimize::automatic_bundle_residual root{
      []<class S>(const matrix<3, 1, S>&, const matrix<3, 1, S>& v, const optimize::bundle_observation&) {
        using std::sqrt;
        matrix<3, 1, S> out = v;
        out.x() = sqrt(v.x());
        return out;
      },
      optimize::euclidean<3>{}};
  CHECK(root.residual(camera, vec3(0, 1, 1), {}));
  CHECK_FALSE(root.linearize(camera, vec3(0, 1, 1), {}, by_camera, by_point));  // the slope at 0
  CHECK_FALSE(root.residual(camera, vec3(-1, 1, 1), {}));
  CHECK_FALSE(root.residual(camera, vec3(std::numeric_limits<double>::quiet_NaN(), 1, 1), {}));
}

namespace {

/// Value and both derivatives of `f(x, y)` beside numbers and central differences.
template <class F>
void check_derivatives(F&& f, double x, double y) {
  using number = optimize::dual<2>;
  const number result = f(number::variable(x, 0), number::variable(y, 1));
  CHECK(result.value == f(x, y));
  const double h = 1e-6;
  const double by_x = (f(x + h, y) - f(x - h, y)) / (2 * h), by_y = (f(x, y + h) - f(x, y - h)) / (2 * h);
  CHECK(std::abs(result.slope[0] - by_x) <= 1e-7 * (1.0 + std::abs(by_x)));
  CHECK(std::abs(result.slope[1] - by_y) <= 1e-7 * (1.0 + std::abs(by_y)));
}

}  // namespace

TEST_CASE("Dual numbers differentiate every function") {
  random_bits random(3);
  for (int trial = 0; trial != 40; ++trial) {
    const double x = random.uniform(0.1, 0.9), y = random.uniform(0.1, 0.9);
    check_derivatives([](auto a, auto b) { return a + 2.0 * b - a * b * 3.0 + b / a - (-a) + (+b) + 1.0 / b - 0.5; }, x,
                      y);
    check_derivatives(
        [](auto a, auto b) {
          using std::sqrt, std::exp, std::log;
          return sqrt(a) * exp(b) + log(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::sin, std::cos, std::tan;
          return sin(a) * cos(b) + tan(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::asin, std::acos, std::atan;
          return asin(a) + acos(b) * atan(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::sinh, std::cosh, std::tanh;
          return sinh(a) + cosh(b) * tanh(a - b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::atan2, std::hypot;
          return atan2(a, b) + hypot(a, b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::pow;
          return pow(a, 2.5) + pow(a, b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::abs, std::log1p;
          return abs(a - 2.0 * b) + log1p(a);
        },
        x, y + 1.0);
    check_derivatives(
        [](auto a, auto b) {
          using std::min, std::max;
          return min(a, b) * max(a, b) * max(a, b);
        },
        x, y + 1.0);
    check_derivatives(
        [](auto a, auto b) {
          a += b;
          a *= b;
          a -= 0.3 * b;
          a /= b + 1.0;
          return a;
        },
        x, y);
  }
}

TEST_CASE("Dual numbers are scalars to Eigen") {
  using number = optimize::dual<3>;
  matrix<3, 1, number> v;
  for (int i = 0; i != 3; ++i) v[i] = number::variable(i + 1.0, i);
  const number n = v.norm();
  CHECK(n.value == Approx(std::sqrt(14.0)));
  for (int i = 0; i != 3; ++i) CHECK(n.slope[i] == Approx((i + 1.0) / std::sqrt(14.0)));
  mat3 m;
  m << 1, 2, 3, 4, 5, 6, 7, 8, 10;
  const matrix<3, 1, number> w = m.cast<number>() * v * 2.0;
  for (int r = 0; r != 3; ++r)
    for (int c = 0; c != 3; ++c) CHECK(w[r].slope[c] == Approx(2.0 * m(r, c)));
  const matrix<3, 1, number> u = v.normalized().cross(w);
  CHECK(isfinite(u[0]));
  CHECK(optimize::value_of(v.dot(v)) == Approx(14.0));
}

TEST_CASE("Dual numbers compare by their value and say when they are not finite") {
  using number = optimize::dual<1>;
  const number a = number::variable(1.0, 0), b(2.0);
  CHECK((a < b && b > a && a <= 1.0 && a == number(1.0) && a != b));
  CHECK(isfinite(a));
  CHECK_FALSE(isfinite(sqrt(number::variable(0.0, 0))));  // the value is, the slope is not
  CHECK(isnan(log(number(-1.0))));
  CHECK(isinf(number(1.0) / number(0.0)));
}
