// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <optional>
#include <vector>

#include <orbis/mapping/live_map_events.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// What the callback needs of a SLAM system.
struct fake_slam {
  using revision_type = int;
  struct keyframe {
    std::uint64_t frame;
    se3 T_world_camera;
  };
  std::vector<keyframe> keyframes{};
  int revision = 1;

  std::optional<std::vector<keyframe>> keyframes_since(int& seen) const {
    if (seen == revision) return std::nullopt;
    seen = revision;
    return keyframes;
  }
};

}  // namespace

TEST_CASE("poses of keyframes are passed on when they change, or always on request") {
  fake_slam slam{{{3, se3{so3{}, vec3{1.0, 0.0, 0.0}}}, {8, se3{}}}};
  auto poll = mapping::follow_keyframes(slam);
  const auto frames_after = [&](bool always) {
    mapping::keyframe_poses now;
    const bool changed = poll(now, always);
    CHECK(changed == !now.poses.empty());
    CHECK(now.removed.empty());
    return now.poses.size();
  };
  mapping::keyframe_poses first;
  REQUIRE(poll(first, false));
  REQUIRE(first.poses.size() == 2);
  CHECK(first.poses[0].frame == 3);
  CHECK(first.poses[0].T_world_camera.translation().x() == 1.0);
  CHECK(frames_after(false) == 0);
  CHECK(frames_after(true) == 2);
  CHECK(frames_after(false) == 0);
  slam.keyframes.pop_back();
  ++slam.revision;
  CHECK(frames_after(false) == 1);
}
