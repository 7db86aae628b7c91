// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>

#include <orbis/core/random.hpp>
#include <orbis/octree/detail/storage/constexpr_log.hpp>

#include "support/catch.hpp"

using orbis::octree::detail::constexpr_log;

static_assert(constexpr_log(1.0) == 0.0);
static_assert(static_cast<float>(constexpr_log(2.0)) == 0.693147181F);

TEST_CASE("The logarithm is right to three units in the last place and rounds to std::log's float") {
  orbis::random_bits random{3};
  const auto check = [](double x) {
    const double ours = constexpr_log(x), theirs = std::log(x);
    const double ulp = std::abs(theirs) * std::numeric_limits<double>::epsilon();
    REQUIRE(std::abs(ours - theirs) <= 3.0 * ulp);
    REQUIRE(static_cast<float>(ours) == static_cast<float>(theirs));
  };
  for (int i = 0; i != 200000; ++i) {
    check(std::exp(random.uniform(-700.0, 700.0)));
    check(std::exp(random.uniform(-5.0, 5.0)));  // odds of sensor models
    check(1.0 + random.uniform(-1.0, 1.0) * std::exp(-random.uniform(0.0, 30.0)));
  }
  for (const double x : {std::numeric_limits<double>::min(), std::numeric_limits<double>::max(), 1.4142135623730951,
                         std::nextafter(1.4142135623730951, 2.0), std::nextafter(1.0, 0.0), std::nextafter(1.0, 2.0)})
    check(x);
}
