// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include <octomap/octomap.h>

#include <orbis/core/random.hpp>
#include <orbis/octree/sensor_model.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;

namespace {

using thousandths = log_odds<std::int16_t>;
using coarse = log_odds<std::int8_t>;

struct cautious : octomap_probabilities {
  static constexpr double hit = 0.55, miss = 0.48, clamp_min = 0.01, clamp_max = 0.99, occupancy_threshold = 0.65;
};
struct thrifty : octomap_probabilities {
  static constexpr double scale = 6.0;
};
/// One unit from the end of the type at both bounds.
struct edge : log_odds<std::int8_t> {
  static constexpr std::int8_t hit = 7, miss = -28, clamp_min = -100, clamp_max = 120;
};

}  // namespace

static_assert(sensor_model<log_odds<>> && sensor_model<log_odds<double>>);
static_assert(sensor_model<thousandths> && sensor_model<coarse> && sensor_model<edge>);
static_assert(sensor_model<sensor_model_from<cautious>> && sensor_model<sensor_model_from<cautious, std::int32_t>>);
static_assert(after_miss<coarse>(after_hit<coarse>(0)) == 12);

TEST_CASE("The default sensor model has OctoMap's constants to the last bit") {
  const octomap::OcTree tree{0.1};
  CHECK(log_odds<>::hit == tree.getProbHitLog());
  CHECK(log_odds<>::miss == tree.getProbMissLog());
  CHECK(log_odds<>::clamp_min == tree.getClampingThresMinLog());
  CHECK(log_odds<>::clamp_max == tree.getClampingThresMaxLog());
  CHECK(log_odds<>::occupancy_threshold == tree.getOccupancyThresLog());
}

TEST_CASE("Any sequence of observations gives the log-odds that OctoMap gives") {
  orbis::random_bits random{1};
  for (int run = 0; run != 50; ++run) {
    octomap::OcTree tree{0.1};
    const octomap::OcTreeKey key{32768, 32768, 32768};
    float value = 0.0F;
    for (int i = 0; i != 60; ++i) {
      const bool hit = random.below(3) == 0;
      value = hit ? after_hit<log_odds<>>(value) : after_miss<log_odds<>>(value);
      tree.updateNode(key, hit);
      REQUIRE(value == tree.search(key)->getLogOdds());
      REQUIRE(is_occupied<log_odds<>>(value) == tree.isNodeOccupied(tree.search(key)));
    }
  }
}

TEST_CASE("A value beyond its bound stays until an observation pulls it back") {
  CHECK(after_hit<log_odds<>>(5.0F) == 5.0F);
  CHECK(after_miss<log_odds<>>(5.0F) == log_odds<>::clamp_max);
  CHECK(after_miss<log_odds<>>(-5.0F) == -5.0F);
  CHECK(after_hit<log_odds<>>(-5.0F) == log_odds<>::clamp_min);
}

TEMPLATE_TEST_CASE("Integer beliefs follow the same rule for every value of their type", "", thousandths, coarse, edge,
                   (sensor_model_from<cautious, std::int16_t>), (sensor_model_from<thrifty, std::int8_t>)) {
  using M = TestType;
  using T = typename M::value_type;
  for (long v = std::numeric_limits<T>::min(); v <= std::numeric_limits<T>::max(); ++v) {
    const long low = M::clamp_min, high = M::clamp_max;
    const long hit = v >= high ? v : std::clamp(v + M::hit, low, high);
    const long miss = v <= low ? v : std::clamp(v + M::miss, low, high);
    REQUIRE(after_hit<M>(static_cast<T>(v)) == hit);
    REQUIRE(after_miss<M>(static_cast<T>(v)) == miss);
    REQUIRE(is_occupied<M>(static_cast<T>(v)) == (v >= M::occupancy_threshold));
  }
}

TEMPLATE_TEST_CASE("Integer beliefs stay as close to the exact ones as their steps allow", "", thousandths, coarse) {
  using M = TestType;
  using F = log_odds<double>;
  const double step = std::max(std::abs(to_log_odds<M>(M::hit) - F::hit), std::abs(to_log_odds<M>(M::miss) - F::miss));
  const double bound = std::max(std::abs(to_log_odds<M>(M::clamp_min) - F::clamp_min),
                                std::abs(to_log_odds<M>(M::clamp_max) - F::clamp_max));
  CHECK(step < 0.0006);
  CHECK(bound < 0.01);
  orbis::random_bits random{5};
  for (int run = 0; run != 200; ++run) {
    typename M::value_type ours = 0;
    double exact = 0, allowed = 1e-9;
    const std::uint32_t one_in = 2 + random.below(4);
    for (int i = 0; i != 100; ++i) {
      const bool hit = random.below(one_in) == 0;
      ours = hit ? after_hit<M>(ours) : after_miss<M>(ours);
      exact = hit ? after_hit<F>(exact) : after_miss<F>(exact);
      allowed = std::max(allowed + step, bound + 1e-9);
      REQUIRE(std::abs(to_log_odds<M>(ours) - exact) <= allowed);
    }
  }
}

TEST_CASE("Probability and log-odds are each other's inverse") {
  for (double p = 0.01; p < 1.0; p += 0.01) {
    CHECK(probability_of(static_cast<double>(log_odds_of(p))) == Approx(p).epsilon(1e-6));
    CHECK(probability_of<log_odds<>>(log_odds_of(p)) == Approx(p).epsilon(1e-6));
  }
  CHECK(log_odds_of(0.5) == 0.0F);
  CHECK(probability_of<thousandths>(thousandths::hit) == Approx(0.7).epsilon(1e-4));
  CHECK(probability_of<coarse>(coarse::clamp_min) == Approx(0.1202).epsilon(1e-3));
  CHECK(probability_of<coarse>(coarse::clamp_max) == Approx(0.9707).epsilon(1e-3));
}

