// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/slam/detail/loops/map_merging.hpp>

#include "slam/at_once.hpp"
#include "slam/random_map.hpp"
#include "slam/ring_world.hpp"
#include "support/catch.hpp"

using namespace orbis;
namespace merging = slam::detail::map_merging;

TEST_CASE("Two maps that show the same place become one") {
  test::ring_world world;
  slam::atlas maps(8, 1.2);
  const se3 elsewhere(so3::exp(vec3(0.3, -1.0, 2.0)), vec3(10, -20, 3));
  const auto into = maps.active_id();
  world.walk(maps.active(), 0, 20, world.truth(0));
  const auto from = maps.create();
  world.walk(maps.active(), 15, 35, elsewhere * world.truth(15));
  maps.at(from).erase_keyframe(10);
  const auto check = test::verify_loop(maps.at(from), 2, maps.at(into), 16, world.rig);
  REQUIRE(check);
  const slam::map first = maps.at(into), second = maps.at(from);

  const auto report = test::merge_maps(maps, from, into, check.match, world.rig);
  REQUIRE(report.merged);
  CHECK(maps.size() == 1);
  CHECK(maps.active_id() == into);
  const slam::map& m = maps.active();
  CHECK(test::fault_of(m) == "");
  CHECK(report.offsets.keyframes == 20);
  CHECK(report.keyframe == 22);
  CHECK(report.candidate == 16);
  CHECK(maps.current({from, 2}) == slam::map_keyframe{into, 22});
  CHECK(m.keyframes().size() == 39);
  CHECK(m.tree().parent(22) == 16);
  CHECK(m.tree().loop_edges(22) == std::vector<slam::keyframe_id>{16});

  // The map that stays is where it was, the other one fits it.
  for (slam::keyframe_id k = 0; k < 20; ++k)
    CHECK(m.at(k).T_world_camera.to_matrix() == first.at(k).T_world_camera.to_matrix());
  for (slam::keyframe_id k = 0; k < 20; ++k)
    if (k != 10) {
      const sim3 T = report.T_into_from * sim3(second.at(k).T_world_camera);
      CHECK((T.inverse() * sim3(m.at(k + 20).T_world_camera)).log().norm() < 1e-9);
    }
  slam::map in_one(8, 1.2);  // as if tracking had never been lost
  world.walk(in_one, 0, 35, world.truth(0));
  CHECK(world.errors(m)[0] < 1.5 * world.errors(in_one)[0]);

  CHECK(report.fusion.fused > 100);
  CHECK(m.landmark_count() == first.landmark_count() + second.landmark_count() - report.fusion.fused);
  CHECK(m.covisibility().shared(22, 17) > 60);
  std::size_t wrong = 0;
  const auto step = [](slam::keyframe_id k) { return k < 20 ? k.value() : k.value() - 5; };
  for (const auto& l : m.landmarks()) {
    const auto point = world.point_of(step(l.observations.front().keyframe), l.observations.front().feature);
    for (const auto& o : l.observations) wrong += world.point_of(step(o.keyframe), o.feature) != point;
  }
  CHECK(wrong == 0);
}

TEST_CASE("Maps that grow while they are compared are merged whole, without their keyframes they are not") {
  test::ring_world world;
  slam::atlas maps(8, 1.2);
  const auto into = maps.active_id();
  world.walk(maps.active(), 0, 12, world.truth(0));
  const auto from = maps.create();
  world.walk(maps.active(), 6, 18, world.truth(6));
  const auto match = test::verify_loop(maps.at(from), 2, maps.at(into), 7, world.rig).match;
  REQUIRE(match.inliers >= 40);

  const auto taken = merging::take(maps, from, into, match);
  REQUIRE(taken);
  const auto pairs = slam::detail::loop_fusion::find_pairs(taken->fusion, world.rig, {});
  slam::atlas without = maps;
  slam::detail::insert_keyframe(maps.at(from), world.look(18, maps.at(from).at(11).T_world_camera), {});
  slam::detail::insert_keyframe(maps.at(into), world.look(12, maps.at(into).at(11).T_world_camera), {});
  const auto report = merging::join(maps, *taken);
  REQUIRE(report.merged);
  CHECK(report.offsets.keyframes == 13);
  CHECK(slam::detail::loop_fusion::fuse<slam::map::descriptor_type>(maps.active(), pairs, report.offsets).fused > 100);
  CHECK(maps.active().keyframes().size() == 26);
  CHECK(test::fault_of(maps.active()) == "");

  without.at(into).erase_keyframe(7);
  CHECK_FALSE(merging::join(without, *taken).merged);
  CHECK(without.size() == 2);
  CHECK_FALSE(merging::take(without, from, into, match));
  CHECK_FALSE(test::merge_maps(without, into, into, match, world.rig).merged);
}

TEST_CASE("A map without depth takes on the unit of the one that it becomes a part of") {
  test::ring_world world{{.drift = 0.0, .shrinks = 1e-9}};
  slam::atlas maps(8, 1.2);
  const slam::map_id into = maps.active_id();
  world.walk(maps.active(), 0, 20, world.truth(0));
  const slam::map_id from = maps.create();
  const se3 start(so3::exp(vec3(0.1, 0.2, 0.3)), vec3(5, 6, 7));
  constexpr double unit = 0.3;
  world.walk(maps.active(), 15, 35, start, unit);
  const auto check = test::verify_loop(maps.at(from), 2, maps.at(into), 16, world.rig);
  CHECK(to_string(check.verdict) == "accepted");
  CHECK(check.match.scale == Approx(1.0 / unit).epsilon(0.01));
  const auto report = test::merge_maps(maps, from, into, check.match, world.rig);
  REQUIRE(report.merged);
  CHECK(test::fault_of(maps.active()) == "");
  CHECK(report.fusion.fused > 100);
  CHECK(maps.active().scale(30) == Approx(1.0 / unit).epsilon(0.01));
  CHECK(world.errors(maps.active())[0] < 0.03);
}
