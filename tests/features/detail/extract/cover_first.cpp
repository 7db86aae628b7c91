// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include <orbis/features/detail/extract/cover_first.hpp>
#include <orbis/features/detail/extract/spread.hpp>

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

TEST_CASE("a share of nothing, or too few corners to choose from, leaves what the strongest leave") {
  const auto levels_of = [](std::size_t count) {
    std::vector<level_corners> levels(1);
    levels[0].area = {0, 0, 100, 100};
    for (std::size_t i = 0; i != count; ++i)
      levels[0].corners.push_back(
          {static_cast<int>(i % 100), static_cast<int>(i / 100), static_cast<float>(i * 37 % 101)});
    return levels;
  };
  const auto left = [](auto levels, const auto& choose, int wanted) {
    typename std::remove_cvref_t<decltype(choose)>::workspace memory;
    choose(levels, wanted, memory);
    return levels[0].corners;
  };
  CHECK(left(levels_of(300), cover_first{.share = 0.0}, 50) == left(levels_of(300), strongest{}, 50));
  CHECK(left(levels_of(40), cover_first{.share = 1.0}, 50) == levels_of(40)[0].corners);
  // One cell for each wanted corner: the weakest corner of an empty part of the image is there.
  auto levels = levels_of(300);
  levels[0].corners.push_back({99, 99, 0.5F});
  const auto covered = left(levels, cover_first{.share = 1.0}, 50);
  CHECK(covered.size() == 50);
  CHECK(covered.back() == corner{99, 99, 0.5F});
}
