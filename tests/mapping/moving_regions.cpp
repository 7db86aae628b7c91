// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/random.hpp>
#include <orbis/mapping/moving_regions.hpp>

#include "support/allocations.hpp"
#include "support/catch.hpp"
#include "support/synthetic/close_people.hpp"

using namespace orbis;
using mapping::marked_pixel;

namespace {

using regions = mapping::moving_regions<camera::pinhole>;

const camera::pinhole model{camera::intrinsics{160, 120, 131.0, 131.0, 79.5, 59.5}};

/// A wall 3 m away, and before it a board, 1 m away, with its edges between cells.
image<std::uint16_t> board_before_wall() {
  image<std::uint16_t> depth(160, 120);
  for (int y = 0; y != 120; ++y)
    for (int x = 0; x != 160; ++x) depth(x, y) = x >= 40 && x < 80 && y >= 20 && y < 100 ? 1000 : 3000;
  return depth;
}
camera::depth_view<std::uint16_t> metres(const image<std::uint16_t>& depth) {
  return camera::depth_view{depth, 1000.0};
}
std::vector<marked_pixel> marks_in(float x0, float y0, float x1, float y1, bool moves) {
  std::vector<marked_pixel> marks;
  for (int i = 0; i != 3; ++i)
    for (int j = 0; j != 3; ++j)
      marks.push_back({x0 + static_cast<float>(i) * (x1 - x0) / 2, y0 + static_cast<float>(j) * (y1 - y0) / 2, moves});
  return marks;
}
std::vector<marked_pixel> operator+(std::vector<marked_pixel> a, const std::vector<marked_pixel>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

}  // namespace

TEST_CASE("The surface of marks that move is taken out up to its edges") {
  const image<std::uint16_t> depth = board_before_wall();
  image<std::uint16_t> out(160, 120);
  regions found{model};
  const auto marks = marks_in(50, 30, 70, 90, true) + marks_in(100, 10, 150, 110, false);
  REQUIRE(found.find(metres(depth), marks));
  CHECK(found.remove(metres(depth), out.view()) == 40 * 80);
  for (int y = 0; y != 120; ++y)
    for (int x = 0; x != 160; ++x) REQUIRE(out(x, y) == (depth(x, y) == 1000 ? 0 : 3000));
}

TEST_CASE("Few marks that move take nothing out, nor do marks beside what was measured") {
  const image<std::uint16_t> depth = board_before_wall(), nothing(160, 120);
  regions found{model};
  auto few = marks_in(50, 30, 70, 90, true);
  few.resize(4);
  CHECK_FALSE(found.find(metres(depth), few));
  CHECK_FALSE(found.find(metres(depth), marks_in(50, 30, 70, 90, false)));
  CHECK_FALSE(found.find(metres(nothing), marks_in(50, 30, 70, 90, true)));
  CHECK_FALSE(found.find(metres(depth), marks_in(-20, -20, -5, -5, true) + marks_in(160, 120, 170, 125, true)));
  CHECK_FALSE(found.find(metres(depth), marks_in(39, 40, 39, 80, true)));  // at the board's edge
}

TEST_CASE("Marks that are nowhere in the image are passed over") {
  const image<std::uint16_t> depth = board_before_wall();
  regions found{model};
  std::vector<marked_pixel> marks;
  for (const float far : {1e30F, -1e30F, std::numeric_limits<float>::infinity(), std::nanf(""), 160.0F, -1.0F}) {
    marks.push_back({far, 50.0F, true});
    marks.push_back({60.0F, far, true});
  }
  CHECK_FALSE(found.find(metres(depth), marks));
}

TEST_CASE("One surface is divided between the marks that move and those that do not") {
  image<std::uint16_t> depth(160, 120);
  for (auto& z : depth.pixels()) z = 2000;
  image<std::uint16_t> out(160, 120);
  regions found{model, {.reach = 0.5F}};
  REQUIRE(found.find(metres(depth), marks_in(50, 30, 50, 90, true) + marks_in(80, 30, 80, 90, false)));
  found.remove(metres(depth), out.view());
  for (int y = 30; y != 90; ++y) {
    CHECK(out(60, y) == 0);
    CHECK(out(72, y) == 2000);  // nearer to what stands, by more than a cell
    CHECK(out(26, y) == 0);
    CHECK(out(8, y) == 2000);  // out of reach: 0.5 m are 33 pixels
  }
}

TEST_CASE("Somebody before the camera is taken out, and the room is not") {
  const auto walk = test::with_company(
      {.what = test::company::goes_along, .sequence = {.width = 160, .height = 120, .fps = 10.0, .texel = 0.1}});
  const auto empty =
      test::sequence<test::camera_path>{test::world{io::detail::synthetic::scene{{}, 1}}, walk.path(), walk.options()};
  const camera::pinhole camera{walk.camera().model.k()};
  regions found{camera};
  image<float> out(160, 120);
  random_bits bits{3};
  std::size_t person = 0, removed = 0, room = 0, lost = 0;
  for (std::size_t i = 22; i < 62; i += 8) {
    const auto with = walk.exact(seq, i).value(), without = empty.exact(seq, i).value();
    const auto is_person = [&](int x, int y) { return with.depth(x, y) < without.depth(x, y) - 0.05F; };
    std::vector<marked_pixel> marks;
    for (int k = 0; k != 120; ++k) {
      const int x = static_cast<int>(bits.below(160)), y = static_cast<int>(bits.below(120));
      marks.push_back({static_cast<float>(x), static_cast<float>(y), is_person(x, y)});
    }
    REQUIRE(found.find(camera::depth_view{with.depth}, marks));
    found.remove(camera::depth_view{with.depth}, out.view());
    for (int y = 0; y != 120; ++y)
      for (int x = 0; x != 160; ++x) {
        (is_person(x, y) ? person : room) += 1;
        if (out(x, y) == 0.0F) (is_person(x, y) ? removed : lost) += 1;
      }
  }
  CAPTURE(person, removed, room, lost);
  CHECK(person > 5000);
  CHECK(100 * removed > 95 * person);
  CHECK(100 * lost < 3 * room);  // the floor around the feet
}

TEST_CASE("Regions are found without an allocation once their memory is there") {
  if (!test::counts_allocations()) return;
  const image<std::uint16_t> depth = board_before_wall();
  image<std::uint16_t> out(160, 120);
  regions found{model};
  const auto marks = marks_in(50, 30, 70, 90, true) + marks_in(100, 10, 150, 110, false);
  REQUIRE(found.find(metres(depth), marks));
  const std::size_t before = test::allocations();
  const bool again = found.find(metres(depth), marks) && found.remove(metres(depth), out.view()) > 0;
  CHECK(test::allocations() == before);
  CHECK(again);
}
