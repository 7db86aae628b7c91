// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <tuple>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/features2d.hpp>

#include <orbis/features/detail/extract/fast.hpp>
#include <orbis/interop/opencv.hpp>

#include "features/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

namespace {

std::vector<corner> found(const fast9& detect, image_view<const std::uint8_t> im, const region& area,
                          const corner_thresholds& thresholds) {
  fast9::workspace memory;
  std::vector<corner> corners;
  detect(im, area, thresholds, memory, corners);
  return corners;
}

std::vector<corner> opencv(image_view<const std::uint8_t> im, int threshold) {
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(interop::mat_over(im), keypoints, threshold, true);
  std::vector<corner> corners;
  for (const cv::KeyPoint& k : keypoints)
    corners.push_back({static_cast<int>(k.pt.x), static_cast<int>(k.pt.y), k.response});
  return corners;
}

region whole(image_view<const std::uint8_t> im) { return {0, 0, im.width(), im.height()}; }

/// What smoothing is, pixel by pixel.
image<std::uint8_t> smoothed(const image<std::uint8_t>& im) {
  const auto mean = [](int a, int b, int c) { return static_cast<std::uint8_t>((a + 2 * b + c + 2) / 4); };
  image<std::uint8_t> across(im.width(), im.height()), both(im.width(), im.height());
  for (int y = 0; y != im.height(); ++y)
    for (int x = 0; x != im.width(); ++x)
      across(x, y) = mean(im(x, std::max(0, y - 1)), im(x, y), im(x, std::min(im.height() - 1, y + 1)));
  for (int y = 0; y != im.height(); ++y)
    for (int x = 0; x != im.width(); ++x)
      both(x, y) = mean(across(std::max(0, x - 1), y), across(x, y), across(std::min(im.width() - 1, x + 1), y));
  return both;
}

}  // namespace

TEST_CASE("FAST corners without smoothing and ties are OpenCV's, at every level") {
  const fast9 plain{.smooth = false, .ties = false, .subpixel = false};
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  for (const auto& [width, height] : {std::pair{320, 240}, {7, 7}, {8, 30}, {21, 22}, {38, 39}, {70, 50}, {133, 61}})
    for (const int threshold : {1, 2, 7, 20, 100}) {
      for (const auto& im : {test::blocks(width, height, 1), test::noise(width, height, 2)}) {
        INFO(width << "x" << height << ", threshold " << threshold);
        const test::embedded_image embedded{im};
        const auto expected = opencv(im, threshold);
        CHECK(found(plain, im, whole(im), {threshold, threshold}) == expected);
        CHECK(found(plain, embedded.view(), whole(im), {threshold, threshold}) == expected);
      }
    }
  CHECK(opencv(test::blocks(320, 240, 1), 7).size() > 80);
}

TEST_CASE("FAST corners of an area are those of the image that lie in it") {
  const auto im = test::moved(test::blocks(200, 150, 3), 0.3, 0, 0);
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  const fast9 detect{.smooth = GENERATE(false, true), .ties = GENERATE(false, true)};
  const auto all = found(detect, im, whole(im), {9, 9});
  REQUIRE(all.size() > 100);
  for (const region area : {region{0, 0, 200, 1},
                            {0, 0, 200, 5},
                            {3, 3, 1, 1},
                            {50, 40, 100, 75},
                            {199, 149, 1, 1},
                            {120, 100, 80, 50},
                            {10, 20, 0, 5},
                            {10, 20, 5, 0},
                            {0, 5, 4, 140}}) {
    std::vector<corner> expected;
    std::copy_if(all.begin(), all.end(), std::back_inserter(expected), [&](const corner& c) {
      return c.x >= area.x && c.y >= area.y && c.x < area.x + area.width && c.y < area.y + area.height;
    });
    CHECK(found(detect, im, area, {9, 9}) == expected);
  }
}

TEST_CASE("smoothing before the segment test is a binomial, at every level") {
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  for (const auto& [width, height] : {std::pair{320, 240}, {7, 7}, {9, 140}, {40, 67}, {71, 50}}) {
    const auto im = test::noise(width, height, 4);
    const test::embedded_image embedded{im};
    const auto expected = opencv(smoothed(im), 5);
    CHECK(found({.ties = false, .subpixel = false}, im, whole(im), {5, 5}) == expected);
    CHECK(found({.ties = false, .subpixel = false}, embedded.view(), whole(im), {5, 5}) == expected);
  }
}

