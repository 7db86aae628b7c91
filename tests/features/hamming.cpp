// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/features/brute_force-inl.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>

#include "features/sources.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

/// As many bits as ORB's, of somebody else's type.
struct foreign_bits {
  std::uint64_t a, b, c, d;
};

}  // namespace

TEST_CASE("the Hamming distance is the number of bits that differ") {
  const auto f = test::random_features(20, 3);
  for (const auto& a : f.descriptors)
    for (const auto& b : f.descriptors) {
      std::uint32_t expected = 0;
      for (std::size_t i = 0; i != 256; ++i) expected += a.bit(i) != b.bit(i) ? 1 : 0;
      CHECK(hamming{}(a, b) == expected);
    }
}

TEST_CASE("the Hamming kernels take bit strings of any type") {
  const auto f = test::random_features(90, 1), g = test::random_features(150, 2);
  const auto foreign = [](const std::vector<binary_descriptor<256>>& all) {
    std::vector<foreign_bits> bits;
    for (const auto& d : all) bits.push_back({d.words[0], d.words[1], d.words[2], d.words[3]});
    return bits;
  };
  const auto matcher = brute_force(hamming{}) | cross_check{};
  CHECK(matcher(foreign(f.descriptors), foreign(g.descriptors)) == matcher(f.descriptors, g.descriptors));
}
