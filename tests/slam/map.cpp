// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/map-inl.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;
using test::fault_of;
using test::random_frame;

TEST_CASE("A map is whole after any sequence of operations") {
  for (const std::uint64_t seed : {17U, 18U, 19U}) {
    random_bits random(seed);
    slam::map m(8, 1.2, 3);
    std::map<slam::landmark_id, slam::landmark_id> fused;
    for (int step = 0; step < 4000; ++step) {
      if (step == 2500)  // down to nothing, and up again
        for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k)
          if (m.has_keyframe(k)) m.erase_keyframe(k);
      test::change_somehow(random, m, 12);
      if (step % 5 == 0) REQUIRE(fault_of(m) == "");
    }
    REQUIRE(fault_of(m) == "");
    CHECK(m.keyframe_end() > 100);
    CHECK(m.keyframes().size() > 5);
    CHECK(m.landmark_end() > 1000);
  }
}

TEST_CASE("Where corrections change the scale, erased keyframes and what hangs on keyframes follow") {
  random_bits random(31);
  slam::map m(8, 1.2);
  for (int i = 0; i < 6; ++i) test::add_random_keyframe(random, m, 30, 20);
  const se3 T_old = m.at(2).T_world_camera;
  m.move_keyframe(2, sim3(so3{}, vec3(1, 0, 0), 2.0));
  CHECK((m.at(2).T_world_camera.translation() - (2.0 * T_old.translation() + vec3(1, 0, 0))).norm() < 1e-12);
  CHECK(m.scale(2) == 2.0);
  m.move_keyframe(4, sim3(so3{}, vec3(0, 0, 0), 0.25));
  // Erased, one after the other: poses stay, scales stay.
  const se3 at_4 = m.at(4).T_world_camera, at_2 = m.at(2).T_world_camera;
  m.erase_keyframe(4);
  m.erase_keyframe(2);
  CHECK((m.pose(4).inverse() * at_4).log().norm() < 1e-9);
  CHECK((m.pose(2).inverse() * at_2).log().norm() < 1e-9);
  CHECK(m.scale(4) == Approx(0.25));
  CHECK(m.scale(2) == Approx(2.0));
  // All is moved alike: as if nothing had been erased.
  const sim3 all(so3::exp(vec3(0.3, -0.2, 0.1)), vec3(1, 2, 3), 3.0);
  m.transform(all);
  CHECK((m.pose(4).translation() - all * at_4.translation()).norm() < 1e-9);
  CHECK((m.pose(2).translation() - all * at_2.translation()).norm() < 1e-9);
  CHECK(m.scale(4) == Approx(0.75));
  CHECK(m.scale(2) == Approx(6.0));
  // Of a map without keyframes as well, and as a part of another one.
  const se3 before_4 = m.pose(4);
  for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k)
    if (m.has_keyframe(k)) m.erase_keyframe(k);
  CHECK((m.pose(4).inverse() * before_4).log().norm() < 1e-9);
  slam::map other(8, 1.2);
  test::add_random_keyframe(random, other, 30, 20);
  const auto offsets = other.append(std::move(m), all, {0, slam::no_id});
  CHECK((other.pose(4 + offsets.keyframes).translation() - all * before_4.translation()).norm() < 1e-9);
  CHECK(other.scale(4 + offsets.keyframes) == Approx(2.25));
}

