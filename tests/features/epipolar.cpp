// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <orbis/core/simd/level.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>

#include "features/fundamental_geometry.hpp"
#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

using test::ahead, test::K1, test::K2, test::pixel, test::sideways;

}  // namespace

TEST_CASE("without a baseline there are no lines") {
  const test::fundamental_geometry geometry{K1, K2, se3{so3::exp(vec3{0.1, 0.0, 0.0}), vec3::Zero()}};
  CHECK_FALSE(geometry.line(0, {.x = 10.0F, .y = 20.0F}));
  const auto f = test::random_features(30, 1);
  CHECK((epipolar(hamming{}) | max_distance{256})(f, f, geometry).empty());
}

TEST_CASE("matching along lines equals a search through all trains with the distance tested") {
  const simd::level_limit limit{GENERATE(from_range(simd::available_levels()))};
  const std::size_t trains = GENERATE(0U, 1U, 15U, 16U, 17U, 400U);
  const auto q = test::random_features(200, 1);
  const auto t = test::random_features(trains, 2);
  for (const se3& T : {sideways(), ahead()}) {
    const test::fundamental_geometry geometry{K1, K2, T};
    const epipolar_rule rule{.distance = 5.0F, .epipole_radius = 60.0F};
    const vec3 centre = pixel(K2, T.translation());
    const auto may = [&](std::uint32_t i, std::uint32_t j) {
      const keypoint &a = q.keypoints[i], &b = t.keypoints[j];
      const vec3 l = geometry.matrix() * vec3{a.x, a.y, 1.0};
      const double off = std::abs(l.dot(vec3{b.x, b.y, 1.0})) / std::hypot(l.x(), l.y());
      const double scale = std::pow(1.2, b.octave);
      return off <= 5.0 * scale && std::hypot(double{b.x} - centre.x(), double{b.y} - centre.y()) >= 60.0 * scale;
    };
    const auto expected = test::naive_candidates(q, t, may);
    if (trains == 400) CHECK(expected.size() > 50);
    CHECK(test::candidates_of(epipolar(hamming{}, rule), as_view(q), as_view(t), {.reverse = true}, geometry) ==
          expected);
  }
}
