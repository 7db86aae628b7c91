// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/landmark.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("The observation of a landmark by a keyframe is found among all of them") {
  slam::landmark l;
  CHECK(l.seen_by(0) == nullptr);
  l.observations = {{2, 20}, {5, 50}, {9, 90}};
  for (const slam::observation& o : l.observations) {
    REQUIRE(l.seen_by(o.keyframe) != nullptr);
    CHECK(*l.seen_by(o.keyframe) == o);
  }
  for (const std::uint32_t k : {0U, 3U, 6U, 10U}) CHECK(l.seen_by(k) == nullptr);
}
