// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

constexpr float not_a_number = std::numeric_limits<float>::quiet_NaN();

projection random_projection(random_bits& random) {
  const auto between = [&](double a, double b) { return static_cast<float>(random.uniform(a, b)); };
  projection p{between(-20, 660), between(-20, 500), between(0.5, 5.0), between(0.3, 1.0), between(0.2, 2.0), 0.0F};
  p.max_distance = p.min_distance * 3.583F;  // seven levels of 1.2
  if (random.below(3) == 0) p.cosine = 1.0F;
  return p;
}

}  // namespace

TEST_CASE("the predicted level is that of the ratio of distances, rounded up") {
  for (int level = 0; level != 8; ++level) {
    const float far = 4.0F;
    const float at = far / std::pow(1.2F, static_cast<float>(level));
    CHECK(predicted_octave(at * 1.01F, far, 8, 1.2F) == level);
    CHECK(predicted_octave(at * 1.19F, far, 8, 1.2F) == level);
    CHECK(predicted_octave(at * 0.99F, far, 8, 1.2F) == std::min(level + 1, 7));
  }
  CHECK(predicted_octave(1e-9F, 4.0F, 8, 1.2F) == 7);
  CHECK(predicted_octave(100.0F, 4.0F, 8, 1.2F) == 0);
}

TEST_CASE("a window grows with the level and the angle, and there is none out of range") {
  const projection_rule rule{};
  const projection p{100.0F, 50.0F, 2.1F, 1.0F, 1.0F, 2.0F * 1.2F * 1.2F};
  const window w = search_window(p, rule);
  CHECK(w.x == 100.0F);
  CHECK(w.y == 50.0F);
  CHECK(w.radius == Approx(4.0 * 1.44));
  CHECK(w.min_octave == 1);
  CHECK(w.max_octave == 3);
  const auto with = [&](auto change) {
    projection changed = p;
    change(changed);
    return search_window(changed, rule);
  };
  CHECK(with([](projection& x) { x.cosine = 0.9F; }).radius == Approx(1.6 * 4.0 * 1.44));
  CHECK(with([](projection& x) { x.cosine = 0.49F; }).radius < 0.0F);
  CHECK(with([](projection& x) { x.cosine = not_a_number; }).radius < 0.0F);
  CHECK(with([](projection& x) { x.distance = 0.79F; }).radius < 0.0F);
  CHECK(with([](projection& x) { x.distance = 0.81F; }).radius > 0.0F);
  CHECK(with([](projection& x) { x.distance = 3.4F; }).radius > 0.0F);
  CHECK(with([](projection& x) { x.distance = 3.5F; }).radius < 0.0F);
  CHECK(with([](projection& x) { x.distance = 0.0F; }).radius < 0.0F);
  CHECK(with([](projection& x) { x.distance = not_a_number; }).radius < 0.0F);
  CHECK(with([](projection& x) { x.x = not_a_number; }).radius < 0.0F);
  const window any = with([](projection& x) { x.max_distance = std::numeric_limits<float>::infinity(); });
  CHECK(any.min_octave == 0);
  CHECK(any.max_octave == 7);
  CHECK(any.radius == 4.0F);
}

TEST_CASE("projected matching equals a search through all trains with every rule tested") {
  const simd::level_limit limit{GENERATE(from_range(simd::available_levels()))};
  const auto q = test::random_features(300, 1);
  const auto t = test::random_features(500, 2);
  random_bits random{5};
  std::vector<projection> points(q.size());
  for (auto& p : points) p = random_projection(random);
  const projection_rule rule{.radius = 25.0F, .finer = 2, .coarser = 1};
  // Every seventh point lies behind the camera.
  const auto project = [&](const projection& p) -> std::optional<projection> {
    if ((&p - points.data()) % 7 == 0) return std::nullopt;
    return p;
  };
  const auto expected = test::naive_candidates(q, t, [&](std::uint32_t i, std::uint32_t j) {
    const projection& p = points[i];
    if (i % 7 == 0 || p.cosine < 0.5F || p.distance < 0.8F * p.min_distance || p.distance > 1.2F * p.max_distance)
      return false;
    const double octave =
        std::clamp(std::ceil(std::log(double{p.max_distance} / double{p.distance}) / std::log(1.2)), 0.0, 7.0);
    const double radius = 25.0 * std::pow(1.2, octave) * (p.cosine < 0.998F ? 1.6 : 1.0);
    const keypoint& k = t.keypoints[j];
    return std::hypot(double{k.x} - double{p.x}, double{k.y} - double{p.y}) <= radius && k.octave >= octave - 2 &&
           k.octave <= octave + 1;
  });
  const auto source = projected(hamming{}, rule);
  const search_needs reverse{.reverse = true};
  CHECK(expected.size() > 50);
  CHECK(test::candidates_of(source, as_view(q), as_view(t), reverse, points, project) == expected);
  CHECK(test::candidates_of(source, as_view(q), as_view(t), reverse, points, project,
                            keypoint_grid{t.keypoints, 33.0F}) == expected);
}

TEST_CASE("a projected chain finds points again in an image") {
  const camera::pinhole camera{640, 480, 500.0, 500.0, 320.0, 240.0};
  random_bits random{9};
  orbis::features::features frame;
  std::vector<vec3> points;
  std::vector<binary_descriptor<256>> descriptors;
  for (int i = 0; i != 300; ++i) {
    const vec2 pixel{random.uniform(5.0, 635.0), random.uniform(5.0, 475.0)};
    points.push_back(random.uniform(0.5, 4.0) * camera.unproject(pixel).value());
    binary_descriptor<256> d;
    for (auto& word : d.words) word = random();
    descriptors.push_back(d);
    d.words[0] ^= 0x1010101;
    frame.descriptors.push_back(d);
    frame.keypoints.push_back({.x = static_cast<float>(pixel.x()) + 1.0F, .y = static_cast<float>(pixel.y()) - 1.0F});
  }
  constexpr auto matcher = projected(hamming{}, {.radius = 3.0F}) | max_distance{50} | unique{};
  const auto matches = matcher(descriptors, frame, points, camera_projection{camera, se3{}});
  REQUIRE(matches.size() == 300);
  for (std::uint32_t i = 0; i != 300; ++i) REQUIRE(matches[i] == match{i, i, 4});
}