TEST_CASE("Erased keyframes are forgotten but for those that are asked for, the latest, and what they lead to") {
  for (const std::uint64_t seed : {23U, 24U}) {
    random_bits random(seed);
    slam::map m = test::random_map(seed, 8000, 12);
    m.transform(sim3(test::random_motion(random)));
    const slam::map before = m;
    std::vector<slam::keyframe_id> erased;
    for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k) {
      CHECK(m.remembers(k));
      if (!m.has_keyframe(k)) erased.push_back(k);
    }
    REQUIRE(erased.size() > 100);
    const std::vector<slam::keyframe_id> keep{erased[3], erased[50], erased[3], m.keyframes().back().id,
                                              m.keyframe_end()};
    m.forget_erased(keep, 10);
    REQUIRE(fault_of(m) == "");
    CHECK(m.keyframe_end() == before.keyframe_end());
    CHECK(m.keyframes().size() == before.keyframes().size());
    std::size_t remembered = 0, late = 0;
    slam::keyframe_id next = m.next_remembered(0);
    for (slam::keyframe_id k = 0; k != m.keyframe_end(); ++k) {
      CHECK((k == next) == m.remembers(k));
      if (k == next) next = m.next_remembered(k + 1);
      if (!m.remembers(k)) continue;
      CHECK((m.pose(k).inverse() * before.pose(k)).log().norm() == 0.0);
      CHECK(m.replacement(k) == before.replacement(k));
      if (m.has_keyframe(k)) continue;
      ++remembered;
      late += before.content().erasures - before.content().erased.at(k).number <= 10 ? 1U : 0U;
    }
    CHECK(next == m.keyframe_end());
    CHECK(m.remembers(erased[3]));
    CHECK(m.remembers(erased[50]));
    CHECK(late == 10);
    CHECK(remembered < 60);
    CHECK(m.content().forgotten == erased.size() - remembered);

    // It goes on, alone and as a part of another one.
    for (int step = 0; step != 500; ++step) test::change_somehow(random, m, 12);
    REQUIRE(fault_of(m) == "");
    slam::map other = test::random_map(seed + 10, 1000, 12);
    other.forget_erased({}, 0);
    CHECK(other.content().erased.empty());
    const std::size_t both = m.content().forgotten + other.content().forgotten;
    const se3 T = m.pose(erased[50]);
    m.append(std::move(other), sim3{}, {m.tree().root(), other.tree().root()});
    CHECK(m.content().forgotten == both);
    CHECK((m.pose(erased[50]).inverse() * T).log().norm() < 1e-12);
    REQUIRE(fault_of(m) == "");
    m.forget_erased({}, 0);
    CHECK(m.content().erased.empty());
    REQUIRE(fault_of(m) == "");
  }
}

TEST_CASE("Keyframes that share landmarks come most shared first") {
  random_bits random(3);
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, random_frame(random, 40, 0), {});
  auto second = random_frame(random, 40, 1);
  for (std::uint32_t i = 0; i < 10; ++i) second.landmarks[i] = m.at(0).landmarks[i];
  slam::detail::insert_keyframe(m, second, {});
  auto query = random_frame(random, 40, 2);
  for (std::uint32_t i = 0; i < 25; ++i) query.landmarks[i] = m.at(1).landmarks[i];

  const auto order = m.observers(query.landmarks);
  REQUIRE(order.size() == 2);
  CHECK(order[0] == slam::covisible{1, 25});
  CHECK(order[1] == slam::covisible{0, 10});
}

TEST_CASE("A landmark's descriptor is the most typical of those observed") {
  random_bits random(9);
  slam::map m(8, 1.2);
  auto f = random_frame(random, 1, 0);
  const auto typical = f.features.descriptors[0];
  slam::detail::insert_keyframe(m, f, {});
  const auto add = [&](std::uint64_t flipped) {
    auto g = random_frame(random, 1, m.keyframes().size());
    g.features.descriptors[0] = typical;
    g.features.descriptors[0].words[0] ^= flipped;
    g.landmarks[0] = 0;
    return slam::detail::insert_keyframe(m, std::move(g), {});
  };
  add(0xff00);
  add(0x00ff0000);
  const auto near = add(0x1);
  add(0xffffffffffffffffULL);
  const auto chosen = m.landmark_at(0).descriptor;
  CHECK(m.landmark_at(0).observations.size() == 5);
  CHECK(features::hamming{}(chosen, typical) <= 1);
  // Without these two the others have nothing in common with it.
  m.erase_observation(0, 0);
  m.erase_observation(0, near);
  CHECK_FALSE(m.landmark_at(0).has_current_descriptor);
  m.update_landmark(0);
  CHECK(m.landmark_at(0).has_current_descriptor);
  CHECK(features::hamming{}(m.landmark_at(0).descriptor, typical) >= 8);
}

TEST_CASE("The most typical of many descriptors is chosen among some, and is one of them") {
  random_bits random(10);
  std::vector<features::binary_descriptor<256>> all(500);
  for (std::size_t i = 0; i < all.size(); ++i)
    for (auto& w : all[i].words) w = i % 10 == 0 ? random() : random() & random() & random();
  const auto best = slam::detail::most_typical(
      all.size(), [&](std::size_t i) -> const auto& { return all[i]; });
  REQUIRE(best < all.size());
  CHECK(best % 10 != 0);  // not one of the outliers
  for (const std::size_t n : {1U, 2U})
    CHECK(slam::detail::most_typical(
              n, [&](std::size_t i) -> const auto& { return all[i]; }) == n - 1);
}

