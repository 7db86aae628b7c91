// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <variant>
#include <vector>

#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/select_by_views-inl.hpp>
#include <orbis/core/random.hpp>

#include "cloud/clouds.hpp"
#include "cloud/room_outliers.hpp"
#include "cloud/views.hpp"
#include "support/catch.hpp"

using orbis::cloud::filter_automatically;
using orbis::cloud::filter_mode;
using orbis::cloud::threshold_source;
using orbis::test::add_uniform, orbis::test::has_step;

namespace {

/// Checks that each step of the chain has a share of removed points in the evidence, and each share a step.
void check_shares(const orbis::cloud::filter_choice& choice) {
  const auto& e = choice.evidence;
  CHECK(has_step(choice.chain, filter_mode::ray_evidence) == (e.passed_through + e.unsupported > 0));
  CHECK(has_step(choice.chain, filter_mode::isolation) == (e.isolated > 0));
  CHECK(has_step(choice.chain, filter_mode::cluster) == (e.clustered > 0));
  std::vector<filter_mode> in_chain, in_evidence;
  for (const auto& step : choice.chain)
    if (std::holds_alternative<orbis::cloud::density_step>(step)) in_chain.push_back(step_mode(step));
  for (const auto& d : e.density) {
    CHECK((d.source == threshold_source::none) == std::isinf(d.threshold));
    if (d.removed > 0) in_evidence.push_back(d.mode);
  }
  CHECK(in_chain == in_evidence);
}

}  // namespace

TEST_CASE("each step of a choice has its share of the evidence") {
  for (const auto& [name, cloud] : orbis::test::all_clouds()) {
    INFO(name);
    check_shares(filter_automatically(orbis::seq, cloud).choice);
  }
  auto cloud = orbis::test::room_cloud(80, 60, 0.002, 7);
  add_uniform(cloud, 200, 8);
  check_shares(filter_automatically(orbis::seq, cloud, {.sensor_origin = orbis::vec3{0, 0, 0}}).choice);
  const auto seen = orbis::test::walked_past_wall();
  const auto by_views = filter_automatically(orbis::par, seen.points, seen.views(), seen.camera);
  CHECK(by_views.choice.evidence.passed_through > 0);
  check_shares(by_views.choice);
}

TEST_CASE("holes in a cloud change neither the choice nor the shares it is explained with") {
  auto cloud = orbis::test::room_cloud(80, 60, 0.002, 7);
  add_uniform(cloud, 200, 8);
  const auto whole = filter_automatically(orbis::seq, cloud);
  REQUIRE(whole.choice.evidence.density.front().removed > 0.03);
  auto holed = cloud;
  holed.resize(5 * cloud.size(), orbis::vec3f::Constant(std::numeric_limits<float>::quiet_NaN()));
  const auto result = filter_automatically(orbis::seq, holed);
  CHECK(result.inliers == whole.inliers);
  CHECK(result.choice.evidence.points == holed.size());
  CHECK(result.choice.evidence.finite == cloud.size());
  auto expected = whole.choice.evidence;
  expected.points = holed.size();
  CHECK(result.choice.evidence == expected);
}

TEST_CASE("a range that is no number costs its point its judgement by range and nothing else") {
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
    CHECK(std::binary_search(result.inliers.begin(), result.inliers.end(), 0U));
    CHECK_FALSE(std::binary_search(result.inliers.begin(), result.inliers.end(), lone));  // its surroundings say so
  }
}
