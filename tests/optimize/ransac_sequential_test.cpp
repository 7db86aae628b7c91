// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <utility>
#include <vector>

#include <orbis/optimize/ransac.hpp>

#include "support.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::optimize;

namespace {

/// y = a x + b, which allocates nothing; with errors one by one, or by blocks.
struct line_estimator {
  using model = std::pair<double, double>;
  static constexpr std::size_t sample_size = 2;
  std::vector<std::pair<double, double>> points;

  struct one {
    model m;
    bool there = false;
    [[nodiscard]] const model* begin() const { return &m; }
    [[nodiscard]] const model* end() const { return &m + (there ? 1 : 0); }
  };
  [[nodiscard]] std::size_t size() const { return points.size(); }
  [[nodiscard]] one fit(const std::array<std::uint32_t, 2>& s) const {
    const auto [x0, y0] = points[s[0]];
    const auto [x1, y1] = points[s[1]];
    if (x0 == x1) return {};
    const double a = (y1 - y0) / (x1 - x0);
    return {{a, y0 - a * x0}, true};
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

struct line_by_blocks : line_estimator {
  void squared_errors(const model& m, std::size_t first, std::span<float, consensus_block> out) const {
    for (std::size_t i = 0; i != consensus_block; ++i)
      out[i] = first + i < size() ? static_cast<float>(squared_error(m, first + i)) : -1.0F;  // must not matter
  }
};
static_assert(model_estimator<line_estimator> && !block_estimator<line_estimator> && block_estimator<line_by_blocks>);

/// The good ones first, or shuffled.
template <class Estimator>
Estimator noisy_line(std::uint64_t seed, int good, int bad, bool shuffled = true) {
  Estimator e;
  random_bits random(seed);
  for (int i = 0; i < good; ++i) {
    const double x = random.uniform(-1, 1);
    e.points.emplace_back(x, 2.0 * x + 1.0 + random.uniform(-0.01, 0.01));
  }
  for (int i = 0; i < bad; ++i) {
    const double x = random.uniform(-1, 1);
    e.points.emplace_back(x, random.uniform(-5, 5));
  }
  if (shuffled)
    for (std::size_t i = e.points.size(); i > 1; --i)
      std::swap(e.points[i - 1], e.points[random.below(static_cast<std::uint32_t>(i))]);
  return e;
}

template <class Found>
bool is_the_line(const Found& found) {
  return found && std::abs(found->model.first - 2.0) < 0.02 && std::abs(found->model.second - 1.0) < 0.02;
}

}  // namespace

TEST_CASE("The score of a datum is between zero and the threshold, and there for outliers") {
  for (const double limit : {0.5, 3.0}) {
    CHECK(optimize::detail::msac_cost(0.0, limit) == 0.0);
    CHECK(optimize::detail::msac_cost(std::numeric_limits<double>::quiet_NaN(), limit) == limit);
    CHECK(optimize::detail::msac_cost(std::numeric_limits<double>::infinity(), limit) == limit);
    CHECK(optimize::detail::msac_cost(limit, limit) == limit);
    double last = 0.0;
    for (double e = 0.0; e < 5.0; e += 0.01) {
      CHECK(optimize::detail::msac_cost(e, limit) >= last);
      CHECK(optimize::detail::msac_cost(e, limit) <= limit);
      last = optimize::detail::msac_cost(e, limit);
      if (std::abs(e - limit) < 1e-3) continue;  // as a float it may lie on the other side
      CHECK(static_cast<double>(optimize::detail::msac_cost(static_cast<float>(e), static_cast<float>(limit))) ==
            Approx(last).margin(1e-5).epsilon(1e-5));
    }
  }
}

TEMPLATE_TEST_CASE("RANSAC finds the line by whatever it is made of", "", line_estimator, line_by_blocks) {
  const ransac_options options{.threshold = 0.03, .max_iterations = 5000};
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const auto data = noisy_line<TestType>(seed, 61, 142);
    const auto exact = ransac(data, options);
    CHECK(is_the_line(exact));
    CHECK(is_the_line(ransac(data, {.threshold = 0.03, .max_iterations = 5000, .refinements = 0})));
    const auto tested = ransac(data, {.threshold = 0.03, .max_iterations = 5000, .model_cost = 200.0});
    CHECK(is_the_line(tested));
    // Local optimisation ends at the same minimum, whichever sample it has started from.
    REQUIRE(exact.has_value());
    REQUIRE(tested.has_value());
    CHECK(tested->score == Approx(exact->score).epsilon(0.02));
    CHECK(tested->inliers.size() + 3 >= exact->inliers.size());
  }
}

TEST_CASE("Errors by blocks rank models as errors one by one do") {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const ransac_options options{.threshold = 0.03, .seed = seed};
    const auto one_by_one = ransac(noisy_line<line_estimator>(seed, 50, 83), options);
    const auto by_blocks = ransac(noisy_line<line_by_blocks>(seed, 50, 83), options);
    REQUIRE(one_by_one.has_value());
    REQUIRE(by_blocks.has_value());
    CHECK(one_by_one->inliers == by_blocks->inliers);
    CHECK(one_by_one->score == Approx(by_blocks->score));
  }
}

TEST_CASE("The sequential test lets good models through and most bad ones not") {
  optimize::detail::sequential_test test(200.0);
  random_bits random(5);
  const auto scored_to_its_end = [&](double ratio) {
    test.begin();
    std::size_t inliers = 0, data = 0;
    for (int block = 0; block != 60; ++block) {
      std::size_t inside = 0;
      for (int i = 0; i != 32; ++i) inside += random.uniform() < ratio ? 1U : 0U;
      inliers += inside;
      data += 32;
      if (test.rejects(inside, 32)) {
        test.end(inliers, data);
        return false;
      }
    }
    test.end(inliers, data);
    return true;
  };
  for (int k = 0; k != 100; ++k) CHECK(scored_to_its_end(0.02));  // nothing is known yet
  test.adopted(0.3);
  int good = 0, bad = 0;
  for (int k = 0; k != 1000; ++k) {
    bad += scored_to_its_end(0.02);
    if (k % 20 == 0) good += scored_to_its_end(0.3);
  }
  CHECK(good >= 45);
  CHECK(bad <= 10);
  CHECK(test.recognised() > 0.9);
  CHECK(test.recognised() < 1.0);
}

TEST_CASE("RANSAC with a workspace allocates nothing but its answer, however long it runs") {
  if (!test::counts_allocations()) return;
  const auto data = noisy_line<line_by_blocks>(4, 100, 300);
  ransac_workspace workspace;
  const auto allocated = [&](std::size_t iterations) {
    const std::size_t before = test::allocations();
    const auto found = ransac(data, {.threshold = 0.03, .min_iterations = iterations, .model_cost = 200.0}, workspace);
    const std::size_t after = test::allocations();
    CHECK(is_the_line(found));
    return after - before;
  };
  allocated(10);
  CHECK(allocated(10) <= 1);
  CHECK(allocated(5000) <= 1);
}