TEST_CASE("of equal neighbours the last is a corner") {
  // A bright bar two pixels long: both have the same score, and no other is larger.
  image<std::uint8_t> im(40, 40, 50);
  im(20, 20) = im(21, 20) = 200;
  im(10, 30) = im(10, 31) = 200;
  for (const auto level : simd::available_levels()) {
    const simd::level_limit limit{level};
    CHECK(found({.smooth = false, .ties = false, .subpixel = false}, im, whole(im), {20, 20}).empty());
    const std::vector<corner> last{{21, 20, 149.0F, -0.5F, 0.0F}, {10, 31, 149.0F, 0.0F, -0.5F}};
    CHECK(found({.smooth = false}, im, whole(im), {20, 20}) == last);
  }
}

TEST_CASE("ties kept are peaks that no neighbour exceeds, one of each run of equals") {
  const auto im = test::blocks(200, 150, 5);  // steps of few sizes: many ties
  const auto strict = found({.smooth = false, .ties = false, .subpixel = false}, im, whole(im), {7, 7});
  const auto kept = found({.smooth = false}, im, whole(im), {7, 7});
  for (const auto level : simd::available_levels()) {
    const simd::level_limit limit{level};
    CHECK(found({.smooth = false}, im, whole(im), {7, 7}) == kept);
  }
  CHECK(kept.size() > strict.size());
  CHECK(std::includes(kept.begin(), kept.end(), strict.begin(), strict.end(), before_in_image));
  for (std::size_t i = 1; i < kept.size(); ++i)
    CHECK_FALSE((kept[i].y == kept[i - 1].y && kept[i].x == kept[i - 1].x + 1));
}

TEST_CASE("corners are located within the pixel, at every level alike") {
  const auto im = test::moved(test::blocks(200, 150, 8), 0.3, 0, 0);
  const auto corners = found({}, im, whole(im), {9, 9});
  const auto whole_pixels = found({.subpixel = false}, im, whole(im), {9, 9});
  REQUIRE(corners.size() == whole_pixels.size());
  std::size_t moved = 0;
  for (std::size_t i = 0; i != corners.size(); ++i) {
    CHECK((corners[i].x == whole_pixels[i].x && corners[i].y == whole_pixels[i].y));
    CHECK((whole_pixels[i].dx == 0.0F && whole_pixels[i].dy == 0.0F));
    CHECK((std::abs(corners[i].dx) <= 0.5F && std::abs(corners[i].dy) <= 0.5F));
    moved += corners[i].dx != 0.0F || corners[i].dy != 0.0F ? 1 : 0;
  }
  CHECK(moved > corners.size() / 2);
  for (const auto level : simd::available_levels()) {
    const simd::level_limit limit{level};
    CHECK(found({}, im, whole(im), {9, 9}) == corners);
  }
}

TEST_CASE("a cell with a strong corner has no weak ones, the others keep theirs") {
  const auto im = test::blocks(210, 140, 6);
  const fast9 detect{.cell = 35};
  const auto all = found(detect, im, whole(im), {5, 5});
  const auto adapted = found(detect, im, whole(im), {40, 5});
  std::vector<corner> expected;
  for (const corner& c : all) {
    const bool strong_near = std::any_of(all.begin(), all.end(), [&](const corner& other) {
      return other.response >= 40.0F && other.x / 35 == c.x / 35 && other.y / 35 == c.y / 35;
    });
    if (c.response >= 40.0F || !strong_near) expected.push_back(c);
  }
  CHECK(adapted == expected);
  CHECK(adapted.size() < all.size());
  CHECK(std::any_of(adapted.begin(), adapted.end(), [](const corner& c) { return c.response < 40.0F; }));
}

TEST_CASE("constant images and tiny ones have no corners") {
  for (const auto level : simd::available_levels())
    for (const auto& [width, height] : {std::pair{1, 1}, {6, 100}, {100, 6}, {100, 100}}) {
      const simd::level_limit limit{level};
      const image<std::uint8_t> im(width, height, 255);
      CHECK(found({}, im, whole(im), {1, 0}).empty());
    }
}

TEST_CASE("the binomial mean of three rows is that of each pixel, at every level and for any length") {
  const auto im = test::noise(200, 3, 1);
  for (const auto level : simd::available_levels()) {
    const simd::level_limit limit{level};
    for (const int count : {0, 1, 15, 16, 17, 33, 63, 64, 65, 129, 200}) {
      std::vector<std::uint8_t> to(static_cast<std::size_t>(count) + 1, 99), expected;
      simd::kernel<binomial_kernel, binomial_kernel::signature>()(&im(0, 0), &im(0, 1), &im(0, 2), count, to.data());
      for (int x = 0; x != count; ++x)
        expected.push_back(static_cast<std::uint8_t>((im(x, 0) + 2 * im(x, 1) + im(x, 2) + 2) / 4));
      expected.push_back(99);
      CHECK(to == expected);
    }
  }
}
