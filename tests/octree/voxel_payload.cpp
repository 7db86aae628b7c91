// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/voxel_payload.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;
using orbis::rgb8;

static_assert(voxel_payload<rgb_mean> && voxel_payload<label_votes<>> && voxel_payload<hit_count>);
static_assert(sizeof(rgb_mean) == 8 && sizeof(label_votes<>) == 4 && sizeof(hit_count) == 4);

namespace {

rgb8 random_color(orbis::random_bits& random, std::uint32_t low, std::uint32_t high) {
  const auto c = [&] { return static_cast<std::uint8_t>(low + random.below(high - low + 1)); };
  return {c(), c(), c()};
}

}  // namespace

TEST_CASE("A mean colour is exact over its first 257 observations") {
  orbis::random_bits random{1};
  for (int run = 0; run != 20; ++run) {
    rgb_mean mean;
    CHECK(mean.color() == rgb8{});
    std::array<double, 3> sum{};
    for (int n = 1; n != 258; ++n) {
      const rgb8 c = run == 0 ? rgb8{255, 255, 255} : random_color(random, 0, 255);
      mean.update(c);
      sum[0] += c.r;
      sum[1] += c.g;
      sum[2] += c.b;
      REQUIRE(mean.count() == static_cast<std::uint32_t>(n));
      REQUIRE(mean.color().r == static_cast<int>(std::floor(sum[0] / n + 0.5)));
      REQUIRE(mean.color().g == static_cast<int>(std::floor(sum[1] / n + 0.5)));
      REQUIRE(mean.color().b == static_cast<int>(std::floor(sum[2] / n + 0.5)));
    }
  }
}

TEST_CASE("A mean colour of many observations stays near their mean and follows a change") {
  orbis::random_bits random{2};
  rgb_mean mean;
  for (int i = 0; i != 100000; ++i) {
    mean.update(random_color(random, 90, 110));
    REQUIRE(mean.count() <= 257);
    if (i > 257) REQUIRE(std::abs(mean.color().g - 100) <= 3);
  }
  for (int i = 0; i != 2000; ++i) mean.update({255, 0, 7});
  CHECK(mean.color() == rgb8{255, 0, 7});
  for (int i = 0; i != 100000; ++i) mean.update({255, 255, 255});
  CHECK(mean.color() == rgb8{255, 255, 255});
}

TEST_CASE("The label of more than half of the observations wins whatever their order") {
  orbis::random_bits random{3};
  int majorities = 0;
  for (int run = 0; run != 2000; ++run) {
    std::map<std::uint16_t, int> naive;
    label_votes<> votes;
    CHECK_FALSE(votes.label().has_value());
    const std::uint32_t n = 1 + random.below(60), favour = random.below(4);
    for (std::uint32_t i = 0; i != n; ++i) {
      const auto label = static_cast<std::uint16_t>(random.below(4) < favour ? 1000 : random.below(5));
      ++naive[label];
      votes.update(label);
    }
    for (const auto& [label, count] : naive)
      if (2 * count > static_cast<int>(n)) {
        ++majorities;
        REQUIRE(votes.label() == label);
        REQUIRE(votes.votes() >= 2 * count - static_cast<int>(n));
      }
  }
  CHECK(majorities > 500);
}

TEST_CASE("Counters stop at their end instead of starting again") {
  label_votes<std::uint8_t> votes;
  for (int i = 0; i != 1000; ++i) votes.update(7);
  CHECK(votes.label() == 7);
  CHECK(votes.votes() == 255);
  votes.update(8);
  CHECK(votes.votes() == 254);
  hit_count hits;
  for (int i = 0; i != 1000; ++i) hits.update();
  CHECK(hits.count() == 1000);
}
