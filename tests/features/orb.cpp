// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>
#include <tuple>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/io/image.hpp>

#include "support/catch.hpp"
#include "support/data.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

/// Blocks of random brightness at two scales: corners everywhere.
image<std::uint8_t> blocks(int width, int height, std::uint64_t seed) {
  image<std::uint8_t> im(width, height);
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) {
      const auto at = [&](int cell, std::uint64_t salt) {
        return mix64(seed ^ mix64(salt + static_cast<std::uint64_t>((y / cell) * 1000 + x / cell))) % 100;
      };
      im(x, y) = static_cast<std::uint8_t>(20 + at(11, 1) + at(29, 1 << 20));
    }
  return im;
}

/// The image turned about `(cx, cy)` by `angle` and then shifted, bilinear; 0 outside.
image<std::uint8_t> moved(const image<std::uint8_t>& from, double angle, double shift_x, double shift_y) {
  const double cx = from.width() / 2.0, cy = from.height() / 2.0;
  image<std::uint8_t> to(from.width(), from.height());
  for (int y = 0; y != to.height(); ++y)
    for (int x = 0; x != to.width(); ++x) {
      const double dx = x - cx - shift_x, dy = y - cy - shift_y;
      const double u = std::cos(angle) * dx + std::sin(angle) * dy + cx;
      const double v = -std::sin(angle) * dx + std::cos(angle) * dy + cy;
      const int iu = static_cast<int>(std::floor(u)), iv = static_cast<int>(std::floor(v));
      if (!from.view().contains(iu, iv) || !from.view().contains(iu + 1, iv + 1)) continue;
      const double a = u - iu, b = v - iv;
      const double value = (1 - a) * (1 - b) * from(iu, iv) + a * (1 - b) * from(iu + 1, iv) +
                           (1 - a) * b * from(iu, iv + 1) + a * b * from(iu + 1, iv + 1);
      to(x, y) = static_cast<std::uint8_t>(std::lround(value));
    }
  return to;
}

/// Of the 32-pixel cells, the share that holds a keypoint.
double coverage(const orbis::features::features& f, int width, int height) {
  std::set<std::pair<int, int>> cells;
  for (const keypoint& k : f.keypoints)
    cells.emplace(static_cast<int>(k.x + 0.5F) / 32, static_cast<int>(k.y + 0.5F) / 32);
  return static_cast<double>(cells.size()) / ((width / 32) * (height / 32));
}

constexpr auto matcher = brute_force(hamming{}) | ratio_test{0.8f} | cross_check{} | max_distance{64};

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
    CHECK(k.response >= 7.0F);
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

TEST_CASE("no ORB feature lies where the mask is zero") {
  const auto im = blocks(320, 240, 4);
  image<std::uint8_t> mask(320, 240, 0);
  for (int y = 0; y != 240; ++y)
    for (int x = 100; x != 200; ++x) mask(x, y) = 255;
  const auto f = orb_extractor{}(im, mask);
  REQUIRE(f.size() > 100);
  for (const keypoint& k : f.keypoints)
    CHECK(mask(static_cast<int>(std::lround(k.x)), static_cast<int>(std::lround(k.y))) != 0);
  CHECK(orb_extractor{}(im, image<std::uint8_t>(320, 240, 0)).empty());
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

TEST_CASE("corners are spread over cells before any cell gives a second") {
  std::vector<corner> corners;
  for (int y = 0; y != 40; ++y)
    for (int x = 0; x != 40; ++x) corners.push_back({x, y, 100.0F});  // a cluster of strong ones
  corners.push_back({150, 150, 10.0F});                               // a weak one, alone
  corners.push_back({152, 150, 9.0F});                                // its weaker neighbour
  const auto chosen = spread(corners, 16, 200, 200, 20.0F);
  CHECK(chosen.size() == 16);
  CHECK(std::count(chosen.begin(), chosen.end(), corner{150, 150, 10.0F}) == 1);
  CHECK(std::count(chosen.begin(), chosen.end(), corner{152, 150, 9.0F}) == 0);
  std::reverse(corners.begin(), corners.end());
  CHECK(spread(corners, 16, 200, 200, 20.0F) == chosen);
  CHECK(spread(corners, 0, 200, 200, 20.0F).empty());
  CHECK(spread({}, 16, 200, 200, 20.0F).empty());
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
    covered += coverage(f, 640, 480) / 5.0;
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
  CHECK(covered > 0.5);
}
