// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <functional>
#include <vector>

#include <orbis/cloud/detail/rays/view_trust.hpp>
#include <orbis/core/random.hpp>

#include "cloud/views.hpp"
#include "support/catch.hpp"

using orbis::cloud::detail::find_distrusted_views;

TEST_CASE("a view with a wrong pose is found, and a walker makes nobody suspect") {
  const auto honest = orbis::test::walked_past_wall(true, 99);
  CHECK(find_distrusted_views(orbis::seq, honest.views(), honest.camera).distrusted.empty());
  for (const std::size_t wrong : {1U, 5U}) {
    const auto seen = orbis::test::walked_past_wall(true, wrong);
    const auto trust = find_distrusted_views(orbis::seq, seen.views(), seen.camera);
    CHECK(trust.distrusted == std::vector<std::uint32_t>{static_cast<std::uint32_t>(wrong)});
    CHECK(trust.worst_conflict > 0.3);
    CHECK(trust.usual_conflict < 0.05);
    const auto together = find_distrusted_views(orbis::par.with(3), seen.views(), seen.camera);
    CHECK(together.distrusted == trust.distrusted);
    CHECK(together.worst_conflict == trust.worst_conflict);
  }
}

TEST_CASE("too few views, or none, cannot outvote one") {
  const auto seen = orbis::test::walked_past_wall(false, 1);
  auto views = seen.views();
  views.resize(3);
  CHECK(find_distrusted_views(orbis::seq, views, seen.camera).distrusted.empty());
  views.clear();
  CHECK(find_distrusted_views(orbis::seq, views, seen.camera).distrusted.empty());
}

TEST_CASE("stray pixels are replaced and surfaces are not") {
  orbis::image<float> depth(40, 30);
  for (int y = 0; y != 30; ++y)
    for (int x = 0; x != 40; ++x) depth(x, y) = x < 20 ? 2.0F : 1.0F + 0.04F * static_cast<float>(x);  // and a slope
  depth(10, 10) = 0.7F;
  depth(30, 15) = 3.5F;
  for (int y = 5; y != 25; ++y) depth(5, y) = 1.2F;  // a pole
  depth(12, 20) = 0.0F;
  orbis::image<float> out;
  const orbis::camera::depth_view<float> view{depth};
  orbis::cloud::detail::remove_stray_pixels(orbis::seq, view, 0.02F, 0.005F, out);
  CHECK(out(10, 10) == 2.0F);
  CHECK(out(30, 15) == Approx(2.2).margin(0.05));
  CHECK(out(12, 20) == 0.0F);
  CHECK(out(5, 15) == 1.2F);
  int changed = 0;
  for (int y = 1; y != 29; ++y)
    for (int x = 1; x != 39; ++x) changed += out(x, y) != depth(x, y) ? 1 : 0;
  CHECK(changed <= 4);  // the two, and the ends of the pole
  orbis::image<float> together;
  orbis::cloud::detail::remove_stray_pixels(orbis::par.with(3), view, 0.02F, 0.005F, together);
  CHECK(together == out);
}

TEST_CASE("stray pixels are those that pixel by pixel do not agree with their neighbours") {
  using namespace orbis::cloud::detail;
  orbis::random_bits random{7};
  for (const int width : {1, 5, 15, 16, 17, 70}) {
    for (const int height : {1, 2, 15, 16, 17, 40}) {
      orbis::image<std::uint16_t> stored(width, height);
      for (auto& v : stored.pixels())
        v = static_cast<std::uint16_t>(random.below(5) == 0 ? 0 : 900 + 30 * random.below(4) + random.below(12));
      const orbis::camera::depth_view<std::uint16_t> depth{stored, 1000.0};
      for (const auto l : orbis::simd::available_levels()) {
        const orbis::simd::level_limit limit{l};
        orbis::image<float> out;
        remove_stray_pixels(orbis::par.with(2), depth, 0.006F, 0.003F, out);
        int wrong = 0, replaced = 0;
        for (int y = 0; y != height; ++y)
          for (int x = 0; x != width; ++x) {
            const float z = depth(x, y);
            auto around = depths_around(depth, x, y);
            float expected = z;
            if (z > 0 && !agrees_with_neighbors(z, around, 0.006F + 0.003F * z * z)) {
              std::sort(around.begin(), around.end(), std::greater<>{});
              const auto count = std::count_if(around.begin(), around.end(), [](float d) { return d > 0; });
              std::reverse(around.begin(), around.begin() + count);
              expected = count < 5 ? 0.0F : around[static_cast<std::size_t>(count / 2)];
              ++replaced;
            }
            wrong += out(x, y) == expected ? 0 : 1;
          }
        CHECK(wrong == 0);
        if (width == 70 && height == 40) CHECK(replaced > 50);
      }
    }
  }
}

TEST_CASE("up to 128 views keep all verdicts on each other, and of more each keeps the lowest ranks") {
  using namespace orbis::cloud::detail;
  for (const std::uint32_t views : {2U, 128U, 1000U}) {
    view_verdicts verdicts;
    std::vector<std::uint32_t> ranks;
    for (std::uint32_t other = 1; other != views; ++other) {
      for (std::size_t tile = 0; tile != 16; ++tile) {
        for (const std::uint32_t rank : {verdict_rank(0, other, tile), verdict_rank(other, 0, tile)}) {
          verdicts.add({other, rank, 1, 2});
          ranks.push_back(rank);
        }
      }
    }
    std::sort(ranks.begin(), ranks.end());
    if (views > 128) ranks.resize(128 * 2 * 16);
    std::vector<std::uint32_t> kept;
    for (const view_verdict& v : verdicts.kept()) kept.push_back(v.rank);
    std::sort(kept.begin(), kept.end());
    CHECK(kept == ranks);
  }
}

TEST_CASE("a wrong pose is found among a thousand views each of which overlaps with few") {
  // Along a wall, a third of the image further each time.
  const orbis::camera::pinhole camera{24, 24, 20, 20, 11.5, 11.5};
  constexpr std::uint32_t count = 1100, wrong = 700;
  const orbis::image<float> wall(24, 24, 2.0F);
  std::vector<orbis::test::view> views(count);
  for (std::uint32_t v = 0; v != count; ++v) {
    views[v].depth = orbis::camera::depth_view<float>{wall};
    views[v].T_world_camera = orbis::se3{orbis::so3{}, orbis::vec3{0.8 * v, 0, v == wrong ? -0.3 : 0.0}};
  }
  const auto trust = find_distrusted_views(orbis::par, views, camera, {}, {.samples = 12});
  CHECK(trust.distrusted == std::vector<std::uint32_t>{wrong});
  CHECK(trust.usual_conflict == 0.0);
}
