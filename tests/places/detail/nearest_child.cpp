// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <vector>

#include <orbis/places/detail/nearest_child.hpp>

#include "places/images.hpp"
#include "support/catch.hpp"

using namespace orbis;

namespace {

template <std::size_t Bits>
void check_assignment(std::uint64_t seed) {
  random_bits random{seed};
  for (const std::uint32_t centre_count : {1U, 2U, 10U, 33U}) {
    test::descriptors<Bits> centres(centre_count), descriptors(100);
    for (auto& c : centres) c = test::random_descriptor<Bits>(random);
    if (centre_count > 2) centres[2] = centres[1];  // the first of equals
    for (auto& d : descriptors) d = test::noisy(centres[random.below(centre_count)], 20, random);
    std::vector<std::uint16_t> expected;
    for (const auto& d : descriptors) {
      std::uint16_t best = 0;
      for (std::uint16_t c = 1; c != centre_count; ++c)
        if (hamming_distance(d, centres[c]) < hamming_distance(d, centres[best])) best = c;
      expected.push_back(best);
    }
    for (const simd::level l : simd::available_levels()) {
      const simd::level_limit limit{l};
      std::vector<std::uint16_t> nearest(descriptors.size() + 1, 999);
      places::detail::assign_nearest<Bits>({.centres = centres.data(),
                                            .centre_count = centre_count,
                                            .descriptors = descriptors.data(),
                                            .count = descriptors.size(),
                                            .nearest = nearest.data()});
      CHECK(nearest.back() == 999);
      nearest.pop_back();
      CHECK(nearest == expected);
    }
  }
}

}  // namespace

TEST_CASE("descriptors of any length are given to the nearest centre, the first of equals, at every level") {
  check_assignment<64>(1);
  check_assignment<128>(2);
  check_assignment<256>(3);
  check_assignment<512>(4);
}
