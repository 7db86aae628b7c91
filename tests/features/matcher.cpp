// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <vector>

#include <orbis/core/random.hpp>
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

/// Copies in another order, each with up to `flips` bits flipped.
std::vector<descriptor> disturbed(const std::vector<descriptor>& from, int flips, std::uint64_t seed) {
  random_bits random{seed};
  std::vector<descriptor> to = from;
  std::reverse(to.begin(), to.end());
  for (descriptor& d : to)
    for (int i = 0; i != flips; ++i) d.words[random.below(4)] ^= std::uint64_t{1} << random.below(64);
  return to;
}

}  // namespace

TEST_CASE("the documented chain is a constant and finds disturbed copies") {
  constexpr auto matcher = brute_force(hamming{}) | ratio_test{0.7f} | cross_check{} | max_distance{50};
  const auto a = random_descriptors(301, 1);
  const auto b = disturbed(a, 20, 2);
  const std::vector<match> matches = matcher(a, b);
  REQUIRE(matches.size() == a.size());
  for (std::size_t i = 0; i != matches.size(); ++i) {
    CHECK(matches[i].query == i);
    CHECK(matches[i].train == a.size() - 1 - i);
    CHECK(matches[i].distance == hamming{}(a[i], b[a.size() - 1 - i]));
  }
}
