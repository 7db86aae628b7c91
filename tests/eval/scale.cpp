// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>

#include <orbis/core/random.hpp>
#include <orbis/eval/scale.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

trajectory walk(std::size_t poses, double scale, double noise, std::uint64_t seed) {
  random_bits random(seed);
  trajectory all;
  for (std::size_t i = 0; i != poses; ++i) {
    const double t = static_cast<double>(i) / 30.0;
    const vec3 at(2.0 * std::cos(t), 1.5 * std::sin(1.3 * t), 0.4 * std::sin(0.7 * t));
    all.push_back({t, se3(so3{}, scale * at + noise * vec3(random.normal(), random.normal(), random.normal()))});
  }
  return all;
}

}  // namespace

TEST_CASE("The scale of a trajectory is found with its deviation") {
  const trajectory truth = walk(300, 1.0, 0.0, 1);
  const auto exact = eval::estimate_scale(walk(300, 0.8, 0.0, 1), truth);
  REQUIRE(exact);
  CHECK(exact->scale == Approx(1.25));
  CHECK(exact->deviation < 1e-9);
  CHECK(exact->pairs == 300);
  double squared = 0.0;
  for (std::uint64_t seed = 0; seed != 40; ++seed) {
    const auto noisy = eval::estimate_scale(walk(300, 1.0, 0.01, seed), truth);
    REQUIRE(noisy);
    squared += (noisy->scale - 1.0) * (noisy->scale - 1.0) / (noisy->deviation * noisy->deviation) / 40.0;
  }
  CHECK(squared > 0.3);
  CHECK(squared < 3.0);
}

TEST_CASE("The scale of a short trajectory has no deviation, and that of none is an error") {
  const auto few = eval::estimate_scale(walk(20, 0.5, 0.0, 1), walk(20, 1.0, 0.0, 1));
  REQUIRE(few);
  CHECK(few->scale == Approx(2.0));
  CHECK(std::isinf(few->deviation));
  CHECK_FALSE(eval::estimate_scale({}, walk(20, 1.0, 0.0, 1)));
  CHECK_FALSE(eval::estimate_scale(walk(20, 0.0, 0.0, 1), walk(20, 1.0, 0.0, 1)));
}
