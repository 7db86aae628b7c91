// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include <orbis/cloud/select.hpp>

#include "cloud/clouds.hpp"
#include "support/catch.hpp"

using orbis::cloud::filter_automatically;
using orbis::cloud::filter_mode;

namespace {

struct score {
  double found;  ///< fraction of the outliers that were removed
  double lost;   ///< fraction of the others that were removed
};

/// The last `outliers` points are the outliers.
score score_of(const std::vector<std::uint32_t>& inliers, std::size_t points, std::size_t outliers) {
  const std::size_t good = points - outliers;
  const auto kept_good =
      static_cast<std::size_t>(std::count_if(inliers.begin(), inliers.end(), [&](auto i) { return i < good; }));
  const std::size_t kept_bad = inliers.size() - kept_good;
  return {outliers == 0 ? 1.0 : 1.0 - static_cast<double>(kept_bad) / static_cast<double>(outliers),
          1.0 - static_cast<double>(kept_good) / static_cast<double>(good)};
}

/// Uniform points in the box of a room seen by `room_cloud`.
void add_uniform(orbis::test::points& cloud, std::size_t n, std::uint64_t seed) {
  orbis::random_bits random{seed};
  for (std::size_t i = 0; i != n; ++i) {
    const double x = random.uniform(-1.4, 1.8);
    const double y = random.uniform(-1.1, 1.1);
    cloud.emplace_back(orbis::vec3{x, y, random.uniform(0.4, 3.3)}.cast<float>());
  }
}

}  // namespace

TEST_CASE("a clean cloud is left nearly whole") {
  for (const double noise : {0.0, 0.001, 0.003}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const auto cloud = orbis::test::room_cloud(200, 150, noise, seed);
      INFO("noise " << noise << " seed " << seed);
      CHECK(score_of(filter_automatically(orbis::par, cloud).inliers, cloud.size(), 0).lost < 0.005);
      const auto ranged = filter_automatically(orbis::par, cloud, {.sensor_origin = orbis::vec3{0, 0, 0}});
      INFO(ranged.choice.reason);
      CHECK(score_of(ranged.inliers, cloud.size(), 0).lost < 0.005);
    }
  }
}

TEST_CASE("uniform outliers are found") {
  for (const double percent : {1.0, 5.0, 20.0}) {
    auto cloud = orbis::test::room_cloud(200, 150, 0.002, 5);
    const auto outliers = static_cast<std::size_t>(percent / 100 * static_cast<double>(cloud.size()));
    add_uniform(cloud, outliers, 6);
    const auto result = filter_automatically(orbis::par, cloud, {.sensor_origin = orbis::vec3{0, 0, 0}});
    INFO(percent << " %: " << result.choice.reason);
    CHECK(result.choice.mode != filter_mode::none);
    const score s = score_of(result.inliers, cloud.size(), outliers);
    CHECK(s.found > 0.85);
    CHECK(s.lost < 0.01);
  }
}

TEST_CASE("the choice is the same under every policy and comes with its reason") {
  auto cloud = orbis::test::room_cloud(80, 60, 0.002, 7);
  add_uniform(cloud, 200, 8);
  const auto alone = filter_automatically(orbis::seq, cloud);
  CHECK_FALSE(alone.choice.reason.empty());
  for (const unsigned threads : {2U, 5U}) {
    const auto together = filter_automatically(orbis::par.with(threads), cloud);
    CHECK(together.inliers == alone.inliers);
    CHECK(together.choice.threshold == alone.choice.threshold);
    CHECK(together.choice.reason == alone.choice.reason);
    const auto choice = orbis::cloud::select_filter(orbis::par.with(threads), cloud);
    CHECK(choice.mode == alone.choice.mode);
    CHECK(choice.threshold == alone.choice.threshold);
    CHECK(choice.reason == alone.choice.reason);
  }
}

TEST_CASE("a reference over range wins where spacing depends on range") {
  orbis::test::points cloud;  // a floor, 1.2 m below the camera
  for (int v = 10; v != 100; ++v) {
    for (int u = -60; u != 60; ++u)
      cloud.push_back(orbis::vec3f{0.01F * static_cast<float>(u), 0.01F * static_cast<float>(v), 1.0F} *
                      (120.0F / static_cast<float>(v)));
  }
  const auto choice = orbis::cloud::select_filter(orbis::seq, cloud, {.sensor_origin = orbis::vec3{0, 0, 0}});
  REQUIRE(choice.evidence.range_scale.has_value());
  CHECK(*choice.evidence.range_scale < choice.evidence.global_scale);
  CHECK(choice.reference.slope > 0.5);

  std::vector<float> ranges;
  for (const auto& p : cloud) ranges.push_back(p.norm());
  const auto given = orbis::cloud::select_filter(orbis::seq, cloud, {.ranges = ranges});
  CHECK(given.mode == choice.mode);
  CHECK(given.threshold == Approx(choice.threshold).epsilon(1e-4));
}

TEST_CASE("automatic selection takes any cloud and never removes most of it") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    const auto result = filter_automatically(orbis::seq, cloud);
    INFO(name << ": " << result.choice.reason);
    const auto finite = static_cast<std::size_t>(
        std::count_if(cloud.begin(), cloud.end(), [](const auto& p) { return orbis::is_finite(p); }));
    CHECK(result.inliers.size() <= finite);
    CHECK(2 * result.inliers.size() >= finite);
    CHECK(std::is_sorted(result.inliers.begin(), result.inliers.end()));
    if (cloud.size() < 50) CHECK(result.choice.mode == filter_mode::none);
  }
}

TEST_CASE("a range that is no number costs its point its judgement and nothing else") {
  auto cloud = orbis::test::room_cloud(200, 150, 0.002, 5);
  cloud.emplace_back(0.0F, 0.0F, 9.0F);  // far from everything
  const auto lone = static_cast<std::uint32_t>(cloud.size() - 1);
  std::vector<float> ranges;
  for (const auto& p : cloud) ranges.push_back(p.norm());
  const auto sane = filter_automatically(orbis::seq, cloud, {.ranges = ranges});
  REQUIRE(sane.choice.evidence.range_scale.has_value());
  CHECK_FALSE(std::binary_search(sane.inliers.begin(), sane.inliers.end(), lone));
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    ranges.front() = ranges.back() = bad;
    const auto result = filter_automatically(orbis::seq, cloud, {.ranges = ranges});
    CHECK(result.choice.evidence.judged == sane.choice.evidence.judged - 2);
    CHECK(result.choice.evidence.range_scale.has_value());
    CHECK(std::binary_search(result.inliers.begin(), result.inliers.end(), lone));
  }
}
