// SPDX-License-Identifier: BSD-3-Clause
#include <bit>
#include <cmath>
#include <cstdint>
#include <set>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <orbis/features/detail/extract/steered_brief.hpp>
#include <orbis/interop/opencv.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

namespace {

std::uint32_t differing_bits(const binary_descriptor<256>& a, const binary_descriptor<256>& b) {
  std::uint32_t bits = 0;
  for (std::size_t w = 0; w != a.words.size(); ++w)
    bits += static_cast<std::uint32_t>(std::popcount(a.words[w] ^ b.words[w]));
  return bits;
}

}  // namespace

TEST_CASE("the pattern has 256 different tests within its reach") {
  std::set<std::tuple<int, int, int, int>> tests;
  for (const brightness_test& t : orb_pattern) {
    tests.emplace(t.x0, t.y0, t.x1, t.y1);
    CHECK(std::hypot(t.x0, t.y0) < steered_brief::reach + 0.5);
    CHECK(std::hypot(t.x1, t.y1) < steered_brief::reach + 0.5);
    CHECK((t.x0 != t.x1 || t.y0 != t.y1));
  }
  CHECK(tests.size() == 256);
}

TEST_CASE("descriptors are those of OpenCV's ORB where the angle is the same") {
  const auto im = test::blocks(320, 240, 1);
  std::vector<cv::KeyPoint> keypoints;
  for (int y = 25; y < 215; y += 6)
    for (int x = 25; x < 295; x += 7)
      keypoints.emplace_back(static_cast<float>(x), static_cast<float>(y), 31.0F,
                             static_cast<float>((x * 31 + y * 17) % 360), 1.0F, 0);
  cv::Mat expected;
  cv::ORB::create(1, 1.2F, 1, 19)->compute(interop::mat_over(im.view()), keypoints, expected);
  REQUIRE(keypoints.size() > 1000);

  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  steered_brief::workspace memory;
  const steered_brief describe;
  describe.prepare(im, 25, 215, memory);
  std::size_t different = 0;
  for (std::size_t i = 0; i != keypoints.size(); ++i) {
    const float angle = keypoints[i].angle * static_cast<float>(CV_PI / 180.0);
    const orientation o{angle, static_cast<float>(std::cos(static_cast<double>(angle))),
                        static_cast<float>(std::sin(static_cast<double>(angle)))};
    binary_descriptor<256> d;
    std::memcpy(d.words.data(), expected.ptr(static_cast<int>(i)), sizeof d);
    different += differing_bits(
        d, describe(memory, static_cast<int>(keypoints[i].pt.x), static_cast<int>(keypoints[i].pt.y), o));
  }
  // Where a turned coordinate lies half-way between two pixels, single ones differ.
  CHECK(static_cast<double>(different) < 0.002 * 256.0 * static_cast<double>(keypoints.size()));
}

TEST_CASE("descriptors with our orientation agree with OpenCV's ORB in 99 % of the bits") {
  const auto im = test::moved(test::blocks(320, 240, 2), 0.3, 0, 0);
  std::vector<cv::KeyPoint> found;
  cv::Mat expected;
  cv::ORB::create(500, 1.2F, 1, 31)->detectAndCompute(interop::mat_over(im.view()), {}, found, expected);
  REQUIRE(found.size() > 200);
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  steered_brief::workspace memory;
  steered_brief{}.prepare(im, 0, 240, memory);
  std::size_t different = 0;
  double turn = 0.0;
  for (std::size_t i = 0; i != found.size(); ++i) {
    const int x = static_cast<int>(found[i].pt.x), y = static_cast<int>(found[i].pt.y);
    const orientation o = intensity_centroid{}(im, x, y);
    const double theirs = static_cast<double>(found[i].angle) * 3.14159265358979323846 / 180.0;
    turn = std::max(turn, std::abs(std::remainder(static_cast<double>(o.angle) - theirs, 2 * 3.14159265358979323846)));
    binary_descriptor<256> d;
    std::memcpy(d.words.data(), expected.ptr(static_cast<int>(i)), sizeof d);
    different += differing_bits(d, steered_brief{}(memory, x, y, o));
  }
  CHECK(turn < 0.006);  // OpenCV's angle is good to 0.3 degrees
  CHECK(static_cast<double>(different) < 0.01 * 256.0 * static_cast<double>(found.size()));
}

TEST_CASE("every level gives the same descriptors, at the edge of the reach and with any stride") {
  const auto im = test::noise(90, 70, 3);
  const test::embedded_image embedded{im};
  std::vector<binary_descriptor<256>> expected;
  for (const auto level : simd::available_levels()) {  // the first is `portable`
    const simd::level_limit limit{level};
    std::vector<binary_descriptor<256>> found;
    steered_brief::workspace memory;
    steered_brief{}.prepare(embedded.view(), 18, 52, memory);
    for (int i = 0; i != 720; ++i) {
      const double angle = i * 3.14159265358979323846 / 360.0;
      const orientation o{static_cast<float>(angle), static_cast<float>(std::cos(angle)),
                          static_cast<float>(std::sin(angle))};
      for (const auto& [x, y] : {std::pair{18, 18}, {71, 51}, {18, 51}, {71, 18}, {40, 30}})
        found.push_back(steered_brief{}(memory, x, y, o));
    }
    if (expected.empty()) expected = found;
    CHECK(found == expected);
  }
}