TEST_CASE("A fused landmark leads to what it became, and frames that show it join in") {
  random_bits random(12);
  slam::map m(8, 1.2);
  const auto first = slam::detail::insert_keyframe(m, random_frame(random, 4, 0), {});
  const auto second = slam::detail::insert_keyframe(m, random_frame(random, 4, 1), {});
  const auto a = m.at(first).landmarks[0], b = m.at(second).landmarks[0], c = m.at(second).landmarks[1];
  m.count_visible(a);
  CHECK(m.covisibility().shared(first, second) == 0);
  m.fuse(a, b);
  CHECK(m.covisibility().shared(first, second) == 1);
  CHECK(m.replacement(a) == b);
  CHECK(m.at(first).landmarks[0] == b);
  CHECK(m.landmark_at(b).visible == 3);
  CHECK(m.landmark_at(b).found == 2);
  m.fuse(b, c);  // the second keyframe sees both: its keypoint 0 shows nothing now
  CHECK(m.replacement(a) == c);
  CHECK(m.at(second).landmarks[0] == slam::no_id);
  CHECK(m.landmark_at(c).observations == std::vector<slam::observation>{{first, 0}, {second, 1}});

  auto f = random_frame(random, 4, 2);
  f.landmarks[3] = a;
  const auto third = m.add_keyframe(std::move(f));
  CHECK(m.at(third).landmarks[3] == c);
  CHECK(m.covisibility().shared(first, third) == 1);
  m.remove_landmark(c);
  CHECK(m.replacement(a) == slam::no_id);
  CHECK(fault_of(m) == "");
}

TEST_CASE("A keyframe hangs on the one that it shares most with, else on the newest") {
  random_bits random(13);
  slam::map m(8, 1.2);
  for (std::size_t i = 0; i < 3; ++i) slam::detail::insert_keyframe(m, random_frame(random, 40, i), {});
  CHECK(m.tree().root() == 0);
  CHECK(m.tree().parent(1) == 0);
  CHECK(m.tree().parent(2) == 1);
  auto f = random_frame(random, 40, 3);
  for (std::uint32_t i = 0; i < 10; ++i) f.landmarks[i] = m.at(1).landmarks[i];
  for (std::uint32_t i = 10; i < 18; ++i) f.landmarks[i] = m.at(2).landmarks[i];
  slam::detail::insert_keyframe(m, f, {});
  CHECK(m.tree().parent(3) == 1);
  CHECK(m.covisibility().neighbors(3) == std::vector<slam::covisible>{{1, 10}, {2, 8}});  // the best of 2
}

TEST_CASE("An erased keyframe leaves its landmarks to others, its children to its parent, and its pose to its heir") {
  random_bits random(14);
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, random_frame(random, 30, 0), {});
  auto f = random_frame(random, 30, 1);
  for (std::uint32_t i = 0; i < 20; ++i) f.landmarks[i] = m.at(0).landmarks[i];
  slam::detail::insert_keyframe(m, f, {});
  f = random_frame(random, 30, 2);
  f.landmarks[4] = m.at(1).landmarks[25];
  slam::detail::insert_keyframe(m, f, {});
  const auto shared = m.at(0).landmarks[3], own = m.at(1).landmarks[29];
  const se3 before = m.at(1).T_world_camera;
  const std::uint64_t changes = m.pose_changes();

  m.erase_keyframe(1);
  CHECK(m.pose_changes() > changes);
  REQUIRE(fault_of(m) == "");
  CHECK_FALSE(m.has_keyframe(1));
  CHECK(m.keyframes().size() == 2);
  CHECK(m.keyframe_end() == 3);
  CHECK(m.has_landmark(shared));
  CHECK_FALSE(m.has_landmark(own));
  CHECK(m.tree().parent(2) == 0);
  CHECK(m.replacement(slam::keyframe_id{1}) == 0);
  CHECK((m.pose(1).inverse() * before).log().norm() < 1e-12);

  const se3 moved = test::random_motion(random);
  m.set_pose(0, moved * m.at(0).T_world_camera);
  CHECK((m.pose(1).inverse() * (moved * before)).log().norm() < 1e-12);
  m.erase_keyframe(0);  // the root; the replacement of the replacement
  CHECK(m.replacement(slam::keyframe_id{1}) == 2);
  CHECK(m.tree().root() == 2);
  CHECK((m.pose(1).inverse() * (moved * before)).log().norm() < 1e-12);
  m.erase_keyframe(2);
  CHECK(m.replacement(slam::keyframe_id{1}) == slam::no_id);
  CHECK(m.landmark_count() == 0);
  CHECK((m.pose(1).inverse() * (moved * before)).log().norm() < 1e-12);
  m.transform(sim3(moved));
  CHECK((m.pose(1).inverse() * (moved * moved * before)).log().norm() < 1e-12);
  CHECK(slam::detail::insert_keyframe(m, random_frame(random, 5, 3), {}) == 3);
  CHECK(m.tree().root() == 3);
  CHECK(fault_of(m) == "");
}

