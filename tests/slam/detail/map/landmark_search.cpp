// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>

#include <orbis/slam/detail/map/landmark_search.hpp>

#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::detail::search_list;

TEST_CASE("The window of a landmark contains its keypoint, landmarks out of sight have none") {
  test::ring_world world({.steps = 60, .drift = 0.0});
  slam::map m(8, 1.2);
  world.walk(m, 0, 20, world.truth(0));
  const auto& k = m.at(19);
  const features::camera_projection project{world.rig.camera(), k.T_world_camera};
  const auto rule = slam::detail::make_rule(world.rig.scales, 8.0);
  search_list<features::binary_descriptor<256>> list;
  std::size_t observed = 0, contained = 0, hidden = 0;
  for (const auto& l : m.landmarks()) {
    const bool added = slam::detail::add_landmark(list, project, rule, l, l.id);
    const auto* o = l.seen_by(19);
    hidden += !added;
    if (o == nullptr || !added) continue;
    ++observed;
    const features::window& w = list.windows.back();
    const vec2 offset = k.pixel(o->feature) - vec2(w.x, w.y);
    contained += offset.norm() <= static_cast<double>(w.radius);
    CHECK(list.points.back().landmark == l.id);
    CHECK(list.descriptors.back() == l.descriptor);
  }
  CHECK(observed > 100);
  CHECK(contained > observed * 9 / 10);
  CHECK(hidden > 50);
  CHECK(list.size() == m.landmark_count() - hidden);
}

TEST_CASE("What the last frame observed is searched for at the same level and the next ones") {
  test::ring_world world;
  const slam::frame f = world.look(2, world.truth(2));
  const features::camera_projection project{world.rig.camera(), world.truth(2)};
  search_list<features::binary_descriptor<256>> list;
  slam::detail::candidate_point p;
  p.position = world.point(world.point_of(2U, 4));
  slam::detail::add_seen_point(list, project, world.rig.scales, p, f.features.descriptors[4], f.features.keypoints[4],
                               10.0);
  REQUIRE(list.size() == 1);
  const int octave = f.features.keypoints[4].octave;
  CHECK(list.windows[0].min_octave == octave - 1);
  CHECK(list.windows[0].max_octave == octave + 1);
  CHECK(static_cast<double>(list.windows[0].radius) == Approx(10.0 * world.rig.scales.scale(octave)));
  p.position = world.truth(2) * vec3(0, 0, -1);  // behind the camera
  slam::detail::add_seen_point(list, project, world.rig.scales, p, f.features.descriptors[4], f.features.keypoints[4],
                               10.0);
  CHECK(list.size() == 1);
}
