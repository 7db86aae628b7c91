// SPDX-License-Identifier: BSD-3-Clause
#include <utility>

#include <orbis/optimize/ransac.hpp>

#include "support.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

/// y = a x + b: the smallest estimator there is.
struct line_estimator {
  using model = std::pair<double, double>;
  static constexpr std::size_t sample_size = 2;
  std::vector<std::pair<double, double>> points;

  [[nodiscard]] std::size_t size() const { return points.size(); }
  [[nodiscard]] std::vector<model> fit(const std::array<std::uint32_t, 2>& s) const {
    const auto [x0, y0] = points[s[0]];
    const auto [x1, y1] = points[s[1]];
    if (x0 == x1) return {};
    const double a = (y1 - y0) / (x1 - x0);
    return {{a, y0 - a * x0}};
  }
  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const double e = points[i].second - m.first * points[i].first - m.second;
    return e * e;
  }
  [[nodiscard]] std::optional<model> refine(const model&, std::span<const std::uint32_t> inliers) const {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const auto i : inliers) {
      const auto [x, y] = points[i];
      n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
    }
    const double d = n * sxx - sx * sx;
    if (d == 0.0) return std::nullopt;
    const double a = (n * sxy - sx * sy) / d;
    return model{a, (sy - a * sx) / n};
  }
};
static_assert(optimize::model_estimator<line_estimator>);

line_estimator noisy_line(std::uint64_t seed, int good, int bad) {
  line_estimator e;
  random_bits random(seed);
  for (int i = 0; i < good; ++i) {
    const double x = random.uniform(-1, 1);
    e.points.emplace_back(x, 2.0 * x + 1.0 + random.uniform(-0.01, 0.01));
  }
  for (int i = 0; i < bad; ++i) e.points.emplace_back(random.uniform(-1, 1), random.uniform(-5, 5));
  return e;
}

}  // namespace

TEST_CASE("RANSAC finds the line among outliers and its inliers are those of the returned model") {
  const auto data = noisy_line(3, 60, 140);
  const auto found = optimize::ransac(data, {.threshold = 0.03});
  REQUIRE(found.has_value());
  CHECK(found->model.first == Approx(2.0).margin(0.02));
  CHECK(found->model.second == Approx(1.0).margin(0.02));
  std::vector<std::uint32_t> expected;
  double score = 0.0;
  for (std::uint32_t i = 0; i < data.size(); ++i) {
    const double e = data.squared_error(found->model, i);
    if (e < 0.03 * 0.03) expected.push_back(i);
    score += std::min(e, 0.03 * 0.03);
  }
  CHECK(found->inliers == expected);
  CHECK(found->score == Approx(score));
}

TEST_CASE("RANSAC gives the same answer for the same seed and stops early on clean data") {
  const auto data = noisy_line(5, 50, 50);
  const auto a = optimize::ransac(data, {.threshold = 0.03, .seed = 42});
  const auto b = optimize::ransac(data, {.threshold = 0.03, .seed = 42});
  REQUIRE(a.has_value());
  REQUIRE(b.has_value());
  CHECK(a->model == b->model);
  CHECK(a->inliers == b->inliers);
  CHECK(a->iterations == b->iterations);
  const auto clean = optimize::ransac(noisy_line(6, 100, 0), {.threshold = 0.03, .min_iterations = 5});
  REQUIRE(clean.has_value());
  CHECK(clean->iterations < 20);
}

TEST_CASE("RANSAC says why it has no answer") {
  CHECK(optimize::ransac(noisy_line(1, 1, 0), {}).error().code == errc::no_data);
  for (const double bad : test::bad_thresholds)
    CHECK(optimize::ransac(noisy_line(1, 9, 0), {.threshold = bad}).error().code == errc::invalid_argument);
  CHECK(optimize::ransac(noisy_line(1, 9, 0), {.confidence = 1.0}).error().code == errc::invalid_argument);
  CHECK(optimize::ransac(noisy_line(1, 0, 60), {.threshold = 0.01, .max_iterations = 100, .min_inliers = 40})
            .error()
            .code == errc::degenerate);
  line_estimator vertical;
  for (int i = 0; i < 9; ++i) vertical.points.emplace_back(1.0, i);
  CHECK(optimize::ransac(vertical, {.max_iterations = 50}).error().code == errc::degenerate);
}
