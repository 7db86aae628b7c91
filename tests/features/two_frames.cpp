// SPDX-License-Identifier: BSD-3-Clause
#include "features/two_frames.hpp"

#include <array>
#include <cstddef>

#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;

TEST_CASE("most matches between frames of the kitchen are right, near and far") {
  ORBIS_NEEDS_DATA("kitchen");
  const auto recording = io::open_recording(test::data_dir() / "kitchen").value();
  REQUIRE(recording.size() > 420);
  const features::orb_extractor extract{{.max_features = 1000}};
  struct bound {
    double share, count;  ///< at least: right ones, and matches with depth for each pair of frames
  };
  struct distance {
    std::size_t gap;
    std::array<bound, 4> at_least;  ///< in the order of `matcher_names`
  };
  const std::array<distance, 3> distances{{{1, {{{0.94, 450}, {0.94, 510}, {0.95, 510}, {0.95, 440}}}},
                                           {5, {{{0.94, 350}, {0.93, 360}, {0.95, 440}, {0.95, 360}}}},
                                           {15, {{{0.88, 200}, {0.81, 240}, {0.94, 300}, {0.93, 180}}}}}};
  for (const auto& [gap, at_least] : distances) {
    std::array<test::match_rate, 4> rates;
    for (const std::size_t i : {0U, 100U, 200U, 300U, 400U}) {
      const auto a = test::look(recording, i, extract), b = test::look(recording, i + gap, extract);
      for (std::size_t which = 0; which != rates.size(); ++which) {
        const test::match_rate r = test::judge(test::matches_by(which, a, b, gap), a, b);
        rates[which].right += r.right;
        rates[which].judged += r.judged;
      }
    }
    for (std::size_t i = 0; i != rates.size(); ++i) {
      INFO(test::matcher_names[i] << " at a gap of " << gap << ": " << rates[i].share() << " of "
                                  << rates[i].judged / 5.0);
      CHECK(rates[i].share() > at_least[i].share);
      CHECK(rates[i].judged / 5.0 > at_least[i].count);
    }
  }
}
