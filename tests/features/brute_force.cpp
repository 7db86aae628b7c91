// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/core/simd/level.hpp>
#include <orbis/features/brute_force-inl.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

using descriptor = binary_descriptor<256>;
using test::random_descriptors;

}  // namespace

TEST_CASE("nothing matches where either side is empty") {
  constexpr auto matcher = brute_force(hamming{}) | ratio_test{0.7f} | cross_check{} | max_distance{256};
  const auto a = random_descriptors(5, 1);
  const std::vector<descriptor> empty;
  CHECK(matcher(a, empty).empty());
  CHECK(matcher(empty, a).empty());
  CHECK(matcher(empty, empty).empty());
}

TEST_CASE("a tie goes to the lowest train and fails the ratio test") {
  const auto one = random_descriptors(1, 9);
  const std::vector<descriptor> t{one[0], one[0], one[0]};
  const auto nearest = (brute_force(hamming{}) | max_distance{0})(one, t);
  REQUIRE(nearest.size() == 1);
  CHECK(nearest[0] == match{0, 0, 0});
  CHECK((brute_force(hamming{}) | ratio_test{1.0f})(one, t).empty());
}

TEST_CASE("brute force finds what a look at all pairs finds, at every level") {
  const simd::level_limit limit{GENERATE(from_range(simd::available_levels()))};
  const auto q = test::random_features(90, 1), t = test::random_features(150, 2);
  const auto expected = test::naive_candidates(q, t, [](std::uint32_t, std::uint32_t) { return true; });
  CHECK(test::candidates_of(brute_force(hamming{}), as_view(q), as_view(t), {.reverse = true}) == expected);
}
