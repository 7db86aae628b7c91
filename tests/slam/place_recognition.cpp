// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/slam/place_recognition.hpp>

#include "slam/known_places.hpp"
#include "support/catch.hpp"

using namespace orbis;
using slam::map_keyframe;

static_assert(slam::place_recognizer<slam::bag_of_words_places, features::binary_descriptor<256>>);
static_assert(slam::place_recognizer<test::known_places, features::binary_descriptor<256>>);
static_assert(slam::place_recognizer<test::known_places, features::binary_descriptor<128>>);
static_assert(!slam::place_recognizer<slam::bag_of_words_places, features::binary_descriptor<128>>);

namespace {

features::features image_of(std::uint64_t seed) {
  random_bits random(seed);
  features::features f;
  for (int i = 0; i < 200; ++i) {
    features::binary_descriptor<256> d;
    for (auto& w : d.words) w = random();
    f.keypoints.emplace_back();
    f.descriptors.push_back(d);
  }
  return f;
}

constexpr auto all = [](map_keyframe) { return false; };
constexpr auto alone = [](map_keyframe) { return std::vector<map_keyframe>{}; };

}  // namespace

TEST_CASE("Keyframes are found by their appearance, in any map, under the id they have") {
  slam::bag_of_words_places places;
  const auto first = places.describe(image_of(1)), second = places.describe(image_of(2));
  CHECK(places.add({0, 7}, first));
  CHECK_FALSE(places.add({0, 7}, second));
  CHECK(places.add({3, 7}, second));
  CHECK(places.size() == 2);
  REQUIRE_FALSE(places.similar(first, 5, all, alone).empty());
  CHECK(places.similar(first, 5, all, alone).front() == map_keyframe{0, 7});
  CHECK(places.similar(second, 1, all, alone) == std::vector<map_keyframe>{{3, 7}});
  for (const map_keyframe& k : places.similar(
           first, 5, [](map_keyframe k) { return k.map == 0; }, alone))
    CHECK(k.map == 3);

  CHECK(places.rename({0, 7}, {3, 20}));
  CHECK_FALSE(places.rename({0, 7}, {3, 21}));  // is not there any more
  CHECK_FALSE(places.rename({3, 20}, {3, 7}));  // the id is taken
  CHECK(places.similar(first, 5, all, alone).front() == map_keyframe{3, 20});
  CHECK(places.erase({3, 20}));
  CHECK_FALSE(places.erase({3, 20}));
  CHECK(places.size() == 1);
}
