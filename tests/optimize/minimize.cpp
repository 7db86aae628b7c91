// SPDX-License-Identifier: BSD-3-Clause
#include <array>
#include <cmath>
#include <limits>
#include <tuple>
#include <vector>

#include <orbis/optimize/automatic.hpp>
#include <orbis/optimize/minimize.hpp>
#include <orbis/optimize/prior.hpp>

#include "support.hpp"
#include "support/allocations.hpp"
#include "support/catch.hpp"

using namespace orbis;
using optimize::minimize;
using optimize::minimize_status;

namespace {

/// A point of a curve `a exp(b t)`.
struct on_curve {
  using point = vec2;
  static constexpr int dimension = 1;
  double t, y;
  std::optional<matrix<1>> residual(const vec2& p) const { return matrix<1>(p[0] * std::exp(p[1] * t) - y); }
  std::optional<matrix<1>> linearize(const vec2& p, matrix<1, 2>& j) const {
    const double e = std::exp(p[1] * t);
    j << e, p[0] * t * e;
    return matrix<1>(p[0] * e - y);
  }
};

std::vector<on_curve> curve(double a, double b, double sigma, std::uint64_t seed) {
  random_bits random(seed);
  std::vector<on_curve> all;
  for (double t = 0.0; t < 2.0; t += 0.05) all.push_back({t, a * std::exp(b * t) + sigma * random.normal()});
  return all;
}

double gradient_norm(const vec2& x, const std::vector<on_curve>& residuals) {
  vec2 g = vec2::Zero();
  for (const on_curve& r : residuals) {
    matrix<1, 2> j = matrix<1, 2>::Zero();
    const matrix<1> value = *r.linearize(x, j);
    g += j.transpose() * value;
  }
  return g.norm();
}

}  // namespace

TEST_CASE("Small problems: a curve is fitted, and the gradient vanishes") {
  for (std::uint64_t seed = 0; seed != 20; ++seed) {
    const auto data = curve(2.0, -0.7, 0.01, seed);
    vec2 x(1.0, 0.0);
    const auto summary = minimize(optimize::euclidean<2>{}, x, data);
    CHECK(summary.status == minimize_status::converged);
    CHECK(summary.residuals == static_cast<int>(data.size()));
    CHECK(summary.final_cost < summary.initial_cost);
    CHECK(gradient_norm(x, data) < 1e-6);
    CHECK((x - vec2(2.0, -0.7)).norm() < 0.05);
  }
}

TEST_CASE("Small problems: Rosenbrock's valley is followed to its end") {
  const optimize::automatic valley{[](const auto& v) {
                                     auto r = v;
                                     r[0] = 10.0 * (v[1] - v[0] * v[0]);
                                     r[1] = 1.0 - v[0];
                                     return r;
                                   },
                                   optimize::euclidean<2>{}};
  for (const vec2& start : {vec2(-1.2, 1.0), vec2(10.0, -10.0), vec2(-100.0, 3.0)}) {
    vec2 x = start;
    const auto summary = minimize(optimize::euclidean<2>{}, x, valley, {.max_iterations = 500});
    CHECK(summary.status == minimize_status::converged);
    CHECK((x - vec2(1, 1)).norm() < 1e-6);
  }
}

TEST_CASE("Small problems: priors of different kinds together are their weighted mean, on any manifold") {
  random_bits random(2);
  const se3 a = test::random_pose(random);
  const se3 b = a * se3::exp((vec6() << 0.2, 0, 0, 0, 0, 0).finished());
  const optimize::pose_prior near_a{a, mat6::Identity() * 3.0, {}}, near_b{b, mat6::Identity(), {}};
  se3 x = test::random_pose(random);
  const auto summary = minimize(optimize::lie_group<se3>{}, x, std::tie(near_a, near_b));
  CHECK(summary.ok());
  CHECK(summary.residuals == 2);
  CHECK(test::distance_between(x, a) == Approx(0.02).epsilon(1e-6));
  const std::array more{near_b, near_b};
  se3 y = x;
  CHECK(minimize(optimize::lie_group<se3>{}, y, std::tuple{near_a, more}).ok());
  CHECK(test::distance_between(y, a) == Approx(0.2 * 2.0 / 11.0).epsilon(1e-6));

  vec3 direction = vec3(0.1, 0.2, -1.0).normalized();
  const optimize::automatic towards{[](const auto& d) {
                                      auto r = d;
                                      r -= vec3(0.6, 0.0, 0.8).cast<typename std::decay_t<decltype(d)>::Scalar>();
                                      return r;
                                    },
                                    optimize::unit_sphere{}};
  CHECK(minimize(optimize::unit_sphere{}, direction, towards).ok());
  CHECK((direction - vec3(0.6, 0.0, 0.8)).norm() < 1e-6);

  using planar = optimize::subset<optimize::lie_group<se3>, 0, 1, 5>;
  se3 flat;
  CHECK(minimize(planar{}, flat, near_b).ok());
  CHECK(flat.translation().z() == 0.0);
}

