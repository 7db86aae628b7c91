// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <cstdlib>
#include <numbers>
#include <thread>
#include <tuple>
#include <vector>

#include <orbis/features/brute_force.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/orb-inl.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/io/image.hpp>

#include "features/images.hpp"
#include "features/repeatability.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::features;
using test::blocks, test::moved;

namespace {

constexpr auto matcher = brute_force(hamming{}) | ratio_test{0.8f} | cross_check{} | max_distance{64};

/// No direction, for cameras that do not roll.
struct upright {
  static constexpr int radius = 0;
  orientation operator()(image_view<const std::uint8_t>, int, int) const { return {}; }
};

}  // namespace

TEST_CASE("ORB features are well-formed and the same on every run") {
  const auto im = blocks(320, 240, 1);
  const orb_extractor extract{{.max_features = 500, .levels = 5, .scale_factor = 1.2f}};
  const orbis::features::features f = extract(im);
  CHECK((f.size() > 400 && f.size() <= 500));
  CHECK(f.descriptors.size() == f.size());
  for (const keypoint& k : f.keypoints) {
    CHECK((k.x >= 15.0F && k.y >= 15.0F && k.x <= 304.0F && k.y <= 224.0F));
    CHECK((k.angle >= 0.0F && k.angle < 2.0F * std::numbers::pi_v<float>));
    CHECK((k.octave >= 0 && k.octave < 5));
    CHECK(k.size == Approx(31.0 * std::pow(1.2, k.octave)).epsilon(0.01));
    CHECK(k.response >= 3.0F);
  }
  CHECK(std::is_sorted(f.keypoints.begin(), f.keypoints.end(),
                       [](const keypoint& a, const keypoint& b) { return a.octave < b.octave; }));
  CHECK(extract(im) == f);
}

TEST_CASE("images without room or texture have no ORB features") {
  const orb_extractor extract;
  CHECK(extract(image_view<const std::uint8_t>{}).empty());
  CHECK(extract(image_view<const rgb8>{}).empty());
  for (const auto& [width, height] : {std::pair{1, 1}, {1, 500}, {500, 1}, {30, 480}, {38, 38}, {500, 0}})
    CHECK(extract(blocks(width, height, 2)).empty());
  for (const int size : {39, 40, 41, 45, 60})
    CHECK_NOTHROW(extract(blocks(size, size, 2)));  // room for a few pixels only
  CHECK(extract(image<std::uint8_t>(640, 480, 128)).empty());
  CHECK(orb_extractor{{.max_features = 0}}(blocks(320, 240, 1)).empty());
  for (const int count : {7, 100, 333})
    CHECK(orb_extractor{{.max_features = count}}(blocks(320, 240, 1)).size() == static_cast<std::size_t>(count));
  CHECK(orb_extractor{{.max_features = 1}}(blocks(320, 240, 1)).size() == 1);
}

TEST_CASE("any number of levels and any factor between them give features inside the image, at every level") {
  for (const auto& [width, height] : {std::pair{39, 39}, {40, 200}, {65, 47}, {150, 101}}) {
    const auto im = test::noise(width, height, 12);
    const test::embedded_image embedded{im};
    for (const float factor : {1.0001F, 1.01F, 1.2F, 2.0F, 3.0F})
      for (const int levels : {1, 2, 16})
        for (const int most : {1, 60}) {
          const orb_extractor extract{{.max_features = most, .levels = levels, .scale_factor = factor}};
          const auto f = extract(embedded.view());
          CHECK(f.size() <= static_cast<std::size_t>(most));
          for (const keypoint& k : f.keypoints)
            CHECK((k.x > 15.0F && k.y > 15.0F && k.x < static_cast<float>(width) - 16.0F &&
                   k.y < static_cast<float>(height) - 16.0F && k.octave < levels));
          for (const auto level : simd::available_levels()) {
            const simd::level_limit limit{level};
            CHECK(extract(embedded.view()) == f);
          }
        }
  }
}

TEST_CASE("a strided view and a colour image have the features of the grey copy") {
  const auto whole = blocks(300, 220, 3);
  const image_view<const std::uint8_t> part{whole.data() + 17 * 300 + 11, 211, 160, 300};
  image<std::uint8_t> copy(211, 160);
  image<rgb8> color(211, 160);
  for (int y = 0; y != 160; ++y)
    for (int x = 0; x != 211; ++x) {
      copy(x, y) = part(x, y);
      color(x, y) = {part(x, y), part(x, y), part(x, y)};
    }
  const orb_extractor extract;
  const orbis::features::features f = extract(copy);
  REQUIRE(f.size() > 200);
  CHECK(extract(part) == f);
  CHECK(extract(color) == f);
}

