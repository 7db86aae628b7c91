// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/octree/sensor_model.hpp>

#include "octree/support.hpp"
#include "support/catch.hpp"

using namespace orbis::octree;

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
  for (double p = 0.01; p < 1.0; p += 0.01)
    CHECK(probability_of(static_cast<double>(log_odds_of(p))) == Approx(p).epsilon(1e-6));
  CHECK(log_odds_of(0.5) == 0.0F);
}
