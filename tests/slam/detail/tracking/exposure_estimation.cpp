// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <cstddef>

#include <orbis/slam/detail/tracking/exposure_estimation.hpp>

#include "support/catch.hpp"

using orbis::slam::detail::exposure_estimation;

namespace {

/// Correlations that are largest at `exposure`.
std::array<double, exposure_estimation::count> around(double exposure) {
  std::array<double, exposure_estimation::count> made;
  for (std::size_t i = 0; i != made.size(); ++i)
    made[i] = 0.98 - 100.0 * std::pow(exposure_estimation::candidate(i) - exposure, 2.0);
  return made;
}

}  // namespace

TEST_CASE("The exposure is that of the best correlation, once there is evidence") {
  for (const double exposure : {0.006, 0.0139, 0.025, 0.03}) {
    exposure_estimation e;
    CHECK(e.exposure() == 0.0);
    for (int k = 0; k != 340; ++k) e.add(around(exposure));
    CHECK_FALSE(e.has_enough());
    CHECK(e.exposure() == 0.0);
    for (int k = 0; k != 40; ++k) e.add(around(exposure));
    CHECK(e.has_enough());
    CHECK(std::abs(e.exposure() - exposure) < 1e-4);
  }
}

TEST_CASE("Sharp images have no exposure time") {
  exposure_estimation e;
  for (int k = 0; k != 1000; ++k) e.add(around(0.0));
  CHECK(e.exposure() == 0.0);
  exposure_estimation nearly;  // a gain within the noise
  for (int k = 0; k != 1000; ++k) nearly.add(around(0.001));
  CHECK(nearly.exposure() == 0.0);
}

TEST_CASE("The estimate follows automatic exposure") {
  exposure_estimation e;
  for (int k = 0; k != 5000; ++k) e.add(around(0.008));
  for (int k = 0; k != 5000; ++k) e.add(around(0.024));
  CHECK(std::abs(e.exposure() - 0.024) < 0.001);
}