TEST_CASE("ORB features are found again after a shift and a turn") {
  const auto im = blocks(400, 300, 5);
  const auto f = orb_extractor{}(im);
  const auto [angle, shift_x, shift_y] = GENERATE(std::tuple{0.0, 7.0, -4.0}, std::tuple{0.3, 5.5, 3.25},
                                                  std::tuple{1.5, 0.0, 0.0}, std::tuple{-2.5, 2.0, 1.0});
  const auto g = orb_extractor{}(moved(im, angle, shift_x, shift_y));
  const auto matches = matcher(f, g);
  std::size_t right = 0;
  double turn_error = 0.0;
  for (const match& m : matches) {
    const keypoint& a = f.keypoints[m.query];
    const keypoint& b = g.keypoints[m.train];
    const double dx = a.x - 200.0, dy = a.y - 150.0;
    const double x = std::cos(angle) * dx - std::sin(angle) * dy + 200.0 + shift_x;
    const double y = std::sin(angle) * dx + std::cos(angle) * dy + 150.0 + shift_y;
    if (std::hypot(b.x - x, b.y - y) > 2.0 * std::pow(1.2, a.octave)) continue;
    ++right;
    turn_error += std::abs(std::remainder(static_cast<double>(b.angle - a.angle) - angle, 2.0 * std::numbers::pi));
  }
  INFO(matches.size() << " matches, " << right << " right");
  CHECK(right > 120);
  CHECK(static_cast<double>(right) > 0.95 * static_cast<double>(matches.size()));
  CHECK(turn_error / static_cast<double>(right) < 0.15);
}

TEST_CASE("coarse keypoints are not shifted against the image") {
  // An image and its mirror image see the same corners at mirrored places, if coordinates are right.
  const auto im = blocks(320, 240, 6);
  image<std::uint8_t> mirrored(320, 240);
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x) mirrored(x, y) = im(319 - x, y);
  const auto f = orb_extractor{{.levels = 8}}(im);
  const auto g = orb_extractor{{.levels = 8}}(mirrored);
  double offset = 0.0;
  int count = 0;
  for (const keypoint& a : f.keypoints)
    for (const keypoint& b : g.keypoints)
      if (a.octave == b.octave && a.octave >= 5 && std::abs(319.0F - a.x - b.x) < 3.0F && std::abs(a.y - b.y) < 1.0F) {
        offset += static_cast<double>(319.0F - a.x - b.x);
        ++count;
      }
  REQUIRE(count > 20);
  CHECK(std::abs(offset / count) < 0.25);  // plain multiplication by the scale is off by 1.5 and more
}

TEST_CASE("every level of instructions finds the same ORB features") {
  const auto im = moved(blocks(333, 251, 7), 0.2, 0, 0);
  const test::embedded_image embedded{im};
  const orb_extractor extract{{.max_features = 400}};
  const auto expected = extract(im);
  REQUIRE(expected.size() == 400);
  for (const auto level : simd::available_levels()) {
    const simd::level_limit limit{level};
    CHECK(extract(im) == expected);
    CHECK(extract(embedded.view()) == expected);
  }
}

TEST_CASE("from the second image of its kind on, extraction allocates nothing") {
  const auto im = moved(blocks(320, 240, 9), 0.3, 0, 0);
  image<rgb8> color(320, 240);
  for (int y = 0; y != 240; ++y)
    for (int x = 0; x != 320; ++x) color(x, y) = {im(x, y), im(x, y), im(x, y)};
  const orb_extractor extract;
  orbis::features::features f, expected = extract(im);
  extract.into(f, color);
  const std::size_t before = test::allocations();
  extract.into(f, im);
  extract.into(f, color);
  if (test::counts_allocations()) CHECK(test::allocations() == before);
  CHECK(f == expected);
}

TEST_CASE("one extractor serves several threads, and copies serve as well") {
  const orb_extractor extract{{.max_features = 300}};
  std::vector<orbis::features::features> found(4);
  {
    std::vector<std::jthread> threads;
    for (std::size_t t = 0; t != found.size(); ++t)
      threads.emplace_back([&, t] {
        for (int i = 0; i != 5; ++i) found[t] = extract(blocks(200 + 20 * i, 200, t / 2));
      });
  }
  const orb_extractor copy{extract};
  for (std::size_t t = 0; t != found.size(); ++t) CHECK(found[t] == copy(blocks(280, 200, t / 2)));
}

TEST_CASE("noise, saturated and very large images have ORB features like any other") {
  const auto f = orb_extractor{}(test::noise(320, 240, 1));
  CHECK(f.size() == 1000);
  image<std::uint8_t> black_and_white = test::noise(320, 240, 2);
  for (std::uint8_t& p : black_and_white.pixels()) p = p < 128 ? 0 : 255;
  CHECK(orb_extractor{}(black_and_white).size() == 1000);

  const int width = 7680, height = 4320;
  image<std::uint8_t> large(width, height, 90);
  const auto tile = moved(blocks(320, 240, 3), 0.3, 0, 0);
  for (const auto& [left, top] : {std::pair{0, 0}, {width - 320, 0}, {0, height - 240}, {width - 320, height - 240}})
    for (int y = 0; y != 240; ++y)
      for (int x = 0; x != 320; ++x) large(left + x, top + y) = tile(x, y);
  const auto g = orb_extractor{{.max_features = 2000}}(large);
  CHECK(g.size() > 500);
  bool corners[2][2] = {};
  for (const keypoint& k : g.keypoints) {
    CHECK((k.x < 340.0F || k.x > static_cast<float>(width) - 341.0F));
    CHECK((k.y < 260.0F || k.y > static_cast<float>(height) - 261.0F));
    corners[k.y > 1000.0F][k.x > 1000.0F] = true;
  }
  CHECK((corners[0][0] && corners[0][1] && corners[1][0] && corners[1][1]));
}

