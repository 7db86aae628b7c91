// SPDX-License-Identifier: BSD-3-Clause
#include <concepts>
#include <cstdint>
#include <map>
#include <sstream>
#include <type_traits>

#include <orbis/slam/ids.hpp>

#include "support/catch.hpp"

using namespace orbis;
using slam::keyframe_id;
using slam::landmark_id;
using slam::map_id;

// Ids of different kinds do not mix, and no id becomes a number by itself.
static_assert(!std::is_convertible_v<landmark_id, keyframe_id> && !std::is_convertible_v<keyframe_id, landmark_id>);
static_assert(!std::is_convertible_v<map_id, keyframe_id> && !std::is_convertible_v<keyframe_id, std::uint32_t>);
static_assert(!std::is_constructible_v<keyframe_id, landmark_id>);
static_assert(!std::equality_comparable_with<keyframe_id, landmark_id>);
static_assert(std::is_convertible_v<std::uint32_t, landmark_id>);
static_assert(sizeof(landmark_id) == 4 && std::is_trivially_copyable_v<landmark_id>);

TEST_CASE("An id refers to nothing unless it is given a number") {
  CHECK(keyframe_id{} == slam::no_id);
  CHECK(keyframe_id{3} != slam::no_id);
  CHECK(keyframe_id{3}.value() == 3);
}

TEST_CASE("Ids are ordered, counted on, and written as numbers") {
  keyframe_id k = 5;
  CHECK(k++ == 5);
  CHECK(++k == 7);
  k += 3;
  CHECK(k == 10);
  CHECK(k + 2 == 12);
  CHECK(k - keyframe_id{4} == 6);
  CHECK(keyframe_id{4} < k);
  CHECK(to_string(k) == "10");
  std::ostringstream out;
  out << landmark_id{7};
  CHECK(out.str() == "7");
  const std::map<map_id, int> by_map{{2, 1}, {1, 0}};
  CHECK(by_map.begin()->first == 1);
}

TEST_CASE("A keyframe of an atlas is the same if map and keyframe are") {
  CHECK(slam::map_keyframe{1, 2} == slam::map_keyframe{1, 2});
  CHECK_FALSE(slam::map_keyframe{1, 2} == slam::map_keyframe{2, 2});
  CHECK(slam::map_keyframe{}.keyframe == slam::no_id);
}
