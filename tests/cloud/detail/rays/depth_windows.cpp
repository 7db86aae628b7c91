// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/cloud/detail/rays/take_depth_windows.hpp>
#include <orbis/core/random.hpp>

#include "support/catch.hpp"

using orbis::cloud::detail::depth_windows;

namespace {

template <class Depth>
void check_windows(const depth_windows& windows, const Depth& depth, int radius) {
  std::size_t wrong = 0;
  REQUIRE(windows.width() == depth.width());
  REQUIRE(windows.height() == depth.height());
  std::vector<float> tiles(static_cast<std::size_t>(windows.tiles_across() * windows.tiles_down()),
                           depth_windows::none);
  for (int y = 0; y != depth.height(); ++y) {
    for (int x = 0; x != depth.width(); ++x) {
      float nearest = std::numeric_limits<float>::infinity();
      float farthest = depth_windows::none;
      for (int v = y - radius; v <= y + radius; ++v) {
        for (int u = x - radius; u <= x + radius; ++u) {
          const bool inside = u >= 0 && v >= 0 && u < depth.width() && v < depth.height();
          const float z = inside && depth(u, v) > 0 ? depth(u, v) : depth_windows::none;
          nearest = std::min(nearest, z);
          farthest = std::max(farthest, z);
        }
      }
      const auto i = static_cast<std::size_t>(y * depth.width() + x);
      wrong += windows.nearest()[i] == nearest ? 0 : 1;
      wrong += windows.farthest()[i] == farthest ? 0 : 1;
      wrong += windows.middle()[i] == (depth(x, y) > 0 ? depth(x, y) : depth_windows::none) ? 0 : 1;
      float& tile =
          tiles[static_cast<std::size_t>(y / depth_windows::tile * windows.tiles_across() + x / depth_windows::tile)];
      tile = std::max(tile, farthest);
    }
  }
  CHECK(wrong == 0);
  for (int y = 0; y != windows.tiles_down(); ++y) {
    for (int x = 0; x != windows.tiles_across(); ++x)
      CHECK(windows.farthest_of_tiles(x, y, x, y) == tiles[static_cast<std::size_t>(y * windows.tiles_across() + x)]);
  }
  if (!tiles.empty()) {
    CHECK(windows.farthest_of_tiles(0, 0, windows.tiles_across() - 1, windows.tiles_down() - 1) ==
          *std::max_element(tiles.begin(), tiles.end()));
  }
}

}  // namespace

TEST_CASE("windows of depth images of every size and kind") {
  orbis::random_bits random{4};
  depth_windows windows;  // one after the other in the same memory
  for (const auto& [width, height] : {std::pair{1, 1}, {3, 40}, {16, 16}, {17, 33}, {70, 5}, {40, 31}}) {
    orbis::image<std::uint16_t> stored(width, height);
    orbis::image<float> metres(width, height);
    for (int y = 0; y != height; ++y) {
      for (int x = 0; x != width; ++x) {
        const std::uint32_t kind = random.below(40);
        const auto value = static_cast<std::uint16_t>(random.below(8000));
        stored(x, y) = kind == 0 ? std::uint16_t{0} : kind == 1 ? std::uint16_t{65535} : value;
        metres(x, y) = kind == 0   ? std::numeric_limits<float>::quiet_NaN()
                       : kind == 1 ? std::numeric_limits<float>::infinity()
                       : kind == 2 ? -1.0F
                                   : static_cast<float>(value);
      }
    }
    for (const int radius : {0, 1, 2, 7, 45}) {
      for (const auto level : {orbis::simd::level::portable, orbis::simd::level::avx2}) {
        const orbis::simd::level_limit limit{level};
        const orbis::camera::depth_view<std::uint16_t> view(stored.view(), 1234.5, 0.3F, 6.0F);
        windows.take(orbis::seq, view, radius);
        check_windows(windows, view, radius);
        windows.take(orbis::par.with(3), orbis::camera::depth_view<float>(metres.view()), radius);
        check_windows(windows, orbis::camera::depth_view<float>(metres.view()), radius);
      }
    }
  }
}