TEST_CASE("A map put together from its parts is the same map") {
  const slam::map m = test::random_map(15, 3000);
  slam::detail::map_content parts = m.content();
  const slam::map again{std::move(parts)};
  REQUIRE(fault_of(again) == "");
  CHECK(again.landmark_count() == m.landmark_count());
  for (const slam::keyframe& k : m.keyframes()) {
    REQUIRE(again.at(k.id).landmarks == k.landmarks);
    REQUIRE(again.covisibility().neighbors(k.id) == m.covisibility().neighbors(k.id));
  }
}

TEST_CASE("A map absorbs another, which hangs on it where the caller says") {
  random_bits random(16);
  for (int round = 0; round < 10; ++round) {
    slam::map a = test::random_map(20 + static_cast<std::uint64_t>(round), 600);
    slam::map b = test::random_map(40 + static_cast<std::uint64_t>(round), 600);
    const slam::map a_before = a, b_before = b;
    slam::keyframe_id into = test::any_keyframe(random, a), from = test::any_keyframe(random, b);
    while (!a.has_keyframe(into)) into = test::any_keyframe(random, a);
    while (!b.has_keyframe(from)) from = test::any_keyframe(random, b);
    const se3 T = test::random_motion(random);

    const auto offsets = a.append(std::move(b), sim3(T), {into, from});
    REQUIRE(fault_of(a) == "");
    CHECK(a.pose_changes() > a_before.pose_changes());
    CHECK(fault_of(b) == "");  // NOLINT(bugprone-use-after-move): an empty map
    CHECK(b.keyframes().empty());
    CHECK(offsets.keyframes == a_before.keyframe_end());
    CHECK(a.keyframe_end() == a_before.keyframe_end() + b_before.keyframe_end().value());
    CHECK(a.landmark_count() == a_before.landmark_count() + b_before.landmark_count());
    CHECK(a.tree().parent(from + offsets.keyframes) == into);
    for (slam::keyframe_id k = 0; k != b_before.keyframe_end(); ++k)
      REQUIRE((a.pose(k + offsets.keyframes).inverse() * (T * b_before.pose(k))).log().norm() < 1e-9);
    for (slam::keyframe_id k = 0; k != a_before.keyframe_end(); ++k)
      REQUIRE((a.pose(k).inverse() * a_before.pose(k)).log().norm() == 0.0);
    for (slam::landmark_id l = 0; l != b_before.landmark_end(); ++l) {
      const auto now = b_before.replacement(l);
      REQUIRE(a.replacement(l + offsets.landmarks) == (now == slam::no_id ? now : now + offsets.landmarks));
      if (!b_before.has_landmark(l)) continue;
      const auto& moved = a.landmark_at(l + offsets.landmarks);
      REQUIRE((moved.position - T * b_before.landmark_at(l).position).norm() < 1e-9);
    }
    for (int step = 0; step < 300; ++step) test::change_somehow(random, a, 20);
    REQUIRE(fault_of(a) == "");
  }
}

TEST_CASE("Nothing absorbed changes nothing, and what nothing absorbs is what it was") {
  slam::map m = test::random_map(50, 500);
  const auto count = m.landmark_count();
  CHECK(m.append(slam::map(8, 1.2), sim3{}, {}).keyframes == m.keyframe_end());
  CHECK(m.landmark_count() == count);
  slam::map empty(8, 1.2, 3);
  CHECK(empty.append(std::move(m), sim3{}, {}).landmarks == 0);
  CHECK(empty.landmark_count() == count);
  CHECK(fault_of(empty) == "");
}

TEST_CASE("Close points become landmarks first and far ones fill up to the minimum") {
  random_bits random(4);
  auto f = random_frame(random, 50, 0);
  for (std::size_t i = 0; i < 30; ++i) f.depth[i] = 5.0F + static_cast<float>(i) * 0.1F;
  for (std::size_t i = 45; i < 50; ++i) f.depth[i] = 0.0F;
  CHECK(slam::detail::new_landmark_keypoints(f, {.min_new_landmarks = 10}).size() == 15);
  CHECK(slam::detail::new_landmark_keypoints(f, {.min_new_landmarks = 20}).size() == 20);
  const auto all = slam::detail::new_landmark_keypoints(f, {.min_new_landmarks = 100});
  CHECK(all.size() == 45);
  CHECK(all.back() == 29);
}
