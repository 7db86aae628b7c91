// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <vector>

#include <orbis/cloud/detail/select/log_density.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

TEST_CASE("the line over log range is found through outliers") {
  orbis::random_bits random{1};
  std::vector<float> spacing;
  std::vector<float> range;
  for (int i = 0; i != 5000; ++i) {
    range.push_back(static_cast<float>(random.uniform(-0.5, 1.5)));
    const bool outlier = i % 10 == 0;
    spacing.push_back(static_cast<float>(-5.0 + 1.3 * range.back() + 0.1 * random.normal() + (outlier ? 2.0 : 0.0)));
  }
  const auto line = orbis::cloud::detail::fit_log_line(spacing, range);
  REQUIRE(line.has_value());
  CHECK(line->slope == Approx(1.3).margin(0.05));
  CHECK(line->intercept == Approx(-5.0).margin(0.05));
}

TEST_CASE("a line needs points at several ranges and a slope within reason") {
  CHECK_FALSE(orbis::cloud::detail::fit_log_line({}, {}).has_value());
  const std::vector<float> spacing(500, -4.0F);
  CHECK_FALSE(orbis::cloud::detail::fit_log_line(spacing, std::vector<float>(500, 0.3F)).has_value());
  std::vector<float> range;
  std::vector<float> falling;
  for (int i = 0; i != 500; ++i) {
    range.push_back(0.01F * static_cast<float>(i));
    falling.push_back(-0.02F * static_cast<float>(i));
  }
  const auto line = orbis::cloud::detail::fit_log_line(falling, range);
  REQUIRE(line.has_value());
  CHECK(line->slope == 0.0);
}

TEST_CASE("scales of a normal distribution are its standard deviation") {
  orbis::random_bits random{2};
  std::vector<float> values;
  for (int i = 0; i != 20'000; ++i) values.push_back(static_cast<float>(3.0 + 0.2 * random.normal()));
  const auto b = orbis::cloud::detail::fit_bulk(values);
  CHECK(b.median == Approx(3.0).margin(0.01));
  CHECK(b.left_scale == Approx(0.2).epsilon(0.05));
  CHECK(b.right_scale == Approx(0.2).epsilon(0.05));
}

TEST_CASE("a valley is seen between two populations and not beside one") {
  orbis::random_bits random{3};
  std::vector<float> values;
  for (int i = 0; i != 10'000; ++i) values.push_back(static_cast<float>(0.25 * random.normal()));
  CHECK(orbis::cloud::detail::deepest_valley(values, 0.0, 0.6).ratio < 1.6);
  for (int i = 0; i != 1000; ++i) values.push_back(static_cast<float>(2.6 + 0.2 * random.normal()));
  const auto v = orbis::cloud::detail::deepest_valley(values, 0.0, 0.6);
  CHECK(v.ratio > 10);
  CHECK(v.position > 0.9);
  CHECK(v.position < 2.0);
}
