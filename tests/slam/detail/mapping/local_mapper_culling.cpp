// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/local_mapper.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;
using test::random_frame;

namespace {

constexpr double close_depth = 3.2;
constexpr auto keep_none = [](slam::keyframe_id) { return false; };

/// Shows the first `known` landmarks of keyframe 1 again, at levels `coarser` than it does.
slam::keyframe_id add(random_bits& random, slam::map& m, std::uint32_t known, int coarser = 0) {
  auto f = random_frame(random, 40, m.keyframe_end().value());
  for (std::uint32_t i = 0; i < known; ++i) {
    f.landmarks[i] = m.at(1).landmarks[i];
    f.features.keypoints[i].octave = m.at(1).features.keypoints[i].octave + coarser;
  }
  return slam::detail::insert_keyframe(m, std::move(f), {});
}

/// A keyframe that nothing else is about, then keyframe 1.
[[nodiscard]] slam::map start(random_bits& random) {
  slam::map m(8, 1.2);
  for (std::size_t i = 0; i < 2; ++i) slam::detail::insert_keyframe(m, random_frame(random, 40, i), {});
  return m;
}

}  // namespace

TEST_CASE("A keyframe is redundant when three others see nine tenths of its close landmarks") {
  random_bits random(1);
  slam::map m = start(random);
  for (int i = 0; i < 2; ++i) add(random, m, 40);
  CHECK_FALSE(slam::detail::is_redundant(m, 1, close_depth, {}));
  add(random, m, 35);
  CHECK_FALSE(slam::detail::is_redundant(m, 1, close_depth, {}));
  add(random, m, 36);
  CHECK(slam::detail::is_redundant(m, 1, close_depth, {}));
  CHECK_FALSE(slam::detail::is_redundant(m, 1, close_depth, {.redundant = 0.95}));
  CHECK_FALSE(slam::detail::is_redundant(m, 1, close_depth, {.redundant_observers = 4}));
  CHECK_FALSE(slam::detail::is_redundant(m, 0, close_depth, {}));
  CHECK_FALSE(slam::detail::is_redundant(m, 1, 1.0, {}));  // nothing is close
  CHECK(slam::detail::is_redundant(m, 1, std::numeric_limits<double>::infinity(), {}));
}

TEST_CASE("Those that see it worse do not make a keyframe redundant") {
  random_bits random(2);
  slam::map m = start(random);
  for (int i = 0; i < 3; ++i) add(random, m, 40, 2);
  CHECK_FALSE(slam::detail::is_redundant(m, 1, close_depth, {}));
  CHECK(slam::detail::is_redundant(m, 1, close_depth, {.coarser_levels = 2}));
  for (int i = 0; i < 3; ++i) add(random, m, 40, 1);
  CHECK(slam::detail::is_redundant(m, 1, close_depth, {}));
}

TEST_CASE("Redundant neighbours go as long as they are redundant, but those that are wanted") {
  random_bits random(3);
  slam::map m = start(random);
  // Keyframes 2 to 7 see the same as 1 and nothing else: of these seven three stay.
  for (int i = 0; i < 6; ++i) {
    auto f = random_frame(random, 40, m.keyframe_end().value());
    f.features.keypoints = m.at(1).features.keypoints;
    f.landmarks = m.at(1).landmarks;
    m.add_keyframe(std::move(f));
  }
  slam::map kept = m, looped = m;
  const auto erased = slam::detail::cull_keyframes(m, 7, close_depth, {}, keep_none);
  CHECK(erased == std::vector<slam::keyframe_id>{1, 2, 3, 4});
  CHECK(m.keyframes().size() == 4);
  CHECK(test::fault_of(m) == "");
  CHECK(m.replacement(slam::keyframe_id{3}) == 0);

  CHECK(slam::detail::cull_keyframes(kept, 7, close_depth, {}, [](slam::keyframe_id k) { return k != 6; }) ==
        std::vector<slam::keyframe_id>{6});
  // Loop edges keep none, and pass to the replacement: one between 2 and 6 is one between 0 and 6.
  looped.add_loop_edge(2, 6);
  CHECK(slam::detail::cull_keyframes(looped, 7, close_depth, {}, keep_none) == erased);
  CHECK(looped.replacement(slam::keyframe_id{2}) == 0);
  CHECK(looped.tree().loop_edges(0) == std::vector<slam::keyframe_id>{6});
  CHECK(looped.tree().loop_edges(6) == std::vector<slam::keyframe_id>{0});
  CHECK(test::fault_of(looped) == "");
}

TEST_CASE("The root stays") {
  random_bits random(4);
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, random_frame(random, 40, 0), {});
  for (int i = 0; i < 5; ++i) {
    auto f = random_frame(random, 40, m.keyframe_end().value());
    f.features.keypoints = m.at(0).features.keypoints;
    f.landmarks = m.at(0).landmarks;
    m.add_keyframe(std::move(f));
  }
  CHECK(slam::detail::is_redundant(m, 0, close_depth, {}));
  slam::detail::cull_keyframes(m, 5, close_depth, {}, keep_none);
  CHECK(m.has_keyframe(0));
  CHECK(m.keyframes().size() == 3);
}

namespace {

/// A keyframe that shows the first `known` landmarks of keyframe 0 again.
slam::keyframe_id add_again(random_bits& random, slam::map& m, std::uint32_t known) {
  auto f = random_frame(random, 40, m.keyframe_end().value());
  for (std::uint32_t i = 0; i < known; ++i) f.landmarks[i] = m.at(0).landmarks[i];
  return slam::detail::insert_keyframe(m, std::move(f), {});
}

}  // namespace

TEST_CASE("A landmark that is not seen again two keyframes later goes") {
  random_bits random(1);
  slam::map m(8, 1.2);
  slam::detail::insert_keyframe(m, random_frame(random, 40, 0), {});
  const auto one = add_again(random, m, 30);
  CHECK(slam::detail::cull_landmarks(m, one, {}) == 0);
  const auto two = add_again(random, m, 20);
  CHECK(m.landmark_count() == 40 + 10 + 20);
  CHECK(slam::detail::cull_landmarks(m, two, {}) == 10);  // the last ten of keyframe 0
  const auto three = add_again(random, m, 20);
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
  for (int i = 0; i < 10; ++i) newest = add_again(random, m, 40);
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
  add_again(random, m, 40);
  slam::keyframe_id newest = 1;
  for (int i = 0; i < 6; ++i) newest = add_again(random, m, 0);
  const auto l = m.at(0).landmarks[0];
  for (int i = 0; i < 50; ++i) m.count_visible(l);
  slam::detail::cull_landmarks(m, newest, {});
  CHECK(m.has_landmark(l));
  newest = add_again(random, m, 40);
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
