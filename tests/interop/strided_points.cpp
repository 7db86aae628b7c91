// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <numeric>
#include <ranges>
#include <vector>

#include <orbis/core/point.hpp>
#include <orbis/interop/strided_points.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::interop;

static_assert(point_range<strided_points<float>> && point_range<const strided_points<double>&>);
static_assert(std::ranges::view<strided_points<float>> && std::ranges::borrowed_range<strided_points<float>>);
static_assert(std::random_access_iterator<strided_points<float>::iterator>);

namespace {

/// 0, 1, 2 ...
[[nodiscard]] std::vector<float> numbers(std::size_t n) {
  std::vector<float> out(n);
  std::iota(out.begin(), out.end(), 0.0F);
  return out;
}
using point = std::array<float, 3>;

}  // namespace

TEST_CASE("packed points are seen where they are") {
  std::vector<float> buffer = numbers(12);
  const strided_points points{buffer.data(), 4};
  CHECK(points.size() == 4);
  CHECK(points[2] == point{6, 7, 8});
  buffer[7] = -1.0F;
  CHECK(points[2] == point{6, -1, 8});
  CHECK(*points.begin() == point{0, 1, 2});
  CHECK(*(points.end() - 1) == point{9, 10, 11});
}

TEST_CASE("points in wider records, in planes of coordinates and in padded rows") {
  const std::vector<float> buffer = numbers(40);
  CHECK(strided_points{buffer.data() + 1, 5, {.point_stride = 8}}[4] == point{33, 34, 35});
  const strided_points planes{buffer.data(), 10, {.point_stride = 1, .coordinate_stride = 10}};
  CHECK(planes[3] == point{3, 13, 23});
  // Three rows of two points, each row 10 numbers from the last.
  const strided_points rows{buffer.data(), 6, {.row_length = 2, .row_stride = 10}};
  CHECK(rows[1] == point{3, 4, 5});
  CHECK(rows[2] == point{10, 11, 12});
  CHECK(rows[5] == point{23, 24, 25});
  std::vector<point> all;
  std::ranges::copy(rows, std::back_inserter(all));
  CHECK(all.size() == 6);
  CHECK(all[3] == point{13, 14, 15});
}

TEST_CASE("iterators go anywhere, and on without their view") {
  const std::vector<float> buffer = numbers(30);
  const auto first = strided_points{buffer.data(), 10}.begin();
  const auto last = strided_points{buffer.data(), 10}.end();
  CHECK(last - first == 10);
  CHECK(*(first + 9) == point{27, 28, 29});
  CHECK(*(last - 1) == first[9]);
  CHECK((first < last && last > first && first != last && first + 10 == last && 10 + first == last));
  auto i = first;
  CHECK(*i++ == point{0, 1, 2});
  CHECK(*i-- == point{3, 4, 5});
  CHECK(i == first);
  CHECK(*++i == point{3, 4, 5});
  CHECK(--i == first);
  CHECK(std::ranges::count_if(first, last, [](const point& p) { return p[0] >= 15.0F; }) == 5);
}

TEST_CASE("no points are an empty range") {
  const strided_points<double> none;
  CHECK(none.empty());
  CHECK(none.begin() == none.end());
}
