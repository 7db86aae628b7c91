// SPDX-License-Identifier: BSD-3-Clause
#include <map>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/atlas.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::map_id;

TEST_CASE("An atlas starts with an empty map, and a new one becomes the active one") {
  slam::atlas atlas(6, 1.3);
  CHECK(atlas.size() == 1);
  const slam::map& first = atlas.active();
  CHECK(first.content().levels == 6);
  CHECK(first.content().scale_factor == 1.3);
  const map_id second = atlas.create();
  CHECK(atlas.active_id() == second);
  CHECK(&atlas.at(0) == &first);
  atlas.activate(0);
  CHECK(&atlas.active() == &first);
  atlas.remove(second);
  CHECK_FALSE(atlas.contains(second));
  CHECK(atlas.create() != second);
}

TEST_CASE("A map that is merged hangs on the keyframe that the caller names") {
  random_bits random(1);
  slam::atlas atlas;
  for (int i = 0; i < 5; ++i) test::add_random_keyframe(random, atlas.active(), 30, 10);
  const map_id other = atlas.create();
  for (int i = 0; i < 3; ++i) test::add_random_keyframe(random, atlas.active(), 30, 10);
  const auto offsets = atlas.merge(other, 0, sim3(so3{}, vec3(0.31, 0, 0), 1.0), {3, 0});
  CHECK(offsets.keyframes == 5);
  CHECK(atlas.active_id() == 0);
  CHECK(atlas.active().tree().parent(5) == 3);
  CHECK(atlas.active().at(5).T_world_camera.translation().x() == Approx(0.31));
  CHECK(test::fault_of(atlas.active()) == "");
  const map_id empty = atlas.create();
  atlas.merge(0, empty, sim3{}, {});  // into nothing
  CHECK(atlas.active().keyframes().size() == 8);
  CHECK(atlas.current({other, 1}) == slam::map_keyframe{empty, 6});
}

TEST_CASE("Maps are whole, and keyframes found again, after any sequence of maps and merges") {
  random_bits random(2);
  slam::atlas atlas(8, 1.2, 3);
  struct known {
    slam::map_keyframe named;
    std::size_t index;  // the frame's, which nothing changes
  };
  std::vector<known> all;
  std::size_t frames = 0;
  std::map<map_id, std::size_t> removed;
  for (int step = 0; step < 1500; ++step) {
    const auto any_map = [&] {
      auto at = atlas.maps().begin();
      std::advance(at, random.below(static_cast<std::uint32_t>(atlas.size())));
      return at->first;
    };
    const map_id a = any_map(), b = any_map();
    switch (random.below(20)) {
      case 0:
        if (atlas.size() < 6) atlas.create();
        break;
      case 1:
        if (a == b) break;
        atlas.merge(a, b, sim3(test::random_motion(random)), {atlas.at(b).tree().root(), atlas.at(a).tree().root()});
        REQUIRE_FALSE(atlas.contains(a));
        REQUIRE(test::fault_of(atlas.at(b)) == "");
        break;
      case 2:
        if (a != atlas.active_id() && random.below(5) == 0) {
          atlas.remove(a);
          removed[a] = 0;
        }
        break;
      case 3: atlas.activate(a); break;
      case 4:
      case 5:
      case 6: {
        auto f = test::random_frame(random, 20, frames++);
        for (auto& l : f.landmarks) l = random.below(2) == 0 ? test::any_landmark(random, atlas.active()) : slam::no_id;
        const auto k = slam::detail::insert_keyframe(atlas.active(), std::move(f), {});
        all.push_back({{atlas.active_id(), k}, frames - 1});
        break;
      }
      case 7:
        if (const auto k = test::any_keyframe(random, atlas.at(a)); atlas.at(a).has_keyframe(k))
          atlas.at(a).erase_keyframe(k);
        break;
      default: {
        slam::map& m = atlas.at(a);
        const auto l = test::any_landmark(random, m), into = test::any_landmark(random, m);
        if (l != into && m.has_landmark(l) && m.has_landmark(into)) m.fuse(l, into);
      }
    }
    if (step % 10 != 0) continue;
    REQUIRE(atlas.contains(atlas.active_id()));
    for (const auto& [id, m] : atlas.maps()) REQUIRE(test::fault_of(m) == "");
    for (const known& k : all) {
      const slam::map_keyframe now = atlas.current(k.named);
      REQUIRE(atlas.contains(now.map) != removed.contains(now.map));
      if (!atlas.contains(now.map)) continue;
      const slam::map& m = atlas.at(now.map);
      if (m.has_keyframe(now.keyframe)) REQUIRE(m.at(now.keyframe).index == k.index);
      if (!m.has_keyframe(now.keyframe)) REQUIRE(m.content().erased.contains(now.keyframe));
    }
  }
  CHECK(frames > 150);
}
