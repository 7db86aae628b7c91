// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/tracking/keyframe_decision.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::detail::is_keyframe_due;

namespace {

/// Of a frame that observes all that the reference does, shortly after it.
constexpr slam::detail::keyframe_evidence quiet{.since = 0.05,
                                                .moved = 0.01,
                                                .turned = 0.01,
                                                .inliers = 100,
                                                .reference = 100,
                                                .close_tracked = 150,
                                                .close_untracked = 10,
                                                .keyframes = 5};

}  // namespace

TEST_CASE("Each reason for a keyframe is enough, none is, if few landmarks are tracked") {
  const slam::keyframe_options o;
  CHECK_FALSE(is_keyframe_due(quiet, o));

  auto view_changed = quiet;
  view_changed.inliers = 74;
  CHECK(is_keyframe_due(view_changed, o));
  view_changed.keyframes = 1;  // the first keyframe is not replaced so soon
  CHECK_FALSE(is_keyframe_due(view_changed, o));
  view_changed.inliers = 39;
  CHECK(is_keyframe_due(view_changed, o));

  auto needs_close = quiet;
  needs_close.close_tracked = 99;
  CHECK_FALSE(is_keyframe_due(needs_close, o));
  needs_close.close_untracked = 71;
  CHECK(is_keyframe_due(needs_close, o));

  auto moved = quiet;
  moved.moved = 0.06;
  CHECK_FALSE(is_keyframe_due(moved, o));  // too soon
  moved.since = 0.3;
  CHECK(is_keyframe_due(moved, o));
  moved.moved = 0.0;
  CHECK_FALSE(is_keyframe_due(moved, o));  // at rest
  moved.turned = 0.06;
  CHECK(is_keyframe_due(moved, o));
  moved.inliers = 15;
  CHECK_FALSE(is_keyframe_due(moved, o));

  auto away = quiet;
  away.turned = 0.5;
  away.away = 0.14;
  CHECK_FALSE(is_keyframe_due(away, o));  // an older keyframe shows the view
  away.away = 0.16;
  CHECK(is_keyframe_due(away, o));
  CHECK_FALSE(is_keyframe_due(away, slam::monocular_options().keyframes));  // a rotation gives no parallax
}

TEST_CASE("The evidence is counted from the map and the frame, which stay as they are") {
  test::ring_world world({.steps = 60, .drift = 0.0});
  slam::map m(8, 1.2);
  world.walk(m, 0, 3, world.truth(0));
  const slam::map before = m;
  slam::frame f = world.look(3, world.truth(3));
  f.depth[0] = 0.0F;
  f.depth[1] = 9.0F;  // neither is close
  for (std::uint32_t i = 2; i < 12; ++i) f.landmarks[i] = m.at(2).landmarks[i];
  const auto e = slam::detail::gather_evidence(m, f, 2, 33, {});
  CHECK(e.since == Approx(0.5));
  CHECK(e.moved == Approx((world.truth(2).inverse() * world.truth(3)).translation().norm()));
  CHECK(e.turned == Approx((world.truth(2).inverse() * world.truth(3)).rotation().angle()));
  CHECK(e.inliers == 33);
  CHECK(e.keyframes == 3);
  CHECK(e.close_tracked == 10);
  CHECK(e.close_untracked > 50);
  CHECK(e.close_tracked + e.close_untracked <= f.size() - 2);
  std::size_t shared = 0;
  for (const auto l : m.at(2).landmarks) shared += l != slam::no_id && m.landmark_at(l).observations.size() >= 2;
  CHECK(e.reference == shared);
  CHECK(test::same(m, before));
}
