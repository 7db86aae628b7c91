// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/mapping/map_bundle.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A map of four keyframes with a little drift, and all of it as a problem; the first keyframe is held.
struct scene {
  test::ring_world world{{.steps = 60, .density = 12.0}};
  slam::map m{8, 1.2};
  slam::detail::bundle_snapshot s;

  scene() {
    world.walk(m, 0, 4, world.truth(0));
    for (const auto& k : m.keyframes()) s.add_keyframe(k.id, k.T_world_camera, k.id == 0);
    for (const auto& l : m.landmarks()) s.add_landmark(m, l, world.rig, [](slam::keyframe_id k) { return k.value(); });
  }
  [[nodiscard]] slam::detail::bundle_solution solve(const slam::detail::bundle_schedule& schedule,
                                                    const progress& go_on = {}) const {
    return slam::detail::bundle_solver<camera::any_camera>{world.rig.model}.solve(s, schedule, go_on);
  }
};

}  // namespace

TEST_CASE("A part of a map becomes arrays: every observation by a keyframe that takes part, with its source") {
  scene t;
  std::size_t observations = 0, of_last = 0;
  for (const auto& l : t.m.landmarks()) {
    observations += l.observations.size();
    of_last += l.seen_by(3) != nullptr;
  }
  REQUIRE(of_last > 0);
  CHECK(t.s.observations.size() == observations);
  CHECK(t.s.sources.size() == observations);
  CHECK(t.s.points.size() == t.m.landmark_count());
  for (std::size_t i = 0; i != observations; ++i) {
    const auto& o = t.s.observations[i];
    CHECK(t.s.sources[i].keyframe == t.s.keyframes[o.pose]);
    CHECK(t.m.at(t.s.sources[i].keyframe).landmarks[t.s.sources[i].feature] == t.s.landmarks[o.point]);
  }
  t.s.clear();
  CHECK(t.s.empty());
  for (const auto& l : t.m.landmarks())
    t.s.add_landmark(t.m, l, t.world.rig, [](slam::keyframe_id k) { return k == 3 ? slam::no_id : k.value(); });
  CHECK(t.s.observations.size() == observations - of_last);
}

TEST_CASE("The solution lowers the error, keeps what is fixed, and names a wrong observation") {
  scene t;
  t.s.observations[7].pixel += vec2(40.0, 0.0);
  const auto solved = t.solve({});
  CHECK((solved.usable && solved.complete));
  CHECK(solved.final_cost < solved.initial_cost);
  CHECK(solved.poses[0].to_matrix() == t.s.poses[0].to_matrix());
  CHECK(solved.outliers[7] == 1);
  const auto outliers = std::count(solved.outliers.begin(), solved.outliers.end(), 1);
  CHECK(static_cast<std::size_t>(outliers) < t.s.observations.size() / 10);
}

TEST_CASE("A solution that is stopped is used only if the schedule says so") {
  scene t;
  const auto stop = [](std::size_t, std::size_t) { return false; };
  const auto dropped = t.solve({}, stop);
  CHECK_FALSE((dropped.usable || dropped.complete));
  const auto kept = t.solve({.keep_partial = true}, stop);
  CHECK((kept.usable && !kept.complete));
  CHECK(kept.poses[1].to_matrix() == t.s.poses[1].to_matrix());
}
