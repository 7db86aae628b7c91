// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <vector>

#include <orbis/slam/detail/depth/surface_memory.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::slam::detail;

namespace {

using descriptor = features::binary_descriptor<256>;

se3 at(double x) { return {so3{}, vec3(x, 0.0, 0.0)}; }
surface marked(int step) {
  surface s;
  s.step = step;
  s.cells.resize(1);
  return s;
}

struct scene {
  slam::basic_atlas<descriptor> maps;
  slam::keyframe_id add(double x) {
    slam::basic_frame<descriptor> f;
    f.T_world_camera = at(x);
    return maps.active().add_keyframe(f);
  }
  slam::map_keyframe key(slam::keyframe_id k) { return {maps.active_id(), k}; }
};

/// Two keyframes a metre apart, each with its surface.
struct two_keyframes : scene {
  slam::keyframe_id a = add(0.0), b = add(1.0);
  surface_memory memory;
  std::vector<placed_surface> found;

  explicit two_keyframes(std::size_t capacity) : memory{capacity} {
    surface one = marked(1), two = marked(2);
    memory.keep(key(a), se3{}, one);
    memory.keep(key(b), se3{}, two);
  }
};

std::vector<int> steps(const std::vector<placed_surface>& placed) {
  std::vector<int> all;
  for (const placed_surface& p : placed) all.push_back(p.seen->step);
  return all;
}

}  // namespace

TEST_CASE("Surfaces are found by how near they are, and move with their keyframes") {
  two_keyframes s{4};
  surface three = marked(3);
  s.memory.keep(s.key(s.b), at(0.5), three);
  s.memory.around(s.maps, at(0.1), 2, s.found);
  CHECK(steps(s.found) == std::vector{1, 2});
  s.memory.around(s.maps, at(1.4), 3, s.found);
  CHECK(steps(s.found) == std::vector{3, 2, 1});
  CHECK(s.found[0].T_world_camera.translation().x() == Catch::Approx(1.5));
  s.maps.active().set_pose(s.b, at(5.0));
  s.memory.around(s.maps, at(1.4), 3, s.found);
  CHECK(steps(s.found) == std::vector{1, 2, 3});
  CHECK(s.found[2].T_world_camera.translation().x() == Catch::Approx(5.5));
  s.maps.active().erase_keyframe(s.b);  // still placed, relative to what replaced it
  s.memory.around(s.maps, at(5.5), 1, s.found);
  CHECK(steps(s.found) == std::vector{3});
  s.maps.create();
  s.memory.around(s.maps, at(0.0), 3, s.found);
  CHECK(s.found.empty());
}

TEST_CASE("Where there is no room the surface goes that was asked for longest ago") {
  two_keyframes s{2};
  surface three = marked(3);
  s.memory.around(s.maps, at(0.0), 1, s.found);
  CHECK(steps(s.found) == std::vector{1});
  s.memory.keep(s.key(s.b), at(1.0), three);
  CHECK(three.step == 2);  // whose memory is used again
  s.memory.around(s.maps, at(0.0), 4, s.found);
  CHECK(steps(s.found) == std::vector{1, 3});
}
