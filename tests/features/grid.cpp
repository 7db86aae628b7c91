// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/grid.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

/// Where a query looks.
struct disc {
  float x, y, radius;
  int min_octave, max_octave;
};

bool inside(const disc& w, const keypoint& k) {
  const float dx = k.x - w.x;
  const float dy = k.y - w.y;
  return dx * dx + dy * dy <= w.radius * w.radius && k.octave >= w.min_octave && k.octave <= w.max_octave;
}

}  // namespace

TEST_CASE("a keypoint grid finds exactly the keypoints in the disc and the octaves") {
  const auto f = test::random_features(500, 3);
  random_bits random{4};
  for (const float cell : {1.0F, 20.0F, 10000.0F}) {
    const keypoint_grid grid{f.keypoints, cell};
    for (int trial = 0; trial != 60; ++trial) {
      const disc w{static_cast<float>(random.uniform(-100.0, 750.0)), static_cast<float>(random.uniform(-100.0, 600.0)),
                   static_cast<float>(random.uniform(0.0, 120.0)), static_cast<int>(random.below(4)), 5};
      std::vector<std::uint32_t> found, expected;
      grid.for_each_near(w.x, w.y, w.radius, w.min_octave, w.max_octave, [&](std::uint32_t i) { found.push_back(i); });
      for (std::uint32_t i = 0; i != f.size(); ++i)
        if (inside(w, f.keypoints[i])) expected.push_back(i);
      std::sort(found.begin(), found.end());
      REQUIRE(found == expected);
    }
  }
}

TEST_CASE("a keypoint grid survives no keypoints and positions that are not finite or far away") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  int visits = 0;
  const auto visit = [&](std::uint32_t) { ++visits; };
  keypoint_grid{}.for_each_near(0, 0, 10, 0, 9, visit);
  keypoint_grid{std::vector<keypoint>{{nan, 1.0F}}}.for_each_near(0, 0, 10, 0, 9, visit);
  CHECK(visits == 0);
  const keypoint_grid grid{std::vector<keypoint>{{1e30F, -1e30F}, {5.0F, 5.0F}, {nan, nan}, {-3e9F, 7.0F}}};
  grid.for_each_near(5, 5, 1, 0, 9, visit);
  CHECK(visits == 1);
  grid.for_each_near(nan, 5, 1, 0, 9, visit);
  grid.for_each_near(5, 5, nan, 0, 9, visit);
  grid.for_each_near(5, 5, -1, 0, 9, visit);
  CHECK(visits == 1);
  grid.for_each_near(0, 0, std::numeric_limits<float>::infinity(), 0, 9, visit);
  CHECK(visits == 4);
}
