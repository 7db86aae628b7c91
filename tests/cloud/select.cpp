// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include <orbis/cloud/log_statistical.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/cloud/voxel_grid.hpp>

#include "cloud/clouds.hpp"
#include "cloud/room_outliers.hpp"
#include "support/catch.hpp"

using orbis::cloud::choice_status;
using orbis::cloud::filter_automatically;
using orbis::cloud::filter_mode;
using orbis::cloud::threshold_source;
using orbis::test::add_uniform, orbis::test::has_step;

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

std::vector<double> thresholds(const orbis::cloud::filter_choice& choice) {
  std::vector<double> out;
  for (const auto& step : choice.chain) {
    if (const auto* density = std::get_if<orbis::cloud::density_step>(&step)) out.push_back(density->threshold);
  }
  return out;
}

}  // namespace

TEST_CASE("a clean cloud is left nearly whole") {
  for (const double noise : {0.0, 0.001, 0.003}) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
      const auto cloud = orbis::test::room_cloud(200, 150, noise, seed);
      INFO("noise " << noise << " seed " << seed);
      CHECK(score_of(filter_automatically(orbis::par, cloud).inliers, cloud.size(), 0).lost < 0.005);
      const auto ranged = filter_automatically(orbis::par, cloud, {.sensor_origin = orbis::vec3{0, 0, 0}});
      INFO(to_string(ranged.choice.chain));
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
    INFO(percent << " %: " << to_string(result.choice.chain));
    CHECK_FALSE(result.choice.chain.empty());
    const score s = score_of(result.inliers, cloud.size(), outliers);
    CHECK(s.found > 0.85);
    CHECK(s.lost < 0.01);
  }
}

TEST_CASE("the choice is the same under every policy and comes with its evidence") {
  auto cloud = orbis::test::room_cloud(80, 60, 0.002, 7);
  add_uniform(cloud, 200, 8);
  const auto alone = filter_automatically(orbis::seq, cloud);
  CHECK(alone.choice.status == choice_status::complete);
  CHECK(alone.choice.evidence.judged == cloud.size());
  for (const unsigned threads : {2U, 5U}) {
    const auto together = filter_automatically(orbis::par.with(threads), cloud);
    CHECK(together.inliers == alone.inliers);
    CHECK(to_string(together.choice.chain) == to_string(alone.choice.chain));
    CHECK(together.choice.evidence == alone.choice.evidence);
    const auto choice = orbis::cloud::select_filter(orbis::par.with(threads), cloud);
    CHECK(thresholds(choice) == thresholds(alone.choice));
    CHECK(choice.evidence == alone.choice.evidence);
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
  CHECK(choice.evidence.density.front().mode == filter_mode::range_log_statistical);
  CHECK(choice.evidence.range_exponent > 0.5);

  std::vector<float> ranges;
  for (const auto& p : cloud) ranges.push_back(p.norm());
  const auto given = orbis::cloud::select_filter(orbis::seq, cloud, {.ranges = ranges});
  CHECK(to_string(given.chain) == to_string(choice.chain));
  CHECK(given.evidence.density.front().threshold == Approx(choice.evidence.density.front().threshold).epsilon(1e-4));
}

TEST_CASE("automatic selection takes any cloud and never removes most of it") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    const auto result = filter_automatically(orbis::seq, cloud);
    INFO(name << ": " << to_string(result.choice.chain));
    const auto finite = static_cast<std::size_t>(
        std::count_if(cloud.begin(), cloud.end(), [](const auto& p) { return orbis::is_finite(p); }));
    CHECK(result.inliers.size() <= finite);
    CHECK(2 * result.inliers.size() >= finite);
    CHECK(std::is_sorted(result.inliers.begin(), result.inliers.end()));
    CHECK((result.choice.status == choice_status::too_few_points) == (result.choice.evidence.judged < 50));
    if (cloud.size() < 50) CHECK(result.choice.chain.empty());
  }
}

