// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>

#include <orbis/camera/detail/monotonic.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using namespace orbis::camera::detail;

namespace {

/// The coefficients of the product of (x - r) over all roots.
template <std::size_t N>
std::array<double, N + 1> with_roots(const std::array<double, N>& roots) {
  std::array<double, N + 1> c{1.0};
  for (const double r : roots) {
    for (std::size_t i = N; i > 0; --i) c[i] = c[i - 1] - r * c[i];
    c[0] *= -r;
  }
  return c;
}

}  // namespace

TEST_CASE("the smallest positive root of a polynomial is found among others") {
  CHECK(smallest_positive_root(std::array{-2.0, 1.0}) == Approx(2.0));
  CHECK(smallest_positive_root(with_roots(std::array{3.0, 1.0, 2.0})) == Approx(1.0));
  CHECK(smallest_positive_root(with_roots(std::array{-3.0, -1.0, 2.0, -7.0})) == Approx(2.0));
  orbis::random_bits random{5};
  for (int i = 0; i != 200; ++i) {
    std::array<double, 6> roots{};
    double smallest = std::numeric_limits<double>::infinity();
    for (double& r : roots) {
      r = random.uniform(-1.0, 1.5);
      if (r > 0.0) smallest = std::min(smallest, r);
    }
    const double found = smallest_positive_root(with_roots(roots));
    if (std::isinf(smallest)) {
      CHECK(std::isinf(found));
    } else {
      CHECK(found == Approx(smallest).epsilon(1e-6));
    }
  }
}

TEST_CASE("a polynomial that keeps its sign has no root") {
  CHECK(std::isinf(smallest_positive_root(std::array{1.0})));
  CHECK(std::isinf(smallest_positive_root(std::array{1.0, 0.0, 0.0, 0.0})));
  CHECK(std::isinf(smallest_positive_root(std::array{1.0, 2.0, 3.0})));
  CHECK(std::isinf(smallest_positive_root(std::array{1.0, -1.0, 1.0})));
  CHECK(std::isinf(smallest_positive_root(with_roots(std::array{-1.0, -2.0}))));
  CHECK(smallest_positive_root(std::array{1.0, -1.0, 0.0, 0.0}) == Approx(1.0));  // leading zeros
}

TEST_CASE("a growing function is inverted up to its end and not beyond") {
  const auto cubic = [](double x) { return std::pair{x + x * x * x, 1.0 + 3.0 * x * x}; };
  const double inf = std::numeric_limits<double>::infinity();
  for (const double x : {0.0, 1e-9, 0.1, 1.0, 100.0})
    CHECK(*invert_growing(cubic, cubic(x).first, inf) == Approx(x).epsilon(1e-13).margin(1e-15));
  CHECK(*invert_growing(cubic, cubic(0.999).first, 1.0) == Approx(0.999).epsilon(1e-12));
  CHECK(!invert_growing(cubic, cubic(1.001).first, 1.0));
  CHECK(!invert_growing(cubic, -1.0, inf));
  CHECK(!invert_growing(cubic, std::nan(""), inf));
  CHECK(!invert_growing(cubic, inf, inf));
  const auto saturated = [](double x) { return std::pair{x / (1.0 + x), 1.0 / ((1.0 + x) * (1.0 + x))}; };
  CHECK(!invert_growing(saturated, 2.0, inf));
  CHECK(*invert_growing(saturated, 0.5, inf) == Approx(1.0));
}
