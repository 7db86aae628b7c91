// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>

#include <orbis/features/detail/extract/box_difference.hpp>
#include <orbis/features/orb.hpp>

#include "features/images.hpp"
#include "features/repeatability.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

TEST_CASE("box differences are those of plain sums") {
  const auto im = test::noise(90, 70, 3);
  const test::embedded_image embedded{im};
  const box_difference<512> describe;
  box_difference<512>::workspace memory;
  describe.prepare(simd::level::portable, embedded.view(), 17, 53, memory);
  for (int i = 0; i != 60; ++i) {
    const double angle = i * 0.11;
    const orientation o{static_cast<float>(angle), static_cast<float>(std::cos(angle)),
                        static_cast<float>(std::sin(angle))};
    const auto sum = [&](int x, int y, float px, float py, int radius) {
      const int cx = x + static_cast<int>(std::nearbyint(px * o.cosine - py * o.sine));
      const int cy = y + static_cast<int>(std::nearbyint(px * o.sine + py * o.cosine));
      int total = 0;
      for (int v = cy - radius; v <= cy + radius; ++v)
        for (int u = cx - radius; u <= cx + radius; ++u) total += im(u, v);
      return total;
    };
    for (const auto& [x, y] : {std::pair{17, 17}, {72, 52}, {40, 30}}) {
      const auto d = describe(simd::level::portable, memory, x, y, o);
      std::size_t wrong = 0;
      for (std::size_t b = 0; b != 512; ++b) {
        const detail::box_test& t = detail::box_pattern<512>[b];
        wrong += d.bit(b) != (sum(x, y, t.x0, t.y0, t.radius) < sum(x, y, t.x1, t.y1, t.radius)) ? 1 : 0;
      }
      CHECK(wrong == 0);
    }
  }
}

TEST_CASE("an extractor with box differences finds turned features again") {
  const auto im = test::moved(test::blocks(400, 300, 5), 0.3, 0, 0);
  const basic_orb_extractor<fast9, cover_first, intensity_centroid, box_difference<>> extract{{.max_features = 400}};
  for (const double angle : {0.4, 2.0}) {
    const auto map = test::homography::similarity(angle, 1.0, 200, 150);
    const auto again = test::compared(extract(im), extract(test::warped(im, map)), map, 400, 300);
    CHECK(again.matching_score > 0.4);
    CHECK(again.matching_score > 0.6 * again.repeatability);
  }
  const basic_orb_extractor<fast9, cover_first, upright, box_difference<512>> wide{{.max_features = 400}};
  CHECK(wide(im).descriptors.front().bits == 512);
}
