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
                              const std::vector<std::uint8_t>& fixed = {}) {
  bundle_structure s;
  s.build(cameras, points, std::span<const bundle_observation>(all), fixed,
          [&](std::uint32_t k) { return all[k].information > 0.0; });
  return s;
}

}  // namespace

TEST_CASE("Every usable observation has one place in a chunk and one by point") {
  auto all = random_observations(1, 9, 400, 9000);                            // several chunks
  for (std::size_t k = 0; k < all.size(); k += 11) all[k].information = 0.0;  // not usable
  std::erase_if(all, [](const auto& o) { return o.pose == 4 || o.point == 7; });
  const auto s = structure_of(9, 400, all, {1, 0, 0, 0, 0, 0, 0, 0, 1});
  REQUIRE(s.chunks() > 2);
  REQUIRE(s.chunk_begin.front().first_point == 0);
  REQUIRE(s.chunk_begin.back().first_point == s.points());
  std::vector<int> seen(all.size()), numbered(s.mixed_unknown.size());
  std::vector<std::uint32_t> by_camera(9), point_of_number(s.mixed_unknown.size());
  for (const auto& g : s.groups)
    for (std::uint32_t i = 0; i != g.points * g.cameras; ++i)
      point_of_number[g.first_mixed + i] = g.first_point + i % g.points;
  std::size_t tiles = 0, mixed_tiles = 0;
  for (std::size_t chunk = 0; chunk != s.chunks(); ++chunk) {
    const auto &begin = s.chunk_begin[chunk], &end = s.chunk_begin[chunk + 1];
    CHECK((end.first_point % 8 == 0 || end.first_point == s.points()));
    for (std::size_t k = begin.first_segment; k != end.first_segment; ++k) {
      const auto& segment = s.segments[k];
      if (k != begin.first_segment) CHECK(segment.camera > s.segments[k - 1].camera);
      const std::uint32_t unknown = s.unknown[segment.camera];
      CHECK(segment.first_tile == tiles);
      tiles += (segment.count + 7) / 8;
      by_camera[segment.camera] += segment.count;
      const bool moves = unknown != bundle_structure::none;
      if (moves) {
        CHECK(segment.first_mixed_tile == mixed_tiles);
        mixed_tiles += (segment.count + 7) / 8;
      }
      for (std::size_t at = 8 * segment.first_tile; at != 8 * tiles; ++at) {
        CHECK(s.point[at] >= begin.first_point);
        CHECK(s.point[at] < end.first_point);
        const bool is_filled = at < 8 * segment.first_tile + segment.count;
        CHECK((s.source[at] != bundle_structure::none) == is_filled);
        CHECK((s.mixed_number[at] != bundle_structure::none) == (is_filled && moves));
        if (!is_filled) continue;
        const auto& o = all[s.source[at]];
        CHECK(o.pose == segment.camera);
        CHECK(o.point == s.point_source[s.point[at]]);
        ++seen[s.source[at]];
        if (!moves) continue;
        const std::uint32_t number = s.mixed_number[at];
        CHECK(number >= begin.first_mixed);
        CHECK(number < end.first_mixed);
        CHECK(s.mixed_unknown[number] == unknown);
        CHECK(s.mixed_place[number] == 8 * segment.first_mixed_tile + (at - 8 * segment.first_tile));
        CHECK(point_of_number[number] == s.point[at]);
        ++numbered[number];
      }
    }
    CHECK(end.first_mixed - begin.first_mixed <= s.largest_chunk());
  }
  CHECK(s.places() == 8 * tiles);
  CHECK(s.mixed_tiles() == mixed_tiles);
  for (std::size_t k = 0; k != all.size(); ++k) CHECK(seen[k] == (all[k].information > 0.0 ? 1 : 0));
  CHECK(std::all_of(numbered.begin(), numbered.end(), [](int n) { return n == 1; }));
  CHECK(by_camera == s.count);
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
  for (std::uint32_t u = 0; u != s.unknowns(); ++u)
    CHECK(s.slots[s.diagonal_slot[u]] == optimize::detail::block_place{u, u});
  std::size_t pairs = 0;
  for (const auto& g : s.groups)
    for (std::size_t i = 0; i != g.points; ++i) {
      std::size_t pair = g.first_pair;
      const auto unknown = [&](std::size_t a) { return s.mixed_unknown[g.first_mixed + a * g.points + i]; };
      for (std::size_t a = 1; a < g.cameras; ++a)
        for (std::size_t b = 0; b != a; ++b, ++pair, ++pairs)
          CHECK(s.slots[s.pair_slot[pair]] == optimize::detail::block_place{unknown(a), unknown(b)});
    }
  CHECK(pairs == s.pairs());
}

TEST_CASE("Points that the same cameras see form groups") {
  std::vector<bundle_observation> all;
  const std::vector<std::vector<std::uint32_t>> sets = {{0, 1, 4},    {1, 2}, {0, 1, 4}, {0, 3},   {1, 2},
                                                        {0, 1, 4, 5}, {5},    {1, 3},    {0, 2, 4}};
  for (std::uint32_t p = 0; p != sets.size(); ++p)
    for (const std::uint32_t c : sets[p]) all.push_back({.pose = c, .point = p});
  const auto s = structure_of(6, sets.size(), all, {0, 0, 0, 0, 0, 1});
  CHECK(s.point_source == std::vector<std::uint32_t>{3, 0, 2, 5, 8, 1, 4, 7, 6});
  std::vector<std::uint32_t> points;
  for (const auto& g : s.groups) points.push_back(g.points);
  CHECK(points == std::vector<std::uint32_t>{1, 3, 1, 2, 1, 1});
  CHECK(s.pairs() == 1 + 3 * 3 + 3 + 2 * 1 + 1);

  all.clear();
  for (std::uint32_t p = 0; p != 200; ++p)  // more than fit into one group: they share their pairs
    for (std::uint32_t c = 0; c != 3; ++c) all.push_back({.pose = c, .point = p});
  const auto large = structure_of(3, 200, all);
  REQUIRE(large.groups.size() > 2);
  CHECK(large.pair_slot.size() == 3);
  for (const auto& g : large.groups) CHECK(g.first_pair == 0);
  CHECK(large.pairs() == 600);
}
