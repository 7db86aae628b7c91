// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/map/local_map.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;
using test::random_frame;

namespace {

/// A walk on which each keyframe shows 20 of the 40 landmarks of the one before.
[[nodiscard]] slam::map chain(std::size_t length) {
  random_bits random(3);
  slam::map m(8, 1.2);
  for (std::size_t i = 0; i < length; ++i) {
    auto f = random_frame(random, 40, i);
    if (i > 0)
      for (std::uint32_t j = 0; j < 20; ++j) f.landmarks[j] = m.keyframes().back().landmarks[20 + j];
    slam::detail::insert_keyframe(m, std::move(f), {});
  }
  return m;
}

}  // namespace

TEST_CASE("The keyframe that shares most with a frame, if any does") {
  random_bits random(4);
  const slam::map m = chain(3);
  auto query = random_frame(random, 40, 9);
  CHECK(slam::detail::most_shared(m, query, 7) == 7);
  for (std::uint32_t i = 0; i < 25; ++i) query.landmarks[i] = m.at(1).landmarks[i];
  CHECK(slam::detail::most_shared(m, query, 7) == 1);
}

TEST_CASE("The local map is the reference, who shares with the frame, and their neighbours") {
  random_bits random(5);
  slam::map m = chain(30);
  auto query = random_frame(random, 40, 30);
  for (std::uint32_t i = 0; i < 15; ++i) query.landmarks[i] = m.at(10).landmarks[5 + i];  // shared with 9
  // 20 has nothing in common with the rest but is the reference: its neighbours come as well.
  CHECK(slam::detail::local_keyframes(m, query, 20, 40) == std::vector<slam::keyframe_id>{20, 9, 10, 19, 21, 8, 11});
  CHECK(slam::detail::local_keyframes(m, query, 20, 3) == std::vector<slam::keyframe_id>{20, 9, 10});
  CHECK(slam::detail::local_keyframes(m, query, 20, 1) == std::vector<slam::keyframe_id>{20});
  CHECK(slam::detail::local_landmarks(m, query, 20, 3).size() == 40 + 60);
  const auto landmarks = slam::detail::observed_landmarks(m, {3, 4, 5, 3});
  CHECK(landmarks.size() == 80);
  CHECK(std::is_sorted(landmarks.begin(), landmarks.end()));
  CHECK(std::adjacent_find(landmarks.begin(), landmarks.end()) == landmarks.end());
  for (const slam::keyframe_id k : {3, 4, 5})
    for (const slam::landmark_id l : m.at(k).landmarks)
      CHECK(std::binary_search(landmarks.begin(), landmarks.end(), l));
  CHECK(slam::detail::observed_landmarks(m, {}).empty());

  m.erase_keyframe(20);  // its heir takes its place
  CHECK(slam::detail::local_keyframes(m, query, 20, 3) == std::vector<slam::keyframe_id>{19, 9, 10});
}

TEST_CASE("Ids are sorted, and each is kept once, whether they are dense or far apart") {
  random_bits random(7);
  for (const std::uint32_t range : {1U, 100U, 4000U, 4'000'000'000U}) {
    std::vector<slam::landmark_id> ids;
    for (int i = 0; i != 500; ++i) ids.emplace_back(static_cast<std::uint32_t>(random.uniform(0.0, range)));
    auto expected = ids;
    std::sort(expected.begin(), expected.end());
    expected.erase(std::unique(expected.begin(), expected.end()), expected.end());
    slam::detail::sort_unique(ids);
    CHECK(ids == expected);
    slam::detail::sort_unique(ids);
    CHECK(ids == expected);
  }
  std::vector<slam::landmark_id> none;
  slam::detail::sort_unique(none);
  CHECK(none.empty());
}

TEST_CASE("A frame that shows nothing has the surroundings of its reference") {
  random_bits random(6);
  const slam::map m = chain(30);
  CHECK(slam::detail::local_keyframes(m, random_frame(random, 40, 30), 15, 40) ==
        std::vector<slam::keyframe_id>{15, 14, 16});
}
