// SPDX-License-Identifier: BSD-3-Clause
#include <cmath>
#include <limits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/octree/decay.hpp>

#include "support/catch.hpp"

using namespace orbis::octree;

namespace {

struct low_threshold : log_odds<> {
  static constexpr float occupancy_threshold = -0.5F;
};
struct high_threshold : log_odds<> {
  static constexpr float occupancy_threshold = 0.85F;
};

/// Many values of a model, those at the edges among them.
template <class M>
std::vector<typename M::value_type> values() {
  using T = typename M::value_type;
  orbis::random_bits random{8};
  std::vector<T> all{M::clamp_min,
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
  return all;
}

/// Holds for every value: towards rest, not beyond it, and never across the threshold.
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
                   log_odds<double>, low_threshold, high_threshold) {
  using M = TestType;
  constexpr double forever = std::numeric_limits<double>::infinity();
  for (const double elapsed : {0.0, 1e-9, 0.033, 1.0, 60.0, 1e6, forever}) {
    check_towards_rest<M>(exponential_decay<M>{.half_life = 30.0, .elapsed = elapsed});
  }
  for (const auto v : values<M>()) {
    REQUIRE(exponential_decay<M>{.half_life = 5.0, .elapsed = forever}(v) == resting_value<M>(v));
    REQUIRE(exponential_decay<M>{.half_life = 5.0, .elapsed = 0.0}(v) == v);
  }
}

TEST_CASE("Log-odds halve in a half-life") {
  for (const float v : values<log_odds<>>()) {
    if (std::abs(v) < 1e-30F) continue;
    REQUIRE(exponential_decay<>{.half_life = 7.0, .elapsed = 7.0}(v) == v / 2);
    REQUIRE(exponential_decay<>{.half_life = 7.0, .elapsed = 21.0}(v) == v / 8);
  }
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
