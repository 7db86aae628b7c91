// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/loops/loop_closer.hpp>

#include "slam/known_places.hpp"
#include "slam/ring_world.hpp"
#include "support/catch.hpp"
#include "support/validate.hpp"

using namespace orbis;

namespace {

using descriptor = features::binary_descriptor<256>;

struct scene {
  test::ring_world world;
  slam::options options;
  slam::detail::shared_state<camera::any_camera, descriptor, test::known_places> shared{world.rig, options, {}};
  slam::detail::loop_closer<camera::any_camera, descriptor, test::known_places> closer{shared};
  std::vector<slam::correction_event> told;

  explicit scene(const test::ring_options& o = {.steps = 60}) : world{o} {
    shared.callbacks.map_corrected = [this](const slam::correction_event& e) { told.push_back(e); };
  }
  [[nodiscard]] slam::map& m() { return shared.atlas.active(); }
  void know_all() {
    for (const auto& [id, m] : shared.atlas.maps())
      for (const auto& k : m.keyframes()) shared.places.add({id, k.id}, 0);
  }
};

}  // namespace

TEST_CASE("A loop is closed once, reported, and adjusted globally") {
  scene s;
  s.m() = s.world.round(4);
  s.know_all();
  const double before = s.world.errors(s.m())[0];
  CHECK(s.closer.close({0, 63}));
  CHECK(s.shared.loops_closed == 1);
  REQUIRE(s.told.size() == 1);
  CHECK(s.told[0].kind == slam::correction_kind::loop);
  CHECK(s.told[0].from == slam::map_keyframe{0, 63});
  CHECK(s.told[0].to.keyframe < 10);
  CHECK(s.told[0].T_corrected_before.translation().norm() > 0.001);
  const double closed = s.world.errors(s.m())[0];
  CHECK(closed < 0.6 * before);
  CHECK_FALSE(s.closer.close({0, 63}));  // only just closed
  s.closer.adjust_globally(0);
  REQUIRE(s.told.size() == 2);
  CHECK(s.told[1].kind == slam::correction_kind::global_adjustment);
  for (const slam::correction_event& e : s.told) {
    CHECK(e.locked_milliseconds > 0.0);
    CHECK(e.locked_milliseconds < e.milliseconds);
  }
  CHECK(s.world.errors(s.m())[0] < closed);
  CHECK(test::validate(s.m()));
}

TEST_CASE("Nothing is closed without a place, with a place nearby, or when it is switched off") {
  scene s;
  s.m() = s.world.round(4);
  CHECK_FALSE(s.closer.close({0, 63}));  // no places
  for (std::uint32_t k = 55; k < 63; ++k) s.shared.places.add({0, k}, 0);
  CHECK_FALSE(s.closer.close({0, 63}));  // its neighbours
  for (std::uint32_t k = 25; k < 30; ++k) s.shared.places.add({0, k}, 0);
  CHECK_FALSE(s.closer.close({0, 63}));  // places that look otherwise
  CHECK_FALSE(s.closer.close({0, 99}));
  s.know_all();
  s.options.places.enabled = false;
  CHECK_FALSE(s.closer.close({0, 63}));
  CHECK(s.told.empty());
}

TEST_CASE("Maps that meet become one, in the world of the older one") {
  scene s;
  const se3 elsewhere(so3::exp(vec3(0.3, -0.2, 0.9)), vec3(5, 4, 3));
  s.world.walk(s.m(), 0, 14, s.world.truth(0));
  s.shared.atlas.create();
  s.world.walk(s.m(), 8, 22, elsewhere * s.world.truth(8));
  s.know_all();
  s.options.places.candidates = 20;  // all of them
  const se3 before = s.shared.atlas.at(0).at(3).T_world_camera;
  CHECK(s.closer.close({1, 2}));
  CHECK(s.shared.atlas.size() == 1);
  CHECK(s.shared.maps_merged == 1);
  REQUIRE(s.told.size() == 1);
  CHECK(s.told[0].kind == slam::correction_kind::merge);
  CHECK(s.told[0].merged == 1);
  CHECK(s.told[0].map == 0);
  CHECK(s.told[0].locked_milliseconds > 0.0);
  CHECK(s.told[0].locked_milliseconds < s.told[0].milliseconds);
  CHECK(s.told[0].offsets.keyframes == 14);
  CHECK(s.told[0].from == slam::map_keyframe{0, 16});
  CHECK(s.m().at(3).T_world_camera.to_matrix() == before.to_matrix());
  CHECK(s.shared.places.contains({0, 16}));
  CHECK_FALSE(s.shared.places.contains({1, 2}));
  CHECK(test::validate(s.m()));
}

TEST_CASE("Without depth maps that meet become one, in world and unit of the older one, whichever sees the other") {
  for (const bool older_sees : {false, true}) {
    scene s({.steps = 60, .drift = 0.1, .shrinks = 1e-5});
    s.options.places.loop.max_rotation = 1.0;
    s.options.places.candidates = 20;  // all of them
    const se3 elsewhere(so3::exp(vec3(0.3, -0.2, 0.9)), vec3(5, 4, 3));
    constexpr double unit = 2.5;  // lengths of the newer map over those of the older one
    s.world.walk(s.m(), 0, 14, s.world.truth(0));
    s.shared.atlas.create();
    s.world.walk(s.m(), 8, 22, elsewhere * s.world.truth(8), unit);
    s.know_all();
    const slam::map_keyframe of_older{0, 3}, of_newer{1, 10},
        sees = older_sees ? slam::map_keyframe{0, 10} : slam::map_keyframe{1, 2};
    const se3 before = s.shared.atlas.at(of_older).T_world_camera;
    REQUIRE(s.closer.close(sees));
    REQUIRE(s.shared.atlas.size() == 1);
    REQUIRE(s.told.size() == 1);
    CHECK(s.told[0].map == (older_sees ? 1U : 0U));
    CHECK(s.told[0].merged == (older_sees ? 0U : 1U));
    CHECK(s.told[0].T_corrected_before.scale() == Approx(older_sees ? 1.0 : 1.0 / unit).epsilon(0.01));
    CHECK(s.told[0].T_map_before.scale() == Approx(older_sees ? 1.0 / unit : 1.0).epsilon(0.01));
    CHECK(test::validate(s.m()));
    const auto older = s.shared.atlas.current(of_older), newer = s.shared.atlas.current(of_newer);
    CHECK((s.m().at(older.keyframe).T_world_camera.inverse() * before).log().norm() < 1e-9);
    CHECK(s.m().scale(older.keyframe) == Approx(1.0));
    CHECK(s.m().scale(newer.keyframe) == Approx(1.0 / unit).epsilon(0.01));
    const double apart = (s.m().at(newer.keyframe).T_world_camera.translation() - before.translation()).norm();
    const vec3 truth = s.world.truth(18).translation() - s.world.truth(3).translation();
    CHECK(apart == Approx(truth.norm()).epsilon(0.02));
  }
}

TEST_CASE("What is stopped changes nothing") {
  scene s;
  s.m() = s.world.round(4);
  s.know_all();
  const slam::map before = s.m();
  s.closer.stop();
  CHECK_FALSE(s.closer.close({0, 63}));
  s.closer.adjust_globally(0);
  s.closer.adjust_globally(5);  // no such map
  CHECK(test::same(before, s.m()));
  CHECK(s.told.empty());
}
