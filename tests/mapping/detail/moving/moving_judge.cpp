// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <set>
#include <vector>

#include <orbis/camera/depth.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/mapping/detail/moving/moving_window.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/moving_options.hpp>

#include "support/catch.hpp"

// A wall 3 m away. An object 1.5 m away moves to the right by two cells from keyframe to keyframe, slower than its
// width. The last keyframe does not show it. The last two have no depth in the lower half of the image.
TEST_CASE("a moving object that keyframes show at nearly one place is removed where a ray passes through it") {
  using keyframe = orbis::mapping::keyframe<>;
  constexpr int width = 200, height = 160, cell = 4, object_width = 40;
  constexpr std::uint16_t wall = 15000, object = 7500;  // in units of 0.2 mm
  const orbis::camera::pinhole camera{width, height, 200.0, 200.0, 99.5, 79.5};
  const auto left = [](std::size_t frame) { return 80 + 8 * static_cast<int>(frame); };
  std::vector<orbis::image<std::uint16_t>> images(4, orbis::image<std::uint16_t>(width, height, wall));
  for (std::size_t f = 0; f != 3; ++f)
    for (int y = 40; y != 120; ++y)
      for (int x = left(f); x != left(f) + object_width; ++x) images[f](x, y) = object;
  for (const std::size_t f : {2U, 3U})
    for (int y = height / 2; y != height; ++y)
      for (int x = 0; x != width; ++x) images[f](x, y) = 0;

  for (const int grow : {0, 8}) {
    orbis::mapping::moving_filter_options options;
    options.grow = grow;
    orbis::mapping::detail::moving_window<orbis::camera::pinhole, keyframe> window{camera, options};
    for (const auto& image : images)
      window.push(orbis::seq, keyframe{orbis::camera::depth_view{image.view(), 5000.0}, {}, orbis::se3{}});
    window.finish();
    while (const auto judged = window.pop()) {
      const std::size_t f = judged->number;
      std::set<std::uint32_t> removed;
      for (const auto& r : judged->removed) removed.insert(r.cell);
      std::size_t of_wall = 0, upper = 0, lower = 0;
      for (const std::uint32_t i : removed) {
        const int x = static_cast<int>(i) % (width / cell) * cell, y = static_cast<int>(i) / (width / cell) * cell;
        const bool is_object = f != 3 && x >= left(f) && x < left(f) + object_width && y >= 40 && y < 120;
        of_wall += is_object ? 0 : 1;
        (y < height / 2 ? upper : lower) += is_object ? 1 : 0;
      }
      constexpr std::size_t half = object_width / cell * 10;  // cells of the object in half of the image
      CAPTURE(grow, f, upper, lower);
      CHECK(of_wall == 0);
      if (f == 3) CHECK(removed.empty());
      if (f == 3) continue;
      CHECK(upper > 10);
      CHECK((upper > 8 * half / 10) == (grow == 8));
      CHECK(lower <= 3 * half / 10);  // no ray passes through cells that one keyframe shows: they stay
    }
  }
}
