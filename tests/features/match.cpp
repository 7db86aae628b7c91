// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <orbis/features/brute_force-inl.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

TEST_CASE("features, views and ranges of descriptors have a view") {
  const auto f = test::random_features(5, 1);
  const auto both = as_view(f);
  CHECK(both.keypoints.data() == f.keypoints.data());
  CHECK(both.descriptors.data() == f.descriptors.data());
  CHECK(as_view(both).descriptors.data() == f.descriptors.data());
  const auto descriptors_only = as_view(f.descriptors);
  CHECK(descriptors_only.keypoints.empty());
  CHECK(descriptors_only.descriptors.size() == 5);
}

TEST_CASE("stages say what they need") {
  const auto any = [](const candidate&) { return true; };
  static_assert(match_stage<cross_check> && match_stage<decltype(any)> && !match_stage<int>);
  CHECK(stage_needs<cross_check>().reverse);
  CHECK(stage_needs<rotation_consistency>().keypoints);
  const search_needs none_at_all = stage_needs<decltype(any)>();
  CHECK_FALSE((none_at_all.reverse || none_at_all.keypoints));
  const search_needs all = stage_needs<cross_check>() | stage_needs<rotation_consistency>();
  CHECK((all.reverse && all.keypoints));
}

TEST_CASE("any distance and any callable of the right shape can stand in a chain") {
  struct near {
    std::uint32_t operator()(int a, int b) const { return static_cast<std::uint32_t>(std::abs(a - b)); }
  };
  const std::vector<int> q{10, 20, 30, 47};
  const std::vector<int> t{31, 9, 22, 22};
  const auto matches = (brute_force(near{}) | [](const candidate& c) { return c.distance < 10; } | cross_check{})(q, t);
  CHECK(matches == std::vector<match>{{0, 1, 1}, {1, 2, 2}, {2, 0, 1}});
}
