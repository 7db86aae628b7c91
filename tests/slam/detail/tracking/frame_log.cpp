// SPDX-License-Identifier: BSD-3-Clause
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/tracking/frame_log.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("Frames follow their keyframe, through erasing and merging, and are listed by map") {
  random_bits random(3);
  slam::atlas maps(8, 1.2);
  const slam::map_id first = maps.active_id();
  for (int i = 0; i < 3; ++i) test::add_random_keyframe(random, maps.active(), 30, 20);
  const slam::map_id second = maps.create();
  for (int i = 0; i < 3; ++i) test::add_random_keyframe(random, maps.active(), 30, 20);

  const se3 T(so3{}, vec3(0.5, 0, 0));
  slam::detail::frame_log log;
  CHECK(log.largest_map(maps) == second);  // the active one, for want of frames
  log.add({1.0, {first, 1}, T});
  log.add({2.0, {second, 1}, T});
  log.add({3.0, {first, 2}, T});
  CHECK(log.largest_map(maps) == first);
  CHECK(log.trajectory(maps, first).size() == 2);
  CHECK(log.trajectory(maps, second).size() == 1);
  CHECK(log.trajectory(maps, 9).empty());

  // Where lengths have grown, those to frames have.
  maps.at(first).move_keyframe(2, sim3(so3{}, vec3::Zero(), 3.0));
  CHECK((maps.at(first).at(2).T_world_camera.inverse() * log.trajectory(maps, first)[1].T_world_camera * vec3::Zero() -
         vec3(1.5, 0, 0))
            .norm() < 1e-9);
  maps.at(first).move_keyframe(2, sim3(so3{}, vec3::Zero(), 1.0 / 3.0));

  const se3 moved = test::random_motion(random);
  maps.at(first).set_pose(1, moved);
  CHECK((log.trajectory(maps, first)[0].T_world_camera.inverse() * moved * T).log().norm() < 1e-12);
  const se3 before = log.trajectory(maps, second)[0].T_world_camera;
  maps.at(second).erase_keyframe(1);
  CHECK((log.trajectory(maps, second)[0].T_world_camera.inverse() * before).log().norm() < 1e-9);
  maps.merge(second, first, sim3(moved), {0, 0});
  REQUIRE(log.trajectory(maps, first).size() == 3);
  CHECK((log.trajectory(maps, first)[1].T_world_camera.inverse() * moved * before).log().norm() < 1e-9);
  CHECK(log.trajectory(maps, second).empty());
}

TEST_CASE("The pose of a frame can be corrected, and its motion is the mean of both intervals") {
  random_bits random(7);
  slam::atlas maps(8, 1.2);
  const slam::map_id map = maps.active_id();
  test::add_random_keyframe(random, maps.active(), 30, 20);
  maps.active().set_pose(0, test::random_motion(random));
  slam::detail::frame_log log(4);
  const vec6 twist = (vec6() << 0.3, -0.1, 0.2, 0.4, 0.1, -0.3).finished();
  for (int i = 0; i != 5; ++i) log.add({0.1 * i, {map, 0}, se3::exp(0.1 * i * twist)});
  CHECK(log.end_number() == 5);
  CHECK_FALSE(log.pose(0, maps));  // forgotten
  CHECK_FALSE(log.pose(5, maps));
  CHECK_FALSE(log.motion(1, maps));
  CHECK_FALSE(log.motion(4, maps));
  CHECK((log.motion(2, maps).value() - twist).norm() < 1e-9);
  const se3 corrected = test::random_motion(random);
  log.set_pose(3, corrected, maps);
  CHECK((log.pose(3, maps)->inverse() * corrected).log().norm() < 1e-9);
  CHECK((log.trajectory(maps, map)[2].T_world_camera.inverse() * corrected).log().norm() < 1e-9);
  CHECK(log.reference(3) == slam::map_keyframe{map, 0});

  const slam::map_id other = maps.create();
  test::add_random_keyframe(random, maps.active(), 30, 20);
  log.add({0.5, {other, 0}, {}});
  CHECK(log.motion(3, maps));
  CHECK_FALSE(log.motion(4, maps));  // its neighbours are in different worlds
}

TEST_CASE("A log names the keyframes that its frames hang on, also after their map was merged") {
  random_bits random(5);
  slam::atlas maps(8, 1.2);
  const slam::map_id first = maps.active_id();
  for (int i = 0; i < 3; ++i) test::add_random_keyframe(random, maps.active(), 30, 20);
  const slam::map_id second = maps.create();
  for (int i = 0; i < 2; ++i) test::add_random_keyframe(random, maps.active(), 30, 20);
  slam::detail::frame_log log(4);
  CHECK(log.references(maps, first).empty());
  log.add({0.0, {first, 2}, {}});  // will be forgotten
  for (const slam::map_keyframe k : {slam::map_keyframe{first, 0}, {first, 0}, {second, 1}, {first, 1}})
    log.add({1.0, k, {}});
  using ids = std::vector<slam::keyframe_id>;
  CHECK(log.references(maps, first) == ids{0, 1});
  CHECK(log.references(maps, second) == ids{1});
  maps.merge(second, first, sim3{}, {0, 0});
  CHECK(log.references(maps, first) == ids{0, 4, 1});
}

TEST_CASE("Frames are forgotten in order where only the latest are kept") {
  random_bits random(4);
  slam::atlas maps(8, 1.2);
  const slam::map_id map = maps.active_id();
  test::add_random_keyframe(random, maps.active(), 30, 20);
  slam::detail::frame_log none(0), two(2);
  for (int i = 0; i < 4; ++i) {
    none.add({1.0 * i, {map, 0}, {}});
    two.add({1.0 * i, {map, 0}, {}});
  }
  CHECK(none.trajectory(maps, map).empty());
  const auto left = two.trajectory(maps, map);
  REQUIRE(left.size() == 2);
  CHECK(left[0].timestamp == 2.0);
  CHECK(left[1].timestamp == 3.0);
}

TEST_CASE("Frames that were forgotten count for the map that theirs became a part of") {
  random_bits random(5);
  slam::atlas maps(8, 1.2);
  const slam::map_id first = maps.active_id();
  test::add_random_keyframe(random, maps.active(), 30, 20);
  const slam::map_id second = maps.create();
  test::add_random_keyframe(random, maps.active(), 30, 20);
  const slam::map_id third = maps.create();
  test::add_random_keyframe(random, maps.active(), 30, 20);
  slam::detail::frame_log log(2);
  for (int i = 0; i < 3; ++i) log.add({1.0 * i, {first, 0}, {}});
  for (int i = 3; i < 5; ++i) log.add({1.0 * i, {second, 0}, {}});
  for (int i = 5; i < 9; ++i) log.add({1.0 * i, {third, 0}, {}});
  CHECK(log.largest_map(maps) == third);  // 3, 2 and 4 frames, of which 0, 0 and 2 are kept
  maps.merge(second, first, sim3{}, {0, 0});
  CHECK(log.largest_map(maps) == first);
  maps.merge(first, third, sim3{}, {0, 0});
  CHECK(log.largest_map(maps) == third);
  CHECK(log.trajectory(maps, third).size() == 2);
}
