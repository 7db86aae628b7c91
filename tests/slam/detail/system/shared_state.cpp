// SPDX-License-Identifier: BSD-3-Clause
#include <atomic>
#include <thread>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/system/shared_state.hpp>

#include "slam/known_places.hpp"
#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

struct scene {
  test::ring_world world{{.steps = 60, .density = 12.0}};
  slam::options options;
  slam::detail::shared_state<camera::any_camera, features::binary_descriptor<256>, test::known_places> shared{
      world.rig, options, {}};
};

}  // namespace

TEST_CASE("The event of a keyframe says what the keyframe is") {
  scene s;
  s.world.walk(s.shared.atlas.active(), 0, 3, s.world.truth(0));
  const slam::keyframe_event e = s.shared.make_event({0, 2});
  CHECK(e.id == slam::map_keyframe{0, 2});
  CHECK(e.frame == 2);
  CHECK(e.timestamp == 1.0);
  CHECK(e.T_world_camera.to_matrix() == s.shared.atlas.active().at(2).T_world_camera.to_matrix());
}

TEST_CASE("A map goes with the places of its keyframes") {
  scene s;
  s.world.walk(s.shared.atlas.active(), 0, 3, s.world.truth(0));
  const slam::map_id other = s.shared.atlas.create();
  s.world.walk(s.shared.atlas.active(), 10, 12, s.world.truth(10));
  for (const auto& [id, m] : s.shared.atlas.maps())
    for (const auto& k : m.keyframes()) s.shared.places.add({id, k.id}, 0);
  s.shared.remove_map(0);
  CHECK_FALSE(s.shared.atlas.contains(0));
  CHECK(s.shared.places.known == std::vector<slam::map_keyframe>{{other, 0}, {other, 1}});
  CHECK(s.shared.similar(0, 5, [](slam::map_keyframe k) { return k.keyframe == 0; }) ==
        std::vector<slam::map_keyframe>{{other, 1}});
}

TEST_CASE("An edit keeps other edits out, and whoever locks meanwhile in") {
  scene s;
  const auto edit = s.shared.edit();
  CHECK_FALSE(s.shared.try_edit().owns_lock());
  CHECK(s.shared.locked([] { return 7; }) == 7);
}

TEST_CASE("A lock that is given back and taken again at once lets others in") {
  scene s;
  std::atomic<bool> stop{false}, entered{false};
  std::thread greedy([&] {
    while (!stop) {
      const auto lock = s.shared.lock();
      std::this_thread::yield();
    }
  });
  for (int i = 0; i < 20; ++i) s.shared.locked([&] { entered = true; });
  stop = true;
  greedy.join();
  CHECK(entered);
}
