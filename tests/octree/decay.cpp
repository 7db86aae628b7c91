// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/decay.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;

namespace {

struct low_threshold : log_odds<> {
  static constexpr float occupancy_threshold = -0.5F;
};
struct high_threshold : log_odds<std::int16_t> {
  static constexpr std::int16_t occupancy_threshold = 850;
};

/// Values of a model: all of a narrow integer's, else many, those at the edges among them.
template <class M>
std::vector<typename M::value_type> values() {
  using T = typename M::value_type;
  std::vector<T> all;
  if constexpr (std::integral<T>) {
    for (int v = M::clamp_min; v <= M::clamp_max; ++v) all.push_back(static_cast<T>(v));
    all.push_back(std::numeric_limits<T>::min());
    all.push_back(std::numeric_limits<T>::max());
  } else {
    orbis::random_bits random{8};
    all = {M::clamp_min,
           M::clamp_max,
           M::occupancy_threshold,
           largest_free_value<M>(),
           T{0},
           -T{0},
           T{10},
           T{-10},
           std::numeric_limits<T>::denorm_min(),
           -std::numeric_limits<T>::denorm_min()};
    for (int i = 0; i != 2000; ++i) all.push_back(static_cast<T>(random.uniform(M::clamp_min, M::clamp_max)));
    for (int i = 0; i != 2000; ++i) all.push_back(static_cast<T>(random.normal() * std::exp(random.uniform(-99, 0))));
  }
  return all;
}

/// Holds for every policy and every value: towards rest, not beyond it, and never across the threshold.
template <class M, class Policy>
void check_towards_rest(const Policy& policy) {
  for (const auto v : values<M>()) {
    const auto later = policy(v), rest = resting_value<M>(v);
    REQUIRE(is_occupied<M>(later) == is_occupied<M>(v));
    REQUIRE(is_occupied<M>(rest) == is_occupied<M>(v));
    if (v >= rest) REQUIRE((rest <= later && later <= v));
    if (v <= rest) REQUIRE((v <= later && later <= rest));
    REQUIRE(policy(v) == later);
  }
}

}  // namespace

TEMPLATE_TEST_CASE("Decay goes towards rest and never turns free into occupied or back", "", log_odds<>,
                   log_odds<double>, log_odds<std::int16_t>, log_odds<std::int8_t>, low_threshold, high_threshold) {
  using M = TestType;
  constexpr double forever = std::numeric_limits<double>::infinity();
  for (const double elapsed : {0.0, 1e-9, 0.033, 1.0, 60.0, 1e6, forever}) {
    check_towards_rest<M>(exponential_decay<M>{.half_life = 30.0, .elapsed = elapsed});
    check_towards_rest<M>(linear_decay<M>{.rate = 0.02, .elapsed = elapsed});
    check_towards_rest<M>(occupied_only{exponential_decay<M>{.half_life = 0.5, .elapsed = elapsed}});
  }
  for (const auto v : values<M>()) {
    REQUIRE(exponential_decay<M>{.half_life = 5.0, .elapsed = forever}(v) == resting_value<M>(v));
    REQUIRE(linear_decay<M>{.rate = 0.1, .elapsed = forever}(v) == resting_value<M>(v));
    REQUIRE(exponential_decay<M>{.half_life = 5.0, .elapsed = 0.0}(v) == v);
    REQUIRE(linear_decay<M>{.rate = 0.1, .elapsed = 0.0}(v) == v);
  }
}

TEST_CASE("Log-odds halve in a half-life and fall by the rate in a second") {
  for (const float v : values<log_odds<>>()) {
    if (std::abs(v) < 1e-30F) continue;
    REQUIRE(exponential_decay<>{.half_life = 7.0, .elapsed = 7.0}(v) == v / 2);
    REQUIRE(exponential_decay<>{.half_life = 7.0, .elapsed = 21.0}(v) == v / 8);
    const float fallen = linear_decay<>{.rate = 0.25, .elapsed = 2.0}(v);
    REQUIRE(fallen == Approx(std::copysign(std::max(std::abs(v) - 0.5F, 0.0F), v)).margin(1e-7));
  }
  CHECK(exponential_decay<log_odds<std::int16_t>>{.half_life = 1.0, .elapsed = 1.0}(3511) == 1755);
  CHECK(exponential_decay<log_odds<std::int16_t>>{.half_life = 1.0, .elapsed = 1.0}(-2001) == -1001);  // rest: -1
  CHECK(linear_decay<log_odds<std::int16_t>>{.rate = 0.1, .elapsed = 2.0}(3511) == 3311);
  CHECK(linear_decay<log_odds<std::int8_t>>{.rate = 1.0, .elapsed = 1.0}(95) == 67);  // 95 - 27.13, towards rest
}

