// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/mapping/local_mapper.hpp>

#include "slam/known_places.hpp"
#include "slam/ring_world.hpp"
#include "support/catch.hpp"
#include "support/validate.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;

struct scene {
  test::ring_world world{{.steps = 60}};
  slam::options options;
  slam::detail::shared_state<camera::any_camera, descriptor, test::known_places> shared{world.rig, options, {}};
  slam::detail::local_mapper<camera::any_camera, descriptor, test::known_places> mapper{shared};

  [[nodiscard]] slam::map& m() { return shared.atlas.active(); }
};

constexpr auto at_leisure = [] { return false; };

}  // namespace

TEST_CASE("Mapping keyframe by keyframe keeps a map consistent, and its poses close to the truth") {
  scene s;
  slam::map raw(8, 1.2);
  s.world.walk(raw, 0, 12, s.world.truth(0));
  for (std::uint32_t i = 0; i < 12; ++i) {
    slam::frame f = raw.at(i);
    f.landmarks.assign(f.size(), slam::no_id);
    if (i != 0) {  // as tracking would: relative to the last keyframe as it is by now
      f.T_world_camera = s.m().at(i - 1).T_world_camera * raw.at(i - 1).T_world_camera.inverse() * f.T_world_camera;
      for (std::uint32_t j = 0; j < f.size(); ++j)
        for (std::uint32_t l = 0; l < s.m().at(i - 1).size(); ++l)
          if (s.world.point_of(i, j) == s.world.point_of(i - 1, l)) f.landmarks[j] = s.m().at(i - 1).landmarks[l];
    }
    const auto id = slam::detail::insert_keyframe(s.m(), f, s.options);
    s.mapper.process({0, id}, at_leisure);
    CHECK(s.shared.places.contains({0, id}));
    const auto valid = test::validate(s.m());
    CHECK((valid ? "" : valid.error().to_string()) == "");
  }
  CHECK(s.world.errors(s.m())[0] < 0.03);
}

TEST_CASE("Redundant keyframes are erased, forgotten as places, and reported") {
  scene s;
  s.options.culling.redundant = 0.5;
  std::vector<slam::map_keyframe> told;
  s.shared.callbacks.keyframe_culled = [&](const slam::keyframe_event& e) { told.push_back(e.id); };
  s.world.walk(s.m(), 0, 12, s.world.truth(0));
  for (const auto& k : s.m().keyframes()) s.shared.places.add({0, k.id}, 0);
  s.mapper.process({0, 11}, at_leisure);
  REQUIRE_FALSE(told.empty());
  CHECK(s.shared.keyframes_culled == told.size());
  CHECK(s.m().keyframes().size() == 12 - told.size());
  for (const auto& k : told) {
    CHECK_FALSE(s.m().has_keyframe(k.keyframe));
    CHECK_FALSE(s.shared.places.contains(k));
  }
}

TEST_CASE("A keyframe that is gone is left alone, one whose map was merged is found under its new id") {
  scene s;
  s.world.walk(s.m(), 0, 4, s.world.truth(0));
  s.m().erase_keyframe(2);
  const slam::map before = s.m();
  s.mapper.process({0, 2}, at_leisure);
  s.mapper.process({7, 0}, at_leisure);
  CHECK(test::same(before, s.m()));
  CHECK(s.shared.places.known.empty());
  s.shared.atlas.create();
  s.world.walk(s.m(), 30, 34, s.world.truth(30));
  s.shared.atlas.merge(1, 0, sim3{}, {0, 0});
  s.mapper.process({1, 3}, at_leisure);
  CHECK(s.shared.places.contains({0, 7}));
}

TEST_CASE("A mapper in a hurry leaves out the adjustment alone") {
  scene s;
  s.world.walk(s.m(), 0, 6, s.world.truth(0));
  std::size_t asked = 0;
  const slam::map before = s.m();
  s.mapper.process({0, 5}, [&] { return ++asked != 0; });
  CHECK(asked == 1);
  for (const auto& k : s.m().keyframes())
    CHECK(k.T_world_camera.to_matrix() == before.at(k.id).T_world_camera.to_matrix());
  CHECK(s.shared.places.contains({0, 5}));
}
