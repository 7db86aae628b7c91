// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/core/random.hpp>
#include <orbis/slam/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/mapping.hpp>

#include "support/catch.hpp"

using namespace orbis;

namespace {

/// A frame of `n` keypoints with random descriptors, all two metres away.
slam::frame random_frame(random_bits& random, std::size_t n, std::size_t index) {
  slam::frame f;
  f.index = index;
  f.T_world_camera = se3(so3{}, vec3(0.1 * static_cast<double>(index), 0, 0));
  for (std::size_t i = 0; i < n; ++i) {
    features::keypoint k;
    k.x = static_cast<float>(random.uniform(0, 640));
    k.y = static_cast<float>(random.uniform(0, 480));
    f.features.keypoints.push_back(k);
    features::binary_descriptor<256> d;
    for (auto& w : d.words) w = random();
    f.features.descriptors.push_back(d);
    f.depth.push_back(2.0F);
    f.rays.emplace_back((static_cast<double>(k.x) - 320) / 525, (static_cast<double>(k.y) - 240) / 525, 1.0);
    f.landmarks.push_back(slam::no_id);
  }
  return f;
}

void check_consistent(const slam::map& m) {
  std::size_t alive = 0, observations = 0, seen = 0;
  for (slam::landmark_id l = 0; l < m.landmarks().size(); ++l) {
    const auto& landmark = m.landmark_at(l);
    if (!landmark.alive) {
      REQUIRE(landmark.observations.empty());
      continue;
    }
    ++alive;
    REQUIRE_FALSE(landmark.observations.empty());
    for (std::size_t i = 0; i < landmark.observations.size(); ++i) {
      const auto& o = landmark.observations[i];
      REQUIRE(m.at(o.keyframe).landmarks[o.feature] == l);
      if (i > 0) REQUIRE(landmark.observations[i - 1].keyframe < o.keyframe);
      ++observations;
    }
  }
  for (const auto& k : m.keyframes())
    for (const auto l : k.landmarks) {
      if (l == slam::no_id) continue;
      REQUIRE(m.is_alive(l));
      ++seen;
    }
  REQUIRE(alive == m.landmark_count());
  REQUIRE(observations == seen);
}

}  // namespace

TEST_CASE("Both sides of every observation agree after any sequence of operations") {
  random_bits random(17);
  slam::map m(8, 1.2);
  const auto any_landmark = [&] { return random.below(static_cast<std::uint32_t>(m.landmarks().size())); };
  const auto any_keyframe = [&] { return random.below(static_cast<std::uint32_t>(m.keyframes().size())); };
  slam::insert_keyframe(m, random_frame(random, 30, 0), {});
  for (int step = 0; step < 2000; ++step) {
    const auto l = any_landmark();
    switch (random.below(6)) {
      case 0: {
        if (m.keyframes().size() >= 30) break;
        auto f = random_frame(random, 30, m.keyframes().size());
        for (int i = 0; i < 12; ++i) f.landmarks[random.below(30)] = any_landmark();
        slam::insert_keyframe(m, std::move(f), {});
        break;
      }
      case 1:
        if (m.is_alive(l)) m.observe(l, any_keyframe(), random.below(30));
        break;
      case 2: m.forget(l, any_keyframe()); break;
      case 3:
        if (random.below(20) == 0) m.remove_landmark(l);
        break;
      case 4:
        if (const auto into = any_landmark(); into != l && m.is_alive(l) && m.is_alive(into)) m.merge(l, into);
        break;
      default:
        if (m.is_alive(l)) m.update(l);
    }
    if (step % 20 == 0) check_consistent(m);
  }
  check_consistent(m);
  CHECK(m.keyframes().size() == 30);
  slam::cull_landmarks(m, 29);
  check_consistent(m);
}

TEST_CASE("Keyframes that share landmarks come most shared first") {
  random_bits random(3);
  slam::map m(8, 1.2);
  slam::insert_keyframe(m, random_frame(random, 40, 0), {});
  auto second = random_frame(random, 40, 1);
  for (std::uint32_t i = 0; i < 10; ++i) second.landmarks[i] = m.at(0).landmarks[i];
  slam::insert_keyframe(m, second, {});
  auto query = random_frame(random, 40, 2);
  for (std::uint32_t i = 0; i < 25; ++i) query.landmarks[i] = m.at(1).landmarks[i];

  const auto order = m.sharing(query.landmarks);
  REQUIRE(order.size() == 2);
  CHECK(order[0] == std::pair<slam::keyframe_id, std::size_t>(1, 25));
  CHECK(order[1] == std::pair<slam::keyframe_id, std::size_t>(0, 10));
  CHECK(slam::most_shared(m, query, 7) == 1);
  CHECK(slam::most_shared(m, random_frame(random, 5, 3), 7) == 7);
  CHECK(slam::local_landmarks(m, query, 0, 40).size() == 70);
  CHECK(slam::local_keyframes(m, query, 0, 1).size() == 1);
}

TEST_CASE("A landmark's descriptor is the most typical of those observed") {
  random_bits random(9);
  slam::map m(8, 1.2);
  auto f = random_frame(random, 1, 0);
  const auto typical = f.features.descriptors[0];
  slam::insert_keyframe(m, f, {});
  const auto add = [&](std::uint64_t flipped) {
    auto g = random_frame(random, 1, m.keyframes().size());
    g.features.descriptors[0] = typical;
    g.features.descriptors[0].words[0] ^= flipped;
    g.landmarks[0] = 0;
    slam::insert_keyframe(m, std::move(g), {});
  };
  add(0xff00);
  add(0x00ff0000);
  add(0x1);
  add(0xffffffffffffffffULL);
  const auto chosen = m.landmark_at(0).descriptor;
  CHECK(m.landmark_at(0).observations.size() == 5);
  CHECK(features::hamming{}(chosen, typical) <= 1);
}

TEST_CASE("Close points become landmarks first and far ones fill up to the minimum") {
  random_bits random(4);
  auto f = random_frame(random, 50, 0);
  for (std::size_t i = 0; i < 30; ++i) f.depth[i] = 5.0F + static_cast<float>(i) * 0.1F;
  for (std::size_t i = 45; i < 50; ++i) f.depth[i] = 0.0F;
  CHECK(slam::new_landmark_keypoints(f, {.min_new_landmarks = 10}).size() == 15);
  CHECK(slam::new_landmark_keypoints(f, {.min_new_landmarks = 20}).size() == 20);
  const auto all = slam::new_landmark_keypoints(f, {.min_new_landmarks = 100});
  CHECK(all.size() == 45);
  CHECK(all.back() == 29);
}
