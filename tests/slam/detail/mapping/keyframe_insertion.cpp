// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstddef>
#include <span>
#include <string>
#include <utility>

#include <orbis/core/random.hpp>
#include <orbis/slam/detail/mapping/keyframe_insertion.hpp>
#include <orbis/slam/map_file.hpp>

#include "slam/random_map.hpp"
#include "support/catch.hpp"

using namespace orbis;

TEST_CASE("All close keypoints become landmarks, and the nearest of the others up to a number") {
  random_bits random(1);
  auto f = test::random_frame(random, 10, 0);
  f.depth = {5.0F, 1.0F, 0.0F, 4.0F, 2.0F, 7.0F, 3.0F, 6.0F, 2.5F, 8.0F};
  f.landmarks[1] = 77;  // known already
  slam::options o;
  o.close_depth = 3.2;
  o.min_new_landmarks = 0;
  CHECK(slam::detail::new_landmark_keypoints(f, o) == std::vector<std::uint32_t>{4, 8, 6});
  o.min_new_landmarks = 5;
  CHECK(slam::detail::new_landmark_keypoints(f, o) == std::vector<std::uint32_t>{4, 8, 6, 3, 0});
  o.min_new_landmarks = 100;
  CHECK(slam::detail::new_landmark_keypoints(f, o).size() == 8);
}

TEST_CASE("A keyframe observes what its frame shows, and makes landmarks of the rest") {
  random_bits random(2);
  slam::map m(8, 1.2);
  const auto first = slam::detail::insert_keyframe(m, test::random_frame(random, 30, 0), {});
  CHECK(m.landmark_count() == 30);
  auto next = test::random_frame(random, 30, 1);
  for (std::uint32_t i = 0; i < 20; ++i) next.landmarks[i] = m.at(first).landmarks[i];
  next.depth[25] = 0.0F;
  const auto second = slam::detail::insert_keyframe(m, next, {});
  CHECK(test::fault_of(m) == "");
  CHECK(m.landmark_count() == 39);
  CHECK(m.at(second).landmarks[25] == slam::no_id);
  CHECK(m.covisibility().shared(first, second) == 20);
  for (const auto& l : m.landmarks()) CHECK(l.has_current_descriptor);
}

TEST_CASE("Where ids run out, keyframes are made without new landmarks, and the map is whole when it is read again") {
  random_bits random(3);
  slam::detail::map_content<features::binary_descriptor<256>> content;
  content.landmarks.add_gone(slam::map{content}.landmark_ids_left() - 40);
  slam::map m{std::move(content)};
  CHECK(m.landmark_ids_left() == 40);
  slam::detail::insert_keyframe(m, test::random_frame(random, 30, 0), {});
  CHECK(m.landmark_count() == 30);
  const auto second = slam::detail::insert_keyframe(m, test::random_frame(random, 30, 1), {});
  CHECK(m.landmark_count() == 40);
  CHECK(m.landmark_ids_left() == 0);
  CHECK(std::count(m.at(second).landmarks.begin(), m.at(second).landmarks.end(), slam::no_id) == 20);
  slam::detail::insert_keyframe(m, test::random_frame(random, 30, 2), {});
  CHECK(m.landmark_count() == 40);
  CHECK(test::fault_of(m) == "");
  m.remove_landmark(m.next_landmark(0));
  CHECK(test::fault_of(m) == "");

  const std::string bytes = slam::map_bytes(m);
  auto again = slam::parse_map(std::as_bytes(std::span{bytes}));
  REQUIRE(again.has_value());
  CHECK(again->landmark_count() == 39);
  slam::detail::insert_keyframe(*again, test::random_frame(random, 30, 3), {});
  CHECK(again->landmark_count() == 69);
  CHECK(test::fault_of(*again) == "");
}