TEST_CASE("The compiler works out the log-odds of a probability that the running program does") {
  constexpr float compiled[] = {log_odds_of(0.7),  log_odds_of(0.4),   log_odds_of(0.1192), log_odds_of(0.971),
                                log_odds_of(0.5),  log_odds_of(0.001), log_odds_of(0.49),   log_odds_of(0.51),
                                log_odds_of(0.97), log_odds_of(0.12),  log_odds_of(0.85),   log_odds_of(0.9999)};
  const double probabilities[] = {0.7, 0.4, 0.1192, 0.971, 0.5, 0.001, 0.49, 0.51, 0.97, 0.12, 0.85, 0.9999};
  for (std::size_t i = 0; i != std::size(compiled); ++i) {
    volatile double p = probabilities[i];  // keeps the compiler from working this one out too
    CHECK(compiled[i] == log_odds_of(p));
  }
}

TEMPLATE_TEST_CASE("The model of OctoMap's probabilities is the default model in every type", "", float, std::int16_t,
                   std::int8_t) {
  using from = sensor_model_from<octomap_probabilities, TestType>;
  using written = log_odds<TestType>;
  CHECK(from::hit == written::hit);
  CHECK(from::miss == written::miss);
  CHECK(from::clamp_min == written::clamp_min);
  CHECK(from::clamp_max == written::clamp_max);
  CHECK(from::occupancy_threshold == written::occupancy_threshold);
  CHECK(units_per_log_odds<from> == units_per_log_odds<written>);
}

TEST_CASE("A model from probabilities has their log-odds to the nearest unit") {
  using M = sensor_model_from<cautious, std::int16_t>;
  CHECK(M::hit == std::lround(1000.0 * std::log(0.55 / 0.45)));
  CHECK(M::miss == std::lround(1000.0 * std::log(0.48 / 0.52)));
  CHECK(M::clamp_min == std::lround(1000.0 * std::log(0.01 / 0.99)));
  CHECK(M::clamp_max == std::lround(1000.0 * std::log(0.99 / 0.01)));
  CHECK(M::occupancy_threshold == std::lround(1000.0 * std::log(0.65 / 0.35)));
  CHECK(sensor_model_from<thrifty, std::int8_t>::hit == 5);
  CHECK(sensor_model_from<thrifty, std::int8_t>::clamp_max == 21);
  CHECK_FALSE(sensor_model<sensor_model_from<cautious, std::int8_t>>);  // its bounds need a smaller scale
}

TEMPLATE_TEST_CASE("Log-odds become the nearest value within the bounds and keep their state", "", thousandths, coarse,
                   (sensor_model_from<cautious, std::int16_t>), log_odds<>, sensor_model_from<cautious>) {
  using M = TestType;
  const auto low = static_cast<double>(M::clamp_min), high = static_cast<double>(M::clamp_max);
  const auto threshold = static_cast<double>(M::occupancy_threshold);
  constexpr bool whole = std::integral<typename M::value_type>;
  orbis::random_bits random{9};
  for (int i = 0; i != 20000; ++i) {
    const double units =
        i % 2 == 0 ? random.uniform(2 * low, 2 * high) : threshold + random.normal() * (whole ? 1.0 : 1e-9);
    const auto v = from_log_odds<M>(units / units_per_log_odds<M>);
    const double asked = units / units_per_log_odds<M> * units_per_log_odds<M>;
    REQUIRE(M::clamp_min <= v);
    REQUIRE(v <= M::clamp_max);
    REQUIRE(is_occupied<M>(v) == (asked >= threshold));
    const double error = std::abs(static_cast<double>(v) - std::clamp(asked, low, high));
    if (asked >= threshold || asked <= threshold - 1) REQUIRE(error <= (whole ? 0.5 : 1e-7 * std::abs(asked)));
    REQUIRE(error <= (whole ? 1.0 : 1e-6));
  }
  CHECK(from_log_odds<M>(std::numeric_limits<double>::infinity()) == M::clamp_max);
  CHECK(from_log_odds<M>(-std::numeric_limits<double>::infinity()) == M::clamp_min);
  CHECK_FALSE(is_occupied<M>(largest_free_value<M>()));
  const auto next = static_cast<typename M::value_type>(
      whole ? largest_free_value<M>() + 1 : std::nextafter(static_cast<float>(largest_free_value<M>()), 1e9F));
  CHECK(is_occupied<M>(next));
}

TEST_CASE("Values go from integers to floats and back unchanged") {
  for (int v = thousandths::clamp_min; v <= thousandths::clamp_max; ++v) {
    const auto value = static_cast<std::int16_t>(v);
    REQUIRE(convert_value<log_odds<>, thousandths>(convert_value<thousandths, log_odds<>>(value)) == value);
  }
  for (int v = coarse::clamp_min; v <= coarse::clamp_max; ++v) {
    const auto value = static_cast<std::int8_t>(v);
    REQUIRE(convert_value<log_odds<>, coarse>(convert_value<coarse, log_odds<>>(value)) == value);
    REQUIRE(convert_value<thousandths, coarse>(convert_value<coarse, thousandths>(value)) == value);
  }
  CHECK(convert_value<log_odds<>, log_odds<>>(0.1F) == 0.1F);
  CHECK(convert_value<log_odds<>, coarse>(-0.001F) == -1);
  CHECK(convert_value<log_odds<>, coarse>(0.001F) == 0);
}
