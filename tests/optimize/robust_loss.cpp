// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/optimize/robust_loss.hpp>

#include "support/catch.hpp"

namespace {

template <class Loss>
void check_loss(const Loss& loss) {
  REQUIRE(loss.cost(0.0) == 0.0);
  REQUIRE(loss.weight(0.0) == 1.0);
  double previous_weight = 1.0;
  double previous_cost = 0.0;
  for (double s = 0.01; s < 50.0; s += 0.37) {
    const double h = 1e-6;
    const double slope = (loss.cost(s + h) - loss.cost(s - h)) / (2.0 * h);
    CHECK(loss.weight(s) == Approx(slope).margin(1e-6));
    CHECK(loss.weight(s) <= previous_weight);
    CHECK(loss.cost(s) >= previous_cost);
    CHECK(loss.cost(s) <= s);
    previous_weight = loss.weight(s);
    previous_cost = loss.cost(s);
  }
}

}  // namespace

TEST_CASE("The weight of every loss is the slope of its cost and never grows") {
  check_loss(orbis::optimize::trivial{});
  check_loss(orbis::optimize::huber{2.45});
  check_loss(orbis::optimize::cauchy{1.5});
  check_loss(orbis::optimize::tukey{4.0});
}

TEST_CASE("Widths of losses are in unsquared units") {
  const orbis::optimize::huber h{3.0};
  CHECK(h.weight(8.99) == 1.0);
  CHECK(h.weight(36.0) == Approx(0.5));
  CHECK(h.cost(36.0) == Approx(2.0 * 3.0 * 6.0 - 9.0));
  const orbis::optimize::tukey t{3.0};
  CHECK(t.weight(9.0) == 0.0);
  CHECK(t.weight(1e300) == 0.0);
  CHECK(t.cost(1e300) == Approx(3.0));
  CHECK(orbis::optimize::cauchy{2.0}.weight(4.0) == Approx(0.5));
}

TEST_CASE("Gates are the quantiles of 95 percent of chi-squared") {
  // Of one degree of freedom the distribution is that of a squared normal, of two it is 1 - exp(-x / 2).
  CHECK(std::erf(std::sqrt(0.5 * orbis::optimize::chi_squared_gate(1))) == Approx(0.95).margin(1e-4));
  CHECK(1.0 - std::exp(-0.5 * orbis::optimize::chi_squared_gate(2)) == Approx(0.95).margin(1e-4));
  const double x = orbis::optimize::chi_squared_gate(3);
  const double three = std::erf(std::sqrt(0.5 * x)) - std::sqrt(2.0 * x / std::acos(-1.0)) * std::exp(-0.5 * x);
  CHECK(three == Approx(0.95).margin(1e-4));
}
