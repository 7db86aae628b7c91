// SPDX-License-Identifier: BSD-3-Clause
#include "frame_ranges.hpp"

#include <initializer_list>
#include <vector>

#include "support/catch.hpp"

namespace {

app::frame_ranges of(std::initializer_list<std::size_t> frames) {
  app::frame_ranges all;
  for (const std::size_t f : frames) all.add(f);
  return all;
}
std::vector<app::frame_range> list(const app::frame_ranges& r) { return {r.ranges().begin(), r.ranges().end()}; }
using ranges = std::vector<app::frame_range>;

}  // namespace

TEST_CASE("frames one after the other are one stretch") {
  CHECK(list(of({})).empty());
  CHECK(list(of({4, 5, 6, 9, 11, 12})) == ranges{{4, 3}, {9, 1}, {11, 2}});
}

TEST_CASE("a frame that is taken out of a stretch shortens or divides it") {
  auto r = of({4, 5, 6, 7, 8, 11});
  r.remove(3);
  r.remove(9);
  r.remove(100);
  CHECK(list(r) == ranges{{4, 5}, {11, 1}});
  r.remove(6);
  CHECK(list(r) == ranges{{4, 2}, {7, 2}, {11, 1}});
  r.remove(6);
  r.remove(4);
  r.remove(8);
  CHECK(list(r) == ranges{{5, 1}, {7, 1}, {11, 1}});
  r.remove(5);
  r.remove(11);
  CHECK(list(r) == ranges{{7, 1}});
  r.remove(7);
  CHECK(list(r).empty());
  r.add(12);
  CHECK(list(r) == ranges{{12, 1}});
}
