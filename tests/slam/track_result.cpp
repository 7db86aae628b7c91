// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/track_result.hpp>

#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("a frame is tracked if it has a pose") {
  slam::track_result r;
  CHECK(r.state == slam::track_state::not_started);
  CHECK_FALSE(r.tracked());
  r.T_world_camera.emplace();
  CHECK(r.tracked());
}

TEST_CASE("states of tracking have names") {
  CHECK(to_string(slam::track_state::not_started) == "not started");
  CHECK(to_string(slam::track_state::tracking) == "tracking");
  CHECK(to_string(slam::track_state::lost) == "lost");
  CHECK(to_string(slam::track_state::relocalized) == "relocalized");
}

TEST_CASE("no map has the revision with which a reader begins") {
  const slam::pose_revision none;
  CHECK(none != slam::pose_revision{0, 0});
  CHECK(slam::pose_revision{1, 2} == slam::pose_revision{1, 2});
  CHECK(slam::pose_revision{1, 2} != slam::pose_revision{1, 3});
}
