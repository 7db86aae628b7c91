// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <octomap/octomap.h>

#include <orbis/core/random.hpp>
#include <orbis/octree/sensor_model.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;
using orbis::octree::detail::constexpr_log;

namespace {

struct cautious : octomap_probabilities {
  static constexpr double hit = 0.55, miss = 0.48, clamp_min = 0.01, clamp_max = 0.99, occupancy_threshold = 0.65;
};
}  // namespace

static_assert(sensor_model<log_odds<>> && sensor_model<log_odds<double>>);
static_assert(sensor_model<sensor_model_from<cautious>> && sensor_model<sensor_model_from<cautious, double>>);
static_assert(after_hit<log_odds<>>(0.0F) == log_odds<>::hit);

static_assert(constexpr_log(1.0) == 0.0);
static_assert(static_cast<float>(constexpr_log(2.0)) == 0.693147181F);

TEST_CASE("The default sensor model has OctoMap's constants to the last bit") {
  const octomap::OcTree tree{0.1};
  CHECK(log_odds<>::hit == tree.getProbHitLog());
  CHECK(log_odds<>::miss == tree.getProbMissLog());
  CHECK(log_odds<>::clamp_min == tree.getClampingThresMinLog());
  CHECK(log_odds<>::clamp_max == tree.getClampingThresMaxLog());
  CHECK(log_odds<>::occupancy_threshold == tree.getOccupancyThresLog());
}

TEST_CASE("Any sequence of observations gives the log-odds that OctoMap gives") {
  orbis::random_bits random{1};
  for (int run = 0; run != 50; ++run) {
    octomap::OcTree tree{0.1};
    const octomap::OcTreeKey key{32768, 32768, 32768};
    float value = 0.0F;
    for (int i = 0; i != 60; ++i) {
      const bool hit = random.below(3) == 0;
      value = hit ? after_hit<log_odds<>>(value) : after_miss<log_odds<>>(value);
      tree.updateNode(key, hit);
      REQUIRE(value == tree.search(key)->getLogOdds());
      REQUIRE(is_occupied<log_odds<>>(value) == tree.isNodeOccupied(tree.search(key)));
    }
  }
}

TEST_CASE("A value beyond its bound stays until an observation pulls it back") {
  CHECK(after_hit<log_odds<>>(5.0F) == 5.0F);
  CHECK(after_miss<log_odds<>>(5.0F) == log_odds<>::clamp_max);
  CHECK(after_miss<log_odds<>>(-5.0F) == -5.0F);
  CHECK(after_hit<log_odds<>>(-5.0F) == log_odds<>::clamp_min);
}

TEST_CASE("Probability and log-odds are each other's inverse") {
  for (double p = 0.01; p < 1.0; p += 0.01) {
    CHECK(to_probability(static_cast<double>(to_log_odds(p))) == Approx(p).epsilon(1e-6));
  }
  CHECK(to_log_odds(0.5) == 0.0F);
}

TEST_CASE("The compiler works out the log-odds of a probability that the running program does") {
  constexpr float compiled[] = {to_log_odds(0.7),  to_log_odds(0.4),   to_log_odds(0.1192), to_log_odds(0.971),
                                to_log_odds(0.5),  to_log_odds(0.001), to_log_odds(0.49),   to_log_odds(0.51),
                                to_log_odds(0.97), to_log_odds(0.12),  to_log_odds(0.85),   to_log_odds(0.9999)};
  const double probabilities[] = {0.7, 0.4, 0.1192, 0.971, 0.5, 0.001, 0.49, 0.51, 0.97, 0.12, 0.85, 0.9999};
  for (std::size_t i = 0; i != std::size(compiled); ++i) {
    volatile double p = probabilities[i];  // keeps the compiler from working this one out too
    CHECK(compiled[i] == to_log_odds(p));
  }
}

TEMPLATE_TEST_CASE("The model of OctoMap's probabilities is the default model in every type", "", float, double) {
  using from = sensor_model_from<octomap_probabilities, TestType>;
  using written = log_odds<TestType>;
  CHECK(static_cast<float>(from::hit) == static_cast<float>(written::hit));
  CHECK(static_cast<float>(from::miss) == static_cast<float>(written::miss));
  CHECK(static_cast<float>(from::clamp_min) == static_cast<float>(written::clamp_min));
  CHECK(static_cast<float>(from::clamp_max) == static_cast<float>(written::clamp_max));
  CHECK(from::occupancy_threshold == written::occupancy_threshold);
}

TEST_CASE("A model from probabilities has their log-odds") {
  using M = sensor_model_from<cautious>;
  CHECK(M::hit == to_log_odds(0.55));
  CHECK(M::miss == to_log_odds(0.48));
  CHECK(M::clamp_min == to_log_odds(0.01));
  CHECK(M::clamp_max == to_log_odds(0.99));
  CHECK(M::occupancy_threshold == to_log_odds(0.65));
}

TEMPLATE_TEST_CASE("The largest free value is free and the next one is occupied", "", log_odds<>,
                   sensor_model_from<cautious>) {
  CHECK_FALSE(is_occupied<TestType>(largest_free_value<TestType>()));
  CHECK(is_occupied<TestType>(std::nextafter(largest_free_value<TestType>(), 1e9F)));
}

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
