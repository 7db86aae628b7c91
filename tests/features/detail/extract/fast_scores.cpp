// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/features/detail/extract/fast_scores.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features::detail;

TEST_CASE("the scores of a row are those of its pixels, at every level and for any length") {
  for (const auto& im : {test::noise(150, 7, 1), test::blocks(150, 7, 2)}) {
    const auto circle = circle_offsets(150);
    for (const auto level : simd::available_levels()) {
      const simd::level_limit limit{level};
      const auto scores_of = simd::kernel<fast_scores_kernel, fast_scores_kernel::signature>();
      for (const int count : {1, 15, 16, 17, 31, 33, 64, 100, 144})
        for (const int threshold : {0, 9, 80}) {
          std::vector<std::uint8_t> scores(static_cast<std::size_t>(count) + 1, 77), expected;
          scores_of(&im(3, 3), 150, count, static_cast<std::uint8_t>(threshold), scores.data());
          for (int x = 0; x != count; ++x) {
            const int score = fast_score(&im(3 + x, 3), circle);
            expected.push_back(static_cast<std::uint8_t>(score > threshold ? score : 0));
          }
          expected.push_back(77);  // nothing is written behind the row
          CHECK(scores == expected);
        }
    }
  }
}

TEST_CASE("the peaks of a row are the scores larger than their eight neighbours, at every level") {
  constexpr int width = 150;
  const auto im = test::noise(width, 3, 3);
  std::vector<std::uint8_t> rows(3 * (width + 128), 0);
  const auto row = [&](int y) { return rows.data() + y * (width + 128) + 64; };
  for (int y = 0; y != 3; ++y)
    for (int x = 0; x != width; ++x) row(y)[x] = im(x, y) / 32;  // many ties
  for (const bool ties : {false, true}) {
    std::vector<std::uint32_t> expected;
    for (int x = 0; x != width; ++x) {
      const int s = row(1)[x];
      bool peak = s != 0;
      for (int v = 0; v != 3; ++v)
        for (int u = -1; u != 2; ++u) {
          const bool before = v == 0 || (v == 1 && u < 0), itself = v == 1 && u == 0;
          const int other = row(v)[x + u];
          if (!itself) peak = peak && (s > other || (ties && before && s == other));
        }
      if (peak) expected.push_back(static_cast<std::uint32_t>(x));
    }
    REQUIRE(expected.size() > 3);
    for (const auto level : simd::available_levels()) {
      const simd::level_limit limit{level};
      std::vector<std::uint32_t> columns(width);
      columns.resize(simd::kernel<fast_peaks_kernel, fast_peaks_kernel::signature>()(row(0), row(1), row(2), width,
                                                                                     ties, columns.data()));
      CHECK(columns == expected);
    }
  }
}
