// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/slam/detail/tracking/match_refinement.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;

/// A frame, and all points that its keypoints show, as landmarks with the number of their keypoint.
struct scene {
  test::ring_world world{{.steps = 60}};
  slam::frame f = world.look(10, world.truth(10));
  slam::detail::search_list<descriptor> list;
  std::vector<features::match> matches;

  scene() {
    for (std::uint32_t i = 0; i != f.size(); ++i) {
      list.add({world.point(world.point_of(10U, i)), i}, {}, {}, {});
      matches.push_back({i, i, 0});
    }
  }
  [[nodiscard]] double error() const { return (world.truth(10).inverse() * f.T_world_camera).log().norm(); }
};

}  // namespace

TEST_CASE("A frame gets the pose that its matches agree on, and the landmarks that agree with it") {
  scene s;
  s.f.T_world_camera = s.world.truth(10) * se3(so3::exp(vec3(0.01, -0.01, 0.02)), vec3(0.02, 0.01, -0.02));
  s.list.points[3].position += vec3(0.0, 0.0, 0.7);  // a wrong match
  const std::size_t inliers = slam::detail::refine_on_matches<descriptor>(s.f, s.list, s.matches, s.world.rig);
  CHECK(inliers > s.f.size() * 8 / 10);
  CHECK(s.error() < 0.005);
  CHECK(s.f.landmarks[3] == slam::no_id);
  std::size_t known = 0;
  for (std::uint32_t i = 0; i != s.f.size(); ++i) {
    known += s.f.landmarks[i] != slam::no_id;
    CHECK((s.f.landmarks[i] == slam::no_id || s.f.landmarks[i] == i));
  }
  CHECK(known == inliers);
}

TEST_CASE("Too few matches leave a frame with its pose and without landmarks") {
  scene s;
  s.f.landmarks[0] = 3;
  s.matches.resize(2);
  CHECK(slam::detail::refine_on_matches<descriptor>(s.f, s.list, s.matches, s.world.rig) == 0);
  CHECK(s.error() == 0.0);
  CHECK(s.f.landmarks[0] == slam::no_id);
}