TEST_CASE("positions within the pixel are better than whole pixels") {
  // The same picture, shifted by parts of a pixel: by how much do equal features miss each other?
  struct whole_pixels : fast9 {
    whole_pixels() { subpixel = false; }
  };
  const auto im = moved(blocks(400, 300, 11), 0.3, 0, 0);
  const auto error = [&](const auto& extract) {
    const auto f = extract(im);
    double sum = 0.0;
    std::size_t count = 0;
    for (const auto& [dx, dy] : {std::pair{0.5, 0.25}, {0.3, -0.4}, {-0.25, 0.75}}) {
      const auto g = extract(moved(im, 0.0, dx, dy));
      for (const match& m : matcher(f, g)) {
        const keypoint &a = f.keypoints[m.query], &b = g.keypoints[m.train];
        const double off = std::hypot(static_cast<double>(b.x - a.x) - dx, static_cast<double>(b.y - a.y) - dy);
        if (off > 3.0 || a.octave != b.octave) continue;
        sum += off / static_cast<double>(a.size / 31.0F);
        ++count;
      }
    }
    REQUIRE(count > 300);
    return sum / static_cast<double>(count);
  };
  const double within = error(orb_extractor{}), whole = error(basic_orb_extractor<whole_pixels>{});
  INFO("mean error " << within << " pixels against " << whole);
  CHECK(within < 0.7 * whole);
}

TEST_CASE("16-bit images must be narrowed first") {
  STATIC_REQUIRE(std::invocable<const orb_extractor&, image_view<const std::uint8_t>>);
  STATIC_REQUIRE(std::invocable<const orb_extractor&, image_view<const rgb8>>);
  STATIC_REQUIRE_FALSE(std::invocable<const orb_extractor&, image_view<const std::uint16_t>>);
  STATIC_REQUIRE_FALSE(std::invocable<const orb_extractor&, image_view<const float>>);
}

TEST_CASE("an extractor is assembled from parts") {
  const auto im = moved(blocks(320, 240, 10), 0.3, 0, 0);
  const orb_extractor clustered{{.max_features = 200}, {}, {.share = 0.0}};
  const orb_extractor covering{{.max_features = 200}, {}, {.share = 1.0}};
  CHECK(test::coverage(covering(im), 320, 240) > test::coverage(clustered(im), 320, 240));
  const basic_orb_extractor<fast9, cover_first, upright> level_camera{{.max_features = 200}};
  for (const keypoint& k : level_camera(im).keypoints) CHECK(k.angle == 0.0F);
  const auto turned = orb_extractor{{.max_features = 200}}(im), straight = level_camera(im);
  CHECK(turned.size() == straight.size());
  CHECK(turned.descriptors != straight.descriptors);
}

TEST_CASE("ORB features cover the kitchen and match from frame to frame") {
  ORBIS_NEEDS_DATA("kitchen");
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(test::data_dir() / "kitchen" / "rgb"))
    files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  REQUIRE(files.size() > 405);
  const orb_extractor extract{{.max_features = 1000, .levels = 8, .scale_factor = 1.2f}};
  double covered = 0.0;
  for (const std::size_t i : {0U, 100U, 200U, 300U, 400U}) {
    const auto f = extract(io::read_color(files[i]).value());
    const auto g = extract(io::read_color(files[i + 1]).value());
    CHECK(f.size() == 1000);
    covered += test::coverage(f, 640, 480) / 5.0;
    const auto matches = matcher(f, g);
    INFO(matches.size() << " matches in frame " << i);
    CHECK(matches.size() > 200);
    // Between neighbouring frames nothing moves far: almost all matches agree with their median shift.
    std::vector<float> dx, dy;
    for (const match& m : matches) {
      dx.push_back(g.keypoints[m.train].x - f.keypoints[m.query].x);
      dy.push_back(g.keypoints[m.train].y - f.keypoints[m.query].y);
    }
    const auto median = [](std::vector<float> v) {
      std::nth_element(v.begin(), v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2), v.end());
      return v[v.size() / 2];
    };
    const float mx = median(dx), my = median(dy);
    std::size_t agree = 0;
    for (std::size_t j = 0; j != dx.size(); ++j) agree += std::hypot(dx[j] - mx, dy[j] - my) < 15.0F ? 1 : 0;
    CHECK(static_cast<double>(agree) > 0.9 * static_cast<double>(dx.size()));
  }
  INFO("coverage " << covered);
  CHECK(covered > 0.55);
}