TEST_CASE("Two steps of decay are one of the time of both") {
  orbis::random_bits random{12};
  for (const float v : values<log_odds<>>()) {
    if (std::abs(v) < 1e-20F) continue;
    const double a = random.uniform(0.0, 40.0), b = random.uniform(0.0, 40.0);
    const float twice =
        exponential_decay<>{.half_life = 15.0, .elapsed = b}(exponential_decay<>{.half_life = 15.0, .elapsed = a}(v));
    REQUIRE(twice == Approx(exponential_decay<>{.half_life = 15.0, .elapsed = a + b}(v)).epsilon(3e-7));
  }
}

TEMPLATE_TEST_CASE("No integer value is ever stuck and none goes more than a unit too far", "", log_odds<std::int16_t>,
                   log_odds<std::int8_t>, high_threshold) {
  using M = TestType;
  for (const double elapsed : {1e-3, 0.1, 3.0, 50.0}) {
    const exponential_decay<M> fade{.half_life = 30.0, .elapsed = elapsed};
    const linear_decay<M> fall{.rate = 0.02, .elapsed = elapsed};
    for (const auto v : values<M>()) {
      const double rest = resting_value<M>(v), distance = v - rest;
      if (distance != 0) {
        REQUIRE(std::abs(fade(v) - rest) < std::abs(distance));
        REQUIRE(std::abs(fall(v) - rest) < std::abs(distance));
      }
      const double exact = rest + distance * std::exp2(-elapsed / 30.0);
      REQUIRE(std::abs(fade(v) - exact) <= 1.0 + 1e-9);
      const double step = std::min(std::abs(distance), 0.02 * elapsed * units_per_log_odds<M>);
      REQUIRE(std::abs(fall(v) - (v - std::copysign(step, distance))) <= 1.0 + 1e-9);
    }
  }
}

TEST_CASE("Free voxels keep their value where only occupied ones decay") {
  const occupied_only ghosts{exponential_decay<>{.half_life = 10.0, .elapsed = 10.0}};
  const occupied_only forgetful{forget_below{exponential_decay<>{.half_life = 10.0, .elapsed = 10.0}, 0.5}};
  static_assert(decay_policy<decltype(ghosts), log_odds<>> && decay_policy<decltype(forgetful), log_odds<>>);
  for (const float v : values<log_odds<>>()) {
    REQUIRE(ghosts(v) == (v < 0 ? v : ghosts.policy(v)));
    const std::optional<float> kept = forgetful(v);
    if (v < 0)
      REQUIRE(kept == v);
    else
      REQUIRE(kept == (v / 2 <= 0.5F ? std::nullopt : std::optional{ghosts.policy(v)}));
  }
}

TEMPLATE_TEST_CASE("A belief near rest is forgotten and every belief is in the end", "", log_odds<>,
                   log_odds<std::int16_t>, log_odds<std::int8_t>, low_threshold, high_threshold) {
  using M = TestType;
  const forget_below forgetting{exponential_decay<M>{.half_life = 30.0, .elapsed = 10.0}, 0.1};
  for (const auto v : values<M>()) {
    std::optional<typename M::value_type> value = v;
    int steps = 0;
    for (; value && steps != 1000; ++steps) {
      const auto later = forgetting.policy(*value);
      const double distance = to_log_odds<M>(later) - to_log_odds<M>(resting_value<M>(later));
      value = decayed<M>(forgetting, *value);
      REQUIRE(value.has_value() == (std::abs(distance) > 0.1));
      if (value) REQUIRE(*value == later);
    }
    REQUIRE(steps < 40);
  }
}

TEST_CASE("A function is a decay policy too") {
  const auto halve = [](float v) { return v / 2; };
  const auto forget = [](float) { return std::optional<float>{}; };
  static_assert(decay_policy<decltype(halve), log_odds<>> && decay_policy<decltype(forget), log_odds<>>);
  static_assert(!decay_policy<int, log_odds<>>);
  CHECK(decayed<log_odds<>>(halve, 3.0F) == 1.5F);
  CHECK(decayed<log_odds<>>(forget, 3.0F) == std::nullopt);
}
