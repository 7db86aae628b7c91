// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/detail/extract/cover_first.hpp>
#include <orbis/features/detail/extract/spread.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

namespace {

/// What a distribution leaves on one level.
template <class Distribution>
std::vector<corner> chosen(const Distribution& choose, std::vector<corner> corners, int wanted, const region& area) {
  std::vector<level_corners> levels(1);
  levels[0].corners = std::move(corners);
  levels[0].area = area;
  typename Distribution::workspace memory;
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

TEMPLATE_TEST_CASE("every distribution leaves as many as wanted, in order, whatever the order before", "", strongest,
                   cover_first) {
  const region area{20, 30, 150, 97};
  const auto corners = random_corners(600, area, 1);
  for (const int wanted : {0, 1, 2, 7, 100, 599, 600, 601, 5000}) {
    const auto some = chosen(TestType{}, corners, wanted, area);
    CHECK(some.size() == std::min(corners.size(), static_cast<std::size_t>(wanted)));
    CHECK(in_image_order(some));
    CHECK(std::adjacent_find(some.begin(), some.end()) == some.end());
    for (const corner& c : some) CHECK(std::count(corners.begin(), corners.end(), c) == 1);
    auto reversed = corners;
    std::reverse(reversed.begin(), reversed.end());
    CHECK(chosen(TestType{}, reversed, wanted, area) == some);
  }
  CHECK(chosen(TestType{}, {}, 10, area).empty());
  CHECK(chosen(TestType{}, {}, 10, {}).empty());
}

TEST_CASE("the strongest are the strongest") {
  const region area{0, 0, 60, 50};
  auto corners = random_corners(500, area, 2);
  const auto some = chosen(strongest{}, corners, 123, area);
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
    share_out(levels, 70, quotas);
    return quotas;
  };
  CHECK(fill(1000, 1000, 1000) == std::vector<int>{40, 20, 10});
  CHECK(fill(1000, 1000, 4) == std::vector<int>{44, 22, 4});
  CHECK(fill(10, 1000, 1000) == std::vector<int>{10, 50, 10});
  CHECK(fill(10, 10, 1000) == std::vector<int>{10, 10, 50});
  CHECK(fill(1, 2, 3) == std::vector<int>{1, 2, 3});
  CHECK(fill(0, 0, 0) == std::vector<int>{0, 0, 0});
}
