// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/stereo.hpp>

#include "features/images.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

constexpr int width = 640, height = 400;

/// A picture between its pixels; smooth enough for that.
class texture {
 public:
  texture() : pixels_{test::blocks(width + 400, height, 5)} {
    for (int pass = 0; pass != 2; ++pass) {  // no steps that fall between pixels
      const auto from = pixels_;
      for (int y = 1; y + 1 < height; ++y)
        for (int x = 1; x + 1 < from.width(); ++x) {
          int sum = 0;
          for (int v = -1; v <= 1; ++v)
            for (int u = -1; u <= 1; ++u) sum += from(x + u, y + v) * (2 - std::abs(u)) * (2 - std::abs(v));
          pixels_(x, y) = static_cast<std::uint8_t>((sum + 8) / 16);
        }
    }
  }
  [[nodiscard]] double operator()(double x, int y) const {
    const double at = x + 200.0;
    const int x0 = static_cast<int>(std::floor(at));
    return (1.0 - (at - x0)) * pixels_(x0, y) + (at - x0) * pixels_(x0 + 1, y);
  }

 private:
  image<std::uint8_t> pixels_;
};

/// Disparities that change from row to row and along it, 36 to 58 pixels.
double disparity(double x, double y) { return 32.0 + 20.0 * std::sin(0.004 * y + 1.0) + 6.0 * std::sin(0.007 * x); }

struct stereo_pair {
  image<std::uint8_t> left{width, height}, right{width, height};
};

/// What the left camera sees at (x, y) the right one sees at (x - disparity, y), with noise, and darker or brighter.
stereo_pair seen(double noise, double gain = 1.0, double offset = 0.0) {
  const texture tex;
  random_bits random{7};
  stereo_pair pair;
  const auto grey = [&](double v) {
    return static_cast<std::uint8_t>(std::clamp(v + noise * random.normal(), 0.0, 255.0) + 0.5);
  };
  for (int y = 0; y != height; ++y)
    for (int x = 0; x != width; ++x) {
      pair.left(x, y) = grey(tex(x - disparity(x, y), y));
      pair.right(x, y) = grey(gain * tex(x, y) + offset);
    }
  return pair;
}

struct outcome {
  double matched = 0.0;    ///< share of the features that the right image shows
  double deviation = 0.0;  ///< median error times 1.48, pixels of the feature's level
  double bias = 0.0;       ///< mean error without the wrong ones
  double wrong = 0.0;      ///< share of matches farther off than 2 pixels of the level
  std::size_t found = 0;
};

outcome judge(const features::features& left, const std::vector<float>& columns) {
  outcome o;
  double there = 0.0, wrong = 0.0;
  std::vector<double> errors;
  for (std::size_t i = 0; i != left.size(); ++i) {
    const auto& k = left.keypoints[i];
    const double truth = k.x - disparity(k.x, k.y), scale = std::pow(1.2, k.octave);
    there += truth > 10.0 * scale;
    if (std::isnan(columns[i])) continue;
    const double error = (columns[i] - truth) / scale;
    errors.push_back(std::abs(error));
    wrong += errors.back() > 2.0;
    if (errors.back() <= 2.0) o.bias += error;
  }
  o.found = errors.size();
  if (errors.empty()) return o;
  std::nth_element(errors.begin(), errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
  o.matched = static_cast<double>(errors.size()) / there;
  o.deviation = 1.48 * errors[errors.size() / 2];
  o.bias /= static_cast<double>(errors.size()) - wrong;
  o.wrong = wrong / static_cast<double>(errors.size());
  return o;
}

}  // namespace

TEST_CASE("right coordinates of a textured pair are found between pixels and with few outliers") {
  const features::orb_extractor extract;
  const features::stereo_matcher match;
  const auto look = [&](const stereo_pair& pair) {
    const auto left = extract(pair.left), right = extract(pair.right);
    return judge(left, match(left, pair.left, right, pair.right, {.max_disparity = 200.0F}));
  };
  const auto check = [](const outcome& o, double matched, double deviation) {
    CHECK(o.matched > matched);
    CHECK(o.deviation < deviation);
    CHECK(std::abs(o.bias) < 0.02);
    CHECK(o.wrong < 0.005);
  };
  SECTION("without noise") { check(look(seen(0.0)), 0.75, 0.1); }
  SECTION("with noise") { check(look(seen(3.0)), 0.75, 0.1); }
  SECTION("with another exposure") { check(look(seen(2.0, 0.8, 25.0)), 0.7, 0.16); }
}

