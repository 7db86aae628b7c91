// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/optimize/detail/minimal/real_roots.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("The real roots of polynomials are found, wherever they lie") {
  random_bits random(1);
  for (int trial = 0; trial != 2000; ++trial) {
    // Three pairs of complex roots and four real ones, some of them large.
    std::array<double, 11> c{1.0};
    std::size_t degree = 0;
    std::vector<double> expected;
    const auto times = [&](std::vector<double> factor) {
      std::array<double, 11> product{};
      for (std::size_t i = 0; i <= degree; ++i)
        for (std::size_t j = 0; j != factor.size(); ++j) product[i + j] += c[i] * factor[j];
      c = product;
      degree += factor.size() - 1;
    };
    for (int k = 0; k != 3; ++k) {
      const double re = random.uniform(-2, 2), im = random.uniform(0.3, 2);
      times({re * re + im * im, -2.0 * re, 1.0});
    }
    for (int k = 0; k != 4; ++k) {
      expected.push_back((k == 0 ? 30.0 : 1.0) * random.uniform(0.1, 1.0) + (k - 2.0) * 2.0);
      times({-expected.back(), 1.0});
    }
    std::array<double, 10> roots{};
    const std::size_t count = optimize::detail::real_roots<10>(c, roots);
    std::sort(expected.begin(), expected.end());
    std::sort(roots.begin(), roots.begin() + static_cast<std::ptrdiff_t>(count));
    REQUIRE(count == 4);
    for (std::size_t k = 0; k != 4; ++k) CHECK(roots[k] == Approx(expected[k]).epsilon(1e-5));
  }
}
