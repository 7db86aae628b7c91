// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/cluster-inl.hpp>
#include <orbis/cloud/detail/point_view.hpp>
#include <orbis/core/execution.hpp>

#include "cloud/clouds.hpp"
#include "cloud/reference.hpp"
#include "support/catch.hpp"

using orbis::cloud::detail::find_nearest;
using orbis::cloud::detail::make_leaves;

TEST_CASE("the nearest point of those that count is the one that brute force finds, ties by index") {
  orbis::test::points cloud = orbis::test::uniform_cloud(3000, 1);
  for (std::size_t i = 0; i != 1000; ++i) cloud.push_back(cloud[3 * i]);  // copies: ties
  cloud.emplace_back(1e25F, 0.0F, 0.0F);                                  // so far that squares overflow
  const auto tree =
      make_leaves(orbis::seq, orbis::cloud::detail::viewed_points{cloud}, std::numeric_limits<std::size_t>::max());
  const orbis::cloud::detail::knn_kernels kernels;
  for (const std::uint32_t every : {1U, 7U, 400U, 3999U}) {
    const auto counts = [&](std::uint32_t index) { return index % every == every - 1; };
    std::size_t wrong = 0;
    for (std::size_t q = 0; q < cloud.size(); q += 37) {
      std::uint32_t best = 0;
      float least = std::numeric_limits<float>::infinity();
      bool any = false;
      for (std::uint32_t i = 0; i != cloud.size(); ++i) {
        const float d = orbis::test::squared(cloud[q], cloud[i]);
        if (!counts(i) || (any && d >= least)) continue;
        best = i;
        least = d;
        any = true;
      }
      const auto found = find_nearest(tree, kernels, {cloud[q].x(), cloud[q].y(), cloud[q].z()},
                                      [&](std::uint32_t place) { return counts(tree.members[place]); });
      REQUIRE(found.found());
      wrong += found.distance_squared == least ? 0 : 1;
      wrong += least == 0 || tree.members[found.place] == best ? 0 : 1;
    }
    CHECK(wrong == 0);
  }
  CHECK_FALSE(find_nearest(tree, kernels, {0, 0, 0}, [](std::uint32_t) { return false; }).found());
}
