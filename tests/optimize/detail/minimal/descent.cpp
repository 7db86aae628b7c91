// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <optional>

#include <orbis/optimize/detail/minimal/descent.hpp>

#include "support/catch.hpp"

using orbis::optimize::detail::descend;

namespace {

struct equations {
  double slope = 0.0, cost = 0.0;
};

/// The residual x^2 - 2.
equations square_root_of_two(double x) {
  const double r = x * x - 2.0;
  return {r / (2.0 * x), r * r};
}

}  // namespace

TEST_CASE("Gauss-Newton on one unknown goes to the root, and stops where it is told") {
  int asked = 0;
  const auto step = [&](double x, const equations& e) {
    ++asked;
    return std::optional<double>{x - e.slope};
  };
  const auto found = descend(3.0, 20, square_root_of_two, step);
  REQUIRE(found);
  CHECK(*found == Approx(std::sqrt(2.0)).epsilon(1e-14));
  CHECK(asked < 9);
  asked = 0;
  CHECK(*descend(3.0, 1, square_root_of_two, step) == Approx(3.0 - 7.0 / 6.0));
  CHECK(asked == 1);
  CHECK(*descend(3.0, 0, square_root_of_two, step) == 3.0);
}

TEST_CASE("Steps that do not improve are not taken, nor any from a start without a cost") {
  const auto away = [](double x, const equations&) { return std::optional<double>{x + 1.0}; };
  CHECK(*descend(2.0, 20, square_root_of_two, away) == 2.0);
  const auto none = [](double, const equations&) { return std::optional<double>{}; };
  CHECK(*descend(2.0, 20, square_root_of_two, none) == 2.0);
  const auto nowhere = [](double) { return equations{0.0, std::numeric_limits<double>::infinity()}; };
  CHECK_FALSE(descend(2.0, 20, nowhere, away));
}
