// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/landmark_culling.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;
using test::random_frame;

namespace {

/// A keyframe that shows the first `known` landmarks of keyframe 0 again.
slam::keyframe_id add(random_bits& random, slam::map& m, std::uint32_t known) {
  auto f = random_frame(random, 40, m.keyframe_end().value());
  for (std::uint32_t i = 0; i < known; ++i) f.landmarks[i] = m.at(0).landmarks[i];
  return slam::detail::insert_keyframe(m, std::move(f), {});
}

}  // namespace

TEST_CASE("A landmark that is not seen again two keyframes later goes") {
  random_bits random(1);
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, random_frame(random, 40, 0), {});
  const auto one = add(random, m, 30);
  CHECK(slam::detail::cull_landmarks(m, one, {}) == 0);
  const auto two = add(random, m, 20);
  CHECK(m.landmark_count() == 40 + 10 + 20);
  CHECK(slam::detail::cull_landmarks(m, two, {}) == 10);  // the last ten of keyframe 0
  const auto three = add(random, m, 20);
  CHECK(slam::detail::cull_landmarks(m, three, {}) == 10);  // the new ones of keyframe 1
  CHECK(test::fault_of(m) == "");
}

TEST_CASE("An observation without depth counts half") {
  random_bits random(2);
  slam::map m(8, 1.2);
  auto f = random_frame(random, 3, 0);
  f.depth[1] = f.depth[2] = 0.0F;
  m.add_keyframe(std::move(f));
  const auto full = m.add_landmark(0, 0), half = m.add_landmark(0, 1, vec3(0, 0, 2)),
             twice = m.add_landmark(0, 2, vec3(0, 0, 2));
  const auto without_depth = [&](std::vector<slam::landmark_id> seen) {
    auto g = random_frame(random, seen.size(), m.keyframe_end().value());
    g.landmarks = std::move(seen);
    for (float& z : g.depth) z = 0.0F;
    return m.add_keyframe(std::move(g));
  };
  without_depth({full, half, twice});
  const auto two = without_depth({full, twice});
  CHECK(slam::detail::support(m, m.landmark_at(full)) == 4);
  CHECK(slam::detail::support(m, m.landmark_at(half)) == 2);
  CHECK(slam::detail::support(m, m.landmark_at(twice)) == 3);
  CHECK(slam::detail::cull_landmarks(m, two, {}) == 2);
  CHECK(m.has_landmark(full));
}

TEST_CASE("A landmark that is seldom found where it should be seen goes, however old") {
  random_bits random(3);
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, random_frame(random, 40, 0), {});
  slam::keyframe_id newest = 0;
  for (int i = 0; i < 10; ++i) newest = add(random, m, 40);
  const auto l = m.at(0).landmarks[0], often = m.at(0).landmarks[1];
  for (int i = 0; i < 11; ++i) m.count_visible(l);
  for (int i = 0; i < 2; ++i) m.count_found(l);
  CHECK(slam::detail::cull_landmarks(m, newest, {}) == 0);  // 3 of 12
  m.count_visible(l);
  for (int i = 0; i < 100; ++i) m.count_visible(often);
  for (int i = 0; i < 25; ++i) m.count_found(often);
  CHECK(slam::detail::cull_landmarks(m, newest, {}) == 1);
  CHECK_FALSE(m.has_landmark(l));
  CHECK(m.has_landmark(often));
  CHECK(test::fault_of(m) == "");
}

TEST_CASE("Culling looks at what is around the newest keyframe only") {
  random_bits random(4);
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, random_frame(random, 40, 0), {});
  add(random, m, 40);
  slam::keyframe_id newest = 1;
  for (int i = 0; i < 6; ++i) newest = add(random, m, 0);
  const auto l = m.at(0).landmarks[0];
  for (int i = 0; i < 50; ++i) m.count_visible(l);
  slam::detail::cull_landmarks(m, newest, {});
  CHECK(m.has_landmark(l));
  newest = add(random, m, 40);
  slam::detail::cull_landmarks(m, newest, {});
  CHECK_FALSE(m.has_landmark(l));
}

TEST_CASE("A map is whole after culling, whatever came before") {
  for (std::uint64_t seed = 60; seed < 70; ++seed) {
    random_bits random(seed);
    slam::map m = test::random_map(seed, 1500);
    const auto newest = test::add_random_keyframe(random, m, 30, 20);
    slam::detail::cull_landmarks(m, newest, {.min_visible = 0, .age = 1 + random.below(3)});
    REQUIRE(test::fault_of(m) == "");
  }
}