TEST_CASE("right coordinates outside of the disparities that are allowed are not found") {
  const features::orb_extractor extract;
  const features::stereo_matcher match;
  const stereo_pair pair = seen(1.0);
  const auto left = extract(pair.left), right = extract(pair.right);
  const auto columns = match(left, pair.left, right, pair.right, {.min_disparity = 44.0F, .max_disparity = 52.0F});
  std::size_t found = 0, beyond = 0;
  for (std::size_t i = 0; i != left.size(); ++i) {
    const auto& k = left.keypoints[i];
    if (std::isnan(columns[i])) continue;
    ++found;
    CHECK(k.x - columns[i] > 43.999F);
    CHECK(k.x - columns[i] < 52.001F);
    const double truth = disparity(k.x, k.y);
    beyond += truth < 42.0 || truth > 54.0;
  }
  CHECK(found > 200);
  CHECK(beyond < found / 50);
}

TEST_CASE("features that the right image does not show have no right coordinate") {
  const features::orb_extractor extract;
  const features::stereo_matcher match;
  const stereo_pair pair = seen(1.0);
  const auto other = test::moved(test::blocks(width, height, 99), 0.0, 0.0, 0.0);
  const auto left = extract(pair.left), right = extract(other);
  const auto columns = match(left, pair.left, right, other, {.max_disparity = 200.0F});
  CHECK(std::count_if(columns.begin(), columns.end(), [](float c) { return !std::isnan(c); }) <
        static_cast<std::ptrdiff_t>(left.size() / 20));
  // Rows that do not fit, as of a pair that is not rectified.
  image<std::uint8_t> lower(width, height);
  for (int y = 12; y != height; ++y)
    for (int x = 0; x != width; ++x) lower(x, y) = pair.right(x, y - 12);
  const auto below = match(left, pair.left, extract(lower), lower, {.max_disparity = 200.0F});
  const auto aligned = match(left, pair.left, extract(pair.right), pair.right, {.max_disparity = 200.0F});
  const auto count = [](const std::vector<float>& all) {
    return std::count_if(all.begin(), all.end(), [](float c) { return !std::isnan(c); });
  };
  CHECK(count(below) < count(aligned) / 5);
}

TEST_CASE("pairs without features, and features that lie nowhere, have no right coordinates") {
  const features::stereo_matcher match;
  const image<std::uint8_t> blank(64, 48, 100);
  features::features none, some;
  some.keypoints = {{.x = 30.0F, .y = 20.0F},
                    {.x = 1.0F, .y = 1.0F},
                    {.x = std::nanf(""), .y = 3.0F},
                    {.x = 30.0F, .y = 20.0F, .octave = 20},
                    {.x = -900.0F, .y = 9000.0F}};
  some.descriptors.resize(5);
  CHECK(match(none, blank, none, blank).empty());
  CHECK(match(none, blank, some, blank).empty());
  const auto columns = match(some, blank, some, blank);
  REQUIRE(columns.size() == 5);
  for (const float c : columns) CHECK(std::isnan(c));
  CHECK(std::isnan(match(some, blank, none, blank)[0]));
}

TEST_CASE("right coordinates found with the extractor's pyramids are those found with the images") {
  const features::orb_extractor extract{{.max_features = 500, .levels = 5, .scale_factor = 1.3F}};
  static_assert(features::pyramid_extractor<features::orb_extractor>);
  const features::stereo_matcher match;
  const stereo_pair pair = seen(1.0);
  features::image_pyramid left_pyramid, right_pyramid;
  features::features left, right;
  extract.into(left, left_pyramid, pair.left);
  extract.into(right, right_pyramid, pair.right);
  CHECK(left_pyramid.size() == 5);
  const auto alone = extract(pair.left);
  CHECK(left.keypoints == alone.keypoints);
  CHECK(left.descriptors == alone.descriptors);
  std::vector<float> columns;
  match.into(columns, left, left_pyramid, right, right_pyramid, {.max_disparity = 200.0F});
  const auto expected =
      match(left, pair.left, right, pair.right, {.levels = 5, .scale_factor = 1.3F, .max_disparity = 200.0F});
  REQUIRE(columns.size() == expected.size());
  std::size_t found = 0;
  for (std::size_t i = 0; i != columns.size(); ++i) {
    CHECK((columns[i] == expected[i] || (std::isnan(columns[i]) && std::isnan(expected[i]))));
    found += !std::isnan(columns[i]);
  }
  CHECK(found > 200);
}

TEST_CASE("matching another pair of the same size allocates nothing") {
  const features::orb_extractor extract;
  const features::stereo_matcher match;
  const stereo_pair pair = seen(1.0);
  const auto left = extract(pair.left), right = extract(pair.right);
  std::vector<float> columns;
  match.into(columns, left, pair.left, right, pair.right);
  const auto before = columns;
  const auto count = test::allocations();
  match.into(columns, left, pair.left, right, pair.right);
  if (test::counts_allocations()) CHECK(test::allocations() == count);
  CHECK(std::equal(before.begin(), before.end(), columns.begin(),
                   [](float a, float b) { return a == b || (std::isnan(a) && std::isnan(b)); }));
}
