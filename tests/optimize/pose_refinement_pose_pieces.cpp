// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <orbis/optimize/pose_refinement-inl.hpp>

#include "optimize/support.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::pose_observation;
using optimize::detail::pose_lanes;
using optimize::detail::pose_pieces;

TEST_CASE("Observations stand in their lanes, whether they fit or come piece by piece") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const std::size_t n : {std::size_t{0}, std::size_t{5}, std::size_t{1024}, std::size_t{2500}}) {
    random_bits random(n);
    std::vector<pose_observation> seen(n);
    std::vector<std::uint8_t> outliers(n);
    for (std::size_t i = 0; i != n; ++i) {
      seen[i] = {test::random_vector(random, 3.0), vec2(random.normal(), random.normal())};
      if (i % 2 == 0) seen[i].right = random.normal();
      if (i % 4 == 0) seen[i].depth_weight = 0.5;
      if (i % 7 == 3) seen[i].point.y() = nan;
      outliers[i] = i % 3 == 1;
    }
    const auto pieces = std::make_unique<pose_pieces>(seen, outliers);
    for (int round = 0; round != 2; ++round) {
      std::size_t visited = 0;
      pieces->for_each([&](const pose_lanes& lanes, std::size_t first, std::size_t count, std::size_t padded) {
        CHECK(first == visited);
        CHECK(padded % 8 == 0);
        CHECK(padded - count < 8);
        for (std::size_t i = 0; i != padded; ++i) {
          const bool usable = i < count && (first + i) % 7 != 3;
          CHECK(lanes.information[i] == (usable ? 1.0 : 0.0));
          CHECK(lanes.active[i] == (usable && outliers[first + i] == 0 ? 1.0 : 0.0));
          if (!usable) continue;
          CHECK(lanes.y[i] == seen[first + i].point.y());
          CHECK(lanes.v[i] == seen[first + i].pixel.y());
          CHECK(lanes.depth_weight[i] == (seen[first + i].has_depth() ? seen[first + i].depth_weight : 0.0));
        }
        visited += count;
      });
      CHECK(visited == n);
      for (std::size_t i = 0; i != n; ++i) outliers[i] = i % 5 == 0;
      pieces->update();
    }
  }
}

TEST_CASE("Observations are usable with finite numbers of moderate size, and information") {
  const pose_observation good{vec3(1, 2, 3), vec2(4, 5)};
  CHECK(pose_pieces::usable(good));
  const auto with = [&](auto change) {
    pose_observation o = good;
    change(o);
    return pose_pieces::usable(o);
  };
  constexpr double infinity = std::numeric_limits<double>::infinity();
  CHECK(with([](auto& o) { o.right = 3.0; }));
  CHECK_FALSE(with([](auto& o) { o.information = 0.0; }));
  CHECK_FALSE(with([](auto& o) { o.information = -1.0; }));
  CHECK_FALSE(with([](auto& o) { o.point.z() = std::numeric_limits<double>::quiet_NaN(); }));
  CHECK_FALSE(with([](auto& o) { o.pixel.x() = 1e200; }));
  CHECK_FALSE(with([](auto& o) { o.right = -infinity; }));
}
