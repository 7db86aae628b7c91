// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/places/detail/k_majority.hpp>

#include "places/images.hpp"
#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::places;
using orbis::places::detail::k_majority;

TEST_CASE("each descriptor is with the nearest centre, the first of equals, and each centre has some") {
  const auto image = test::make_images(1, 900, 3, 50, 20)[0];
  const auto clusters = GENERATE(1U, 2U, 10U, 100U);
  const auto part = k_majority<256>(seq, std::span{image}, {.clusters = clusters});
  CHECK(part.centres.size() <= clusters);
  CHECK(part.centres.size() * 2 >= clusters);
  std::set<std::uint16_t> used;
  std::uint64_t cost = 0, single = 0;
  for (std::size_t i = 0; i != image.size(); ++i) {
    std::uint32_t least = ~0U;
    std::size_t nearest = 0;
    for (std::size_t c = 0; c != part.centres.size(); ++c)
      if (const auto d = hamming_distance(image[i], part.centres[c]); d < least) {
        least = d;
        nearest = c;
      }
    CHECK(part.cluster_of[i] == nearest);
    used.insert(part.cluster_of[i]);
    cost += least;
    single += hamming_distance(image[i], image[0]);
  }
  CHECK(used.size() == part.centres.size());
  if (clusters == 100) CHECK(cost * 2 < single);  // things that look alike are together
}

TEST_CASE("clusters are the same for every policy and level") {
  const auto image = test::make_images(1, 70000, 3, 500, 20)[0];
  const auto expected = k_majority<256>(seq, std::span{image}, {.max_iterations = 3});
  for (const unsigned threads : {2U, 5U}) {
    const simd::level_limit limit{simd::level::portable};
    const auto part = k_majority<256>(par.with(threads), std::span{image}, {.max_iterations = 3});
    CHECK(part.centres == expected.centres);
    CHECK(part.cluster_of == expected.cluster_of);
  }
}

TEST_CASE("fewer different descriptors than clusters are a cluster each") {
  random_bits random{1};
  test::descriptors<> image;
  for (int i = 0; i != 4; ++i) image.push_back(test::random_descriptor(random));
  for (int i = 0; i != 40; ++i) image.push_back(image[random.below(4)]);
  const auto part = k_majority<256>(seq, std::span{image}, {.clusters = 9});
  CHECK(part.centres.size() == 4);
  for (std::size_t i = 0; i != image.size(); ++i) CHECK(part.centres[part.cluster_of[i]] == image[i]);
  CHECK(k_majority<256>(seq, std::span<const bit_words<256>>{}, {}).centres.empty());
}

TEST_CASE("votes are counted bit by bit, beyond where a byte runs over, and ties go as they should") {
  random_bits random{1};
  const auto count = GENERATE(0, 1, 2, 255, 256, 1000);
  std::vector<int> ones(128);
  places::detail::bit_votes<128> votes, first_half;
  for (int i = 0; i != count; ++i) {
    const bit_words<128> d{random() & random(), random() | random()};
    (i % 2 == 0 ? first_half : votes).add(d);
    for (std::size_t b = 0; b != 128; ++b) ones[b] += static_cast<int>((d[b / 64] >> (b % 64)) & 1U);
  }
  votes.add(first_half);
  CHECK(votes.total() == static_cast<std::uint64_t>(count));
  const bit_words<128> tie{0x5555555555555555ULL, 0x0f0f0f0f0f0f0f0fULL};
  const auto majority = votes.majority(tie);
  for (std::size_t b = 0; b != 128; ++b) {
    const bool expected = 2 * ones[b] == count ? ((tie[b / 64] >> (b % 64)) & 1U) != 0 : 2 * ones[b] > count;
    CHECK((((majority[b / 64] >> (b % 64)) & 1U) != 0) == expected);
  }
}
