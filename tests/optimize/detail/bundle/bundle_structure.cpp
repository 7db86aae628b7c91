// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/detail/bundle/bundle_structure.hpp>

#include "support/catch.hpp"

using namespace orbis;
using optimize::bundle_observation;
using optimize::detail::bundle_structure;

namespace {

std::vector<bundle_observation> random_observations(std::uint64_t seed, std::uint32_t cameras, std::uint32_t points,
                                                    int count) {
  random_bits random(seed);
  std::vector<bundle_observation> all;
  for (int i = 0; i != count; ++i) all.push_back({.pose = random.below(cameras), .point = random.below(points)});
  return all;
}

bundle_structure structure_of(std::size_t cameras, std::size_t points, const std::vector<bundle_observation>& all,
                              const std::vector<std::uint8_t>& fixed = {}, bool hold_first = false) {
  bundle_structure s;
  s.build(cameras, points, std::span<const bundle_observation>(all), fixed, hold_first,
          [&](std::uint32_t k) { return all[k].information > 0.0; });
  return s;
}

}  // namespace

TEST_CASE("Every usable observation has one place by camera and one by point") {
  auto all = random_observations(1, 9, 40, 300);
  for (std::size_t k = 0; k < all.size(); k += 11) all[k].information = 0.0;  // not usable
  std::erase_if(all, [](const auto& o) { return o.pose == 4 || o.point == 7; });
  const auto s = structure_of(9, 40, all, {1, 0, 0, 0, 0, 0, 0, 0, 1});
  std::vector<int> seen(all.size()), numbered(s.first.back());
  for (std::size_t c = 0; c != 9; ++c) {
    CHECK(s.first_tile[c + 1] - s.first_tile[c] == (s.count[c] + 7) / 8);
    for (std::size_t i = 0; i != 8 * (s.first_tile[c + 1] - s.first_tile[c]); ++i) {
      const std::size_t at = 8 * s.first_tile[c] + i;
      CHECK((s.source[at] != bundle_structure::none) == (i < s.count[c]));
      if (i >= s.count[c]) continue;
      const auto& o = all[s.source[at]];
      CHECK(o.pose == c);
      CHECK(o.point == s.point_source[s.point[at]]);
      CHECK(s.by_point[at] >= s.first[s.point[at]]);
      CHECK(s.by_point[at] < s.first[s.point[at] + 1]);
      CHECK((s.mixed_by_point[at] != bundle_structure::none) == (s.unknown[c] != bundle_structure::none));
      if (s.mixed_by_point[at] != bundle_structure::none) CHECK(s.mixed_unknown[s.mixed_by_point[at]] == s.unknown[c]);
      ++seen[s.source[at]];
      ++numbered[s.by_point[at]];
    }
  }
  for (std::size_t k = 0; k != all.size(); ++k) CHECK(seen[k] == (all[k].information > 0.0 ? 1 : 0));
  CHECK(std::all_of(numbered.begin(), numbered.end(), [](int n) { return n == 1; }));
  CHECK(s.count[4] == 0);
  CHECK(s.unknown[0] == bundle_structure::none);
  CHECK(s.unknown[4] == bundle_structure::none);
  CHECK(s.unknowns() == 6);
  CHECK(std::find(s.point_source.begin(), s.point_source.end(), 7U) == s.point_source.end());
}

TEST_CASE("The reduced system has a block for each pair of cameras that share a point") {
  const auto all = random_observations(2, 12, 30, 80);
  const auto s = structure_of(12, 30, all);
  std::set<std::pair<std::uint32_t, std::uint32_t>> expected, found;
  for (std::uint32_t u = 0; u != s.unknowns(); ++u) expected.insert({u, u});
  for (const auto& a : all)
    for (const auto& b : all)
      if (a.point == b.point && s.unknown[a.pose] >= s.unknown[b.pose])
        expected.insert({s.unknown[a.pose], s.unknown[b.pose]});
  for (const auto& slot : s.slots) found.insert({slot.row, slot.column});
  CHECK(found == expected);
  CHECK(found.size() == s.slots.size());
  for (std::size_t p = 0; p != s.points(); ++p) {
    std::size_t pair = s.first_pair[p];
    for (std::uint32_t a = s.first_mixed[p]; a != s.first_mixed[p + 1]; ++a)
      for (std::uint32_t b = s.first_mixed[p]; b <= a; ++b, ++pair) {
        const auto& slot = s.slots[s.pair_slot[pair]];
        CHECK((slot.row == s.mixed_unknown[a] && slot.column == s.mixed_unknown[b]));
      }
    CHECK(pair == s.first_pair[p + 1]);
    CHECK(s.first_mixed[p + 1] - s.first_mixed[p] <= s.longest());
  }
}

TEST_CASE("The first camera with observations can be held, unless another is fixed") {
  auto all = random_observations(3, 5, 10, 60);
  std::erase_if(all, [](const auto& o) { return o.pose == 0; });
  const auto held = structure_of(5, 10, all, {}, true);
  CHECK(held.unknown[1] == bundle_structure::none);
  CHECK(held.unknowns() == 3);
  const auto fixed = structure_of(5, 10, all, {0, 0, 0, 1, 0}, true);
  CHECK(fixed.unknown[1] != bundle_structure::none);
  CHECK(fixed.unknowns() == 3);
}