TEST_CASE("Small problems: a robust loss ignores outliers, and a narrowing one from far away") {
  auto data = curve(2.0, -0.7, 0.005, 3);
  for (std::size_t i = 0; i < data.size(); i += 4) data[i].y += 4.0;
  vec2 plain(1.0, 0.0), robust(1.0, 0.0), graduated(-3.0, 1.0);
  CHECK(minimize(optimize::euclidean<2>{}, plain, data).ok());
  CHECK(minimize(optimize::euclidean<2>{}, robust, data, {}, optimize::cauchy{0.05}).ok());
  const optimize::graduated schedule{optimize::geman_mcclure{0.05}, 256.0};
  const auto summary = minimize(optimize::euclidean<2>{}, graduated, data, {}, schedule);
  CHECK(summary.ok());
  CHECK(summary.final_cost < summary.initial_cost);
  CHECK((plain - vec2(2.0, -0.7)).norm() > 0.1);
  CHECK((robust - vec2(2.0, -0.7)).norm() < 0.02);
  CHECK((graduated - vec2(2.0, -0.7)).norm() < 0.02);
}

TEST_CASE("Small problems that are none say why and leave the start alone or better") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  vec2 x(1.0, 2.0);
  CHECK(minimize(optimize::euclidean<2>{}, x, std::vector<on_curve>{}).status == minimize_status::no_residuals);
  CHECK(x == vec2(1.0, 2.0));
  CHECK(minimize(optimize::euclidean<2>{}, x, std::vector<on_curve>{{nan, 1.0}}).status ==
        minimize_status::invalid_start);
  CHECK(x == vec2(1.0, 2.0));
  vec2 lost(nan, 0.0);
  CHECK(minimize(optimize::euclidean<2>{}, lost, curve(1, 1, 0, 1)).status == minimize_status::invalid_start);

  // One observation of two unknowns.
  const std::vector<on_curve> one{{1.0, 3.0}};
  const auto summary = minimize(optimize::euclidean<2>{}, x, one);
  CHECK(summary.status == minimize_status::undetermined);
  CHECK(summary.final_cost < 1e-12);
  // An unknown that nothing depends on.
  const optimize::automatic first{[](const auto& v) {
                                    using S = typename std::decay_t<decltype(v)>::Scalar;
                                    return matrix<1, 1, S>(v[0] - 5.0);
                                  },
                                  optimize::euclidean<2>{}};
  x = vec2(1.0, 2.0);
  CHECK(minimize(optimize::euclidean<2>{}, x, first).status == minimize_status::undetermined);
  CHECK(x[0] == Approx(5.0));
  CHECK(x[1] == 2.0);

  // A step may not lose a residual that had a value.
  const optimize::automatic root{[](const auto& v) {
                                   using std::sqrt;
                                   using S = typename std::decay_t<decltype(v)>::Scalar;
                                   return matrix<1, 1, S>(sqrt(v[0]) + 1.0);
                                 },
                                 optimize::euclidean<1>{}};
  matrix<1> positive(2.0);
  const auto kept = minimize(optimize::euclidean<1>{}, positive, root);
  CHECK(kept.residuals == 1);
  CHECK(positive[0] >= 0.0);
  CHECK(kept.final_cost <= kept.initial_cost);
}

TEST_CASE("Small problems never get worse, whatever the limits") {
  for (int limit = 0; limit != 12; ++limit) {
    const auto data = curve(-1.0, 1.3, 0.5, static_cast<std::uint64_t>(limit));
    vec2 x(0.3, -2.0);
    const auto summary = minimize(optimize::euclidean<2>{}, x, data, {.max_iterations = limit}, optimize::huber{0.3});
    CHECK(summary.final_cost <= summary.initial_cost);
    CHECK(summary.iterations <= limit);
    if (limit == 0) CHECK(x == vec2(0.3, -2.0));
  }
}

TEST_CASE("Small problems allocate nothing") {
  if (!test::counts_allocations()) return;
  const auto data = curve(2.0, -0.7, 0.01, 5);
  const optimize::pose_prior prior;
  vec2 x(1.0, 0.0);
  se3 pose = se3::exp((vec6() << 1, 2, 3, 0.1, 0.2, 0.3).finished());
  const std::size_t before = test::allocations();
  const bool fitted = minimize(optimize::euclidean<2>{}, x, data, {}, optimize::huber{0.1}).ok();
  const bool moved = minimize(optimize::lie_group<se3>{}, pose, prior).ok();
  const std::size_t after = test::allocations();
  CHECK((fitted && moved));
  CHECK(after == before);
}
