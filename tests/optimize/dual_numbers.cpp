// SPDX-License-Identifier: BSD-3-Clause
#include "dual_numbers.hpp"

#include <cmath>
#include <limits>
#include <optional>
#include <type_traits>

#include <Eigen/Geometry>

#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// Value and both derivatives of `f(x, y)` beside numbers and central differences.
template <class F>
void check_derivatives(F&& f, double x, double y) {
  using number = test::dual<2>;
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
          using std::sqrt, std::log;
          return sqrt(a) * b + log(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::sin, std::cos, std::acos;
          return sin(a) * cos(b) + acos(a * b);
        },
        x, y);
    check_derivatives(
        [](auto a, auto b) {
          using std::atan2, std::pow;
          return atan2(a, b) + pow(a, 2.5);
        },
        x, y);
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
  using number = test::dual<3>;
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
  CHECK(v.dot(v).value == Approx(14.0));
}

TEST_CASE("Dual numbers compare by their value and say when they are not finite") {
  using number = test::dual<1>;
  const number a = number::variable(1.0, 0), b(2.0);
  CHECK((a < b && b > a && a <= 1.0 && a == number(1.0) && a != b));
  CHECK(isfinite(a));
  CHECK_FALSE(isfinite(sqrt(number::variable(0.0, 0))));  // the value is, the slope is not
  CHECK_FALSE(isfinite(number(1.0) / number(0.0)));
}
