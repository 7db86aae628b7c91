// SPDX-License-Identifier: BSD-3-Clause
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>

#include "features/fundamental_geometry.hpp"
#include "features/sources.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

/// The second call with the same sizes and other contents allocates nothing and finds what a fresh one finds.
template <class Matcher, class... Where>
void check_second_call(const Matcher& matcher, const Where&... where) {
  const auto a = test::random_features(300, 1), b = test::random_features(400, 2), c = test::random_features(400, 3);
  const std::vector<match> expected = matcher(a, c, where...);
  std::vector<match> matches;
  typename Matcher::workspace memory;
  matcher.match_into(matches, memory, a, b, where...);
  matcher.match_into(matches, memory, a, c, where...);
  const std::size_t before = test::allocations();
  matcher.match_into(matches, memory, a, b, where...);
  matcher.match_into(matches, memory, a, c, where...);
  if (test::counts_allocations()) CHECK(test::allocations() == before);
  CHECK(matches == expected);
}

}  // namespace

TEST_CASE("a matcher whose memory has served before allocates nothing") {
  check_second_call(brute_force(hamming{}) | ratio_test{0.9F} | cross_check{} | max_distance{60});
  check_second_call(brute_force(hamming{}) | cross_check{} | unique{} | rotation_consistency{});

  const auto queries = test::random_features(300, 1);
  std::vector<window> windows;
  for (const keypoint& k : queries.keypoints) windows.push_back({k.x, k.y, 60.0F});
  check_second_call(windowed(hamming{}) | cross_check{} | unique{}, windows);

  std::vector<vec3> points;
  for (const keypoint& k : queries.keypoints) points.push_back(vec3{(k.x - 320.0) / 500.0, (k.y - 240.0) / 500.0, 1.0});
  const camera::pinhole camera{640, 480, 500.0, 500.0, 320.0, 240.0};
  const camera_projection project{camera, se3{}};
  check_second_call(projected(hamming{}, {.radius = 40.0F}) | cross_check{} | unique{}, points, project);

  mat3 K;
  K << 500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0;
  const test::fundamental_geometry geometry{K, K, se3{so3{}, vec3{0.1, 0.0, 0.0}}};
  check_second_call(epipolar(hamming{}) | cross_check{} | unique{}, geometry);
}
