// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <orbis/core/rounded.hpp>

#include "support/catch.hpp"

// Build with -march=native, or for ARM, to see these fail with plain products.
TEST_CASE("A rounded product that is summed is rounded first") {
  volatile double epsilon = std::numeric_limits<double>::epsilon();
  const double a = 1.0 + epsilon, b = 1.0 - epsilon;  // the product is 1 - epsilon^2
  CHECK(orbis::rounded_product(a, b) - 1.0 == 0.0);
  volatile float small = std::numeric_limits<float>::epsilon();
  CHECK(orbis::rounded_product(1.0F + small, 1.0F - small) - 1.0F == 0.0F);
}

TEST_CASE("Rounded products in a loop that vectorises are rounded first") {
  volatile float small = std::numeric_limits<float>::epsilon();
  std::array<float, 4> a{}, b{}, sum{};
  for (std::size_t i = 0; i != 4; ++i) {
    a[i] = 1.0F + small;
    b[i] = 1.0F - small;
  }
  for (std::size_t i = 0; i != 4; ++i) sum[i] = -1.0F + orbis::rounded_product(a[i], b[i]);
  CHECK(sum == std::array<float, 4>{});
}

using namespace orbis;

TEST_CASE("the sine of turns agrees with the library's") {
  for (int i = -4000; i <= 4000; ++i) {
    const double turns = i * 0.00137;
    CHECK(std::abs(sin_turns(turns) - std::sin(2.0 * std::numbers::pi * turns)) < 1e-13);
    CHECK(std::abs(cos_turns(turns) - std::cos(2.0 * std::numbers::pi * turns)) < 1e-13);
  }
  CHECK(sin_turns(0.0) == 0.0);
}
