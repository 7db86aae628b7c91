// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/eval/cloud_error.hpp>

#include "support/catch.hpp"

namespace eval = orbis::eval;
using orbis::vec3f;

TEST_CASE("points beside a sphere are as far from it as they are") {
  std::vector<vec3f> points;
  for (int i = 0; i != 20000; ++i) {
    const double a = 0.1 * i, b = 0.37 * i, r = 2.0 + (i % 4 == 0 ? 0.05 : i % 4 == 1 ? -0.01 : 0.0);
    points.push_back(
        (r * orbis::vec3(std::cos(a) * std::cos(b), std::sin(a) * std::cos(b), std::sin(b))).cast<float>());
  }
  points.push_back(vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  const auto sphere = [](const orbis::vec3& p) { return p.norm() - 2.0; };
  const auto error = eval::cloud_to_surface(orbis::seq, points, sphere, {.tolerance = 0.02}).value();
  CHECK(error.skipped == 1);
  CHECK(error.distance.count == 20000);
  CHECK(error.percent_within == Approx(75.0));
  CHECK(error.distance.mean == Approx(0.015).epsilon(1e-4));
  CHECK(error.distance.max == Approx(0.05).epsilon(1e-4));
  CHECK(error.distance.p95 == Approx(0.05).epsilon(1e-4));
  CHECK(error.distance.rmse == Approx(std::sqrt((0.0025 + 0.0001) / 4.0)).epsilon(1e-4));
  const auto parallel = eval::cloud_to_surface(orbis::par.with(3), points, sphere, {.tolerance = 0.02}).value();
  CHECK(parallel.distance.mean == error.distance.mean);
  CHECK(parallel.distance.rmse == error.distance.rmse);
}

TEST_CASE("a cloud without a finite point has no error") {
  const auto zero = [](const orbis::vec3&) { return 0.0; };
  CHECK(eval::cloud_to_surface(orbis::seq, std::vector<vec3f>{}, zero).error().code == orbis::errc::no_data);
  const std::vector<vec3f> nan{vec3f::Constant(std::numeric_limits<float>::quiet_NaN())};
  CHECK(eval::cloud_to_surface(orbis::seq, nan, zero).error().code == orbis::errc::no_data);
}
