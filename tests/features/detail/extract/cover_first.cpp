// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/detail/extract/cover_first.hpp>

#include "support/catch.hpp"

using namespace orbis::features;
using namespace orbis::features::detail;

TEST_CASE("covering takes the strongest of each cell on any level, then the strongest of the levels") {
  std::vector<level_corners> levels(2);
  levels[0].area = {10, 10, 200, 200};
  levels[1].area = {5, 5, 100, 100};
  levels[1].scale = 2.0;
  for (int i = 0; i != 60; ++i) levels[0].corners.push_back({20 + i % 8, 20 + i / 8, 100.0F + static_cast<float>(i)});
  for (int i = 0; i != 30; ++i) levels[1].corners.push_back({12 + i % 8, 12 + i / 8, 200.0F + static_cast<float>(i)});
  levels[0].corners.push_back({180, 180, 5.0F});
  levels[1].corners.push_back({91, 91, 6.0F});  // in the same cell as the one before, but stronger
  levels[0].corners.push_back({180, 30, 4.0F});
  cover_first::workspace memory;
  cover_first{.share = 0.4}(levels, 40, memory);  // 16 cells of 50 pixels
  CHECK(levels[0].corners.size() + levels[1].corners.size() == 40);
  const auto has = [&](std::size_t level, const corner& c) {
    return std::count(levels[level].corners.begin(), levels[level].corners.end(), c) == 1;
  };
  CHECK(has(1, {91, 91, 6.0F}));
  CHECK_FALSE(has(0, {180, 180, 5.0F}));
  CHECK(has(0, {180, 30, 4.0F}));
  CHECK(has(0, {20 + 59 % 8, 20 + 59 / 8, 159.0F}));
  CHECK(has(1, {12 + 29 % 8, 12 + 29 / 8, 229.0F}));
  for (const level_corners& level : levels)
    CHECK(std::is_sorted(level.corners.begin(), level.corners.end(), before_in_image));
  for (const level_corners& level : levels)
    for (const corner& c : level.corners) CHECK(c.response > 0.0F);
}

TEST_CASE("too few corners to choose from are all left, and a weak one covers an empty part of the image") {
  const auto levels_of = [](std::size_t count) {
    std::vector<level_corners> levels(1);
    levels[0].area = {0, 0, 100, 100};
    for (std::size_t i = 0; i != count; ++i)
      levels[0].corners.push_back(
          {static_cast<int>(i % 100), static_cast<int>(i / 100), static_cast<float>(i * 37 % 101)});
    return levels;
  };
  const auto left = [](auto levels, const cover_first& choose, int wanted) {
    cover_first::workspace memory;
    choose(levels, wanted, memory);
    return levels[0].corners;
  };
  CHECK(left(levels_of(40), cover_first{.share = 1.0}, 50) == levels_of(40)[0].corners);
  // One cell for each wanted corner: the weakest corner of an empty part of the image is there.
  auto levels = levels_of(300);
  levels[0].corners.push_back({99, 99, 0.5F});
  const auto covered = left(levels, cover_first{.share = 1.0}, 50);
  CHECK(covered.size() == 50);
  CHECK(covered.back() == corner{99, 99, 0.5F});
}

using namespace orbis;

namespace {

/// What a distribution leaves on one level.
std::vector<corner> chosen(const cover_first& choose, std::vector<corner> corners, int wanted, const region& area) {
  std::vector<level_corners> levels(1);
  levels[0].corners = std::move(corners);
  levels[0].area = area;
  cover_first::workspace memory;
  choose(levels, wanted, memory);
  return levels[0].corners;
}

/// Different places, few different strengths.
std::vector<corner> random_corners(std::size_t count, const region& area, std::uint64_t seed) {
  random_bits random{seed};
  std::vector<corner> corners;
  for (int y = area.y; y != area.y + area.height; ++y)
    for (int x = area.x; x != area.x + area.width; ++x) corners.push_back({x, y, static_cast<float>(random.below(40))});
  for (std::size_t i = corners.size(); i > 1; --i)
    std::swap(corners[i - 1], corners[random.below(static_cast<std::uint32_t>(i))]);
  corners.resize(std::min(corners.size(), count));
  return corners;
}

bool in_image_order(const std::vector<corner>& corners) {
  return std::is_sorted(corners.begin(), corners.end(), before_in_image);
}

}  // namespace

TEST_CASE("every share leaves as many as wanted, in order, whatever the order before") {
  const cover_first choose{.share = GENERATE(0.0, 0.25)};
  const region area{20, 30, 150, 97};
  const auto corners = random_corners(600, area, 1);
  for (const int wanted : {0, 1, 2, 7, 100, 599, 600, 601, 5000}) {
    const auto some = chosen(choose, corners, wanted, area);
    CHECK(some.size() == std::min(corners.size(), static_cast<std::size_t>(wanted)));
    CHECK(in_image_order(some));
    CHECK(std::adjacent_find(some.begin(), some.end()) == some.end());
    for (const corner& c : some) CHECK(std::count(corners.begin(), corners.end(), c) == 1);
    auto reversed = corners;
    std::reverse(reversed.begin(), reversed.end());
    CHECK(chosen(choose, reversed, wanted, area) == some);
  }
  CHECK(chosen(choose, {}, 10, area).empty());
  CHECK(chosen(choose, {}, 10, {}).empty());
}

TEST_CASE("a share of nothing leaves the strongest") {
  const region area{0, 0, 60, 50};
  auto corners = random_corners(500, area, 2);
  const auto some = chosen({.share = 0.0}, corners, 123, area);
  std::sort(corners.begin(), corners.end(), stronger);
  corners.resize(123);
  std::sort(corners.begin(), corners.end(), before_in_image);
  CHECK(some == corners);
}

TEST_CASE("levels share by the sides of their images, and what one cannot give the others do") {
  std::vector<level_corners> levels(3);
  const auto fill = [&](std::size_t a, std::size_t b, std::size_t c) {
    levels[0].corners.resize(a);
    levels[1].corners.resize(b);
    levels[2].corners.resize(c);
    levels[1].scale = 2.0;
    levels[2].scale = 4.0;
    std::vector<int> quotas;
    assign_quotas(levels, 70, quotas);
    return quotas;
  };
  CHECK(fill(1000, 1000, 1000) == std::vector<int>{40, 20, 10});
  CHECK(fill(1000, 1000, 4) == std::vector<int>{44, 22, 4});
  CHECK(fill(10, 1000, 1000) == std::vector<int>{10, 50, 10});
  CHECK(fill(10, 10, 1000) == std::vector<int>{10, 10, 50});
  CHECK(fill(1, 2, 3) == std::vector<int>{1, 2, 3});
  CHECK(fill(0, 0, 0) == std::vector<int>{0, 0, 0});
}