TEST_CASE("each kind of cloud gets the steps that suit it") {
  const auto clean = orbis::test::room_cloud(200, 150, 0.002, 5);
  SECTION("nothing for a plane grid") {
    orbis::test::points grid;
    for (int y = 0; y != 60; ++y)
      for (int x = 0; x != 60; ++x)
        grid.emplace_back(0.01F * static_cast<float>(x), 0.01F * static_cast<float>(y), 1.0F);
    const auto result = filter_automatically(orbis::seq, grid);
    CHECK(result.choice.chain.empty());
    CHECK(result.inliers.size() == grid.size());
    CHECK(result.choice.status == choice_status::complete);
  }
  SECTION("a test of density for uniform outliers") {
    auto cloud = clean;
    add_uniform(cloud, 1500, 9);
    const auto choice = orbis::cloud::select_filter(orbis::seq, cloud);
    CHECK(has_step(choice.chain, filter_mode::log_statistical));
    CHECK(choice.evidence.density.front().source == threshold_source::valley);
    CHECK(choice.evidence.density.front().valley_position == choice.evidence.density.front().threshold);
  }
  SECTION("clusters for what hangs in the air") {
    auto cloud = clean;
    const auto good = cloud.size();
    orbis::random_bits random{3};
    for (int c = 0; c != 5; ++c) {
      const orbis::vec3 middle{0.25 * c - 0.5, -0.3, 1.2 + 0.3 * c};
      for (int i = 0; i != 60; ++i) {
        const double x = random.uniform(-0.02, 0.02);
        const double y = random.uniform(-0.02, 0.02);
        cloud.emplace_back((middle + orbis::vec3{x, y, random.uniform(-0.02, 0.02)}).cast<float>());
      }
    }
    const auto result = filter_automatically(orbis::seq, cloud);
    INFO(to_string(result.choice.chain));
    CHECK(has_step(result.choice.chain, filter_mode::cluster));
    const score s = score_of(result.inliers, cloud.size(), cloud.size() - good);
    CHECK(s.found > 0.95);
    CHECK(s.lost < 0.005);
  }
  SECTION("regions of another density stay") {
    orbis::test::points cloud;
    orbis::random_bits random{4};
    for (const auto& p : clean) {  // a tenth, but all of the middle
      if (p.head<2>().norm() < 0.5F || random.below(10) == 0) cloud.push_back(p);
    }
    const auto result = filter_automatically(orbis::seq, cloud, {.sensor_origin = orbis::vec3{0, 0, 0}});
    INFO(to_string(result.choice.chain));
    CHECK(score_of(result.inliers, cloud.size(), 0).lost < 0.005);
  }
}

TEST_CASE("outliers are found whatever the sensor, and the bounds can fail") {
  double found = 0;
  double lost = 0;
  int cases = 0;
  for (const double noise : {0.001, 0.004}) {
    for (const double percent : {2.0, 10.0}) {
      for (const bool voxels : {false, true}) {
        for (const bool known : {false, true}) {
          auto cloud = orbis::test::room_cloud(160, 120, noise, 31);
          if (voxels) cloud = orbis::cloud::voxel_grid(cloud, {.size = 0.02}).points;
          const auto outliers = static_cast<std::size_t>(percent / 100 * static_cast<double>(cloud.size()));
          add_uniform(cloud, outliers, 32);
          orbis::cloud::select_options options;
          if (known) options.sensor_origin = orbis::vec3{0, 0, 0};
          const auto result = filter_automatically(orbis::par, cloud, options);
          const score s = score_of(result.inliers, cloud.size(), outliers);
          INFO(noise << ' ' << percent << ' ' << voxels << known << ' ' << to_string(result.choice.chain));
          CHECK(s.found > 0.8);
          CHECK(s.lost < 0.02);
          found += s.found;
          lost += s.lost;
          ++cases;
        }
      }
    }
  }
  CHECK(found / cases > 0.92);
  CHECK(lost / cases < 0.003);
}

TEST_CASE("points that are not finite stay where that is asked for") {
  auto cloud = orbis::test::room_cloud(160, 120, 0.002, 11);
  add_uniform(cloud, 900, 12);
  cloud.emplace_back(std::numeric_limits<float>::quiet_NaN(), 0.0F, 1.0F);
  const orbis::cloud::select_options options{.sensor_origin = orbis::vec3{0, 0, 0}};
  const auto automatic = filter_automatically(orbis::par, cloud, options);
  REQUIRE_FALSE(automatic.choice.chain.empty());

  auto keeping = options;
  keeping.non_finite = orbis::cloud::non_finite::keep;
  CHECK(filter_automatically(orbis::seq, cloud, keeping).inliers.size() == automatic.inliers.size() + 1);
}
