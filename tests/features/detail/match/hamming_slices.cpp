// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/detail/match/hamming_slices.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features::detail;

namespace {

using string = bit_words<256>;

/// The distances of a query to all trains of a block, those below the limit, and the smallest one of a rank.
struct sliced {
  std::vector<std::uint32_t> distances;
  std::vector<bool> below, lower;
  std::uint32_t ranked = 0;
  friend bool operator==(const sliced&, const sliced&) = default;
};
struct slice_kernel {
  template <class Target>
  static ORBIS_ALWAYS_INLINE void run(const string& query, std::span<const string> trains, std::uint32_t limit,
                                      std::size_t rank, sliced& out) {
    constexpr std::size_t words = slice_words<Target>;
    const auto table = std::make_unique<slice_table<words>>();
    make_slice_table<Target>(trains, *table);
    slice_query selected{};
    make_slice_query<Target>(query, selected);
    slice_distances<words> distances{}, least{};
    slice<words> below{}, again{}, lower{}, valid{};
    slice_count<Target>(*table, selected, limit, distances, below);
    slice_below<Target>(distances, limit, again);
    for (auto& plane : least) plane.words.fill(~std::uint64_t{0});
    slice_lower<Target>(distances, least, lower);
    for (std::size_t t = 0; t != trains.size(); ++t) {
      const auto bit = [t](const slice<words>& s) { return (s.words[t / 64] >> (t % 64) & 1U) != 0; };
      valid.words[t / 64] |= std::uint64_t{1} << (t % 64);
      std::uint32_t distance = 0, kept = 0;
      for (std::size_t i = 0; i != slice_planes; ++i) {
        distance |= bit(distances[i]) ? 1U << i : 0U;
        kept |= bit(least[i]) ? 1U << i : 0U;
      }
      CHECK(kept == distance);
      CHECK(bit(below) == bit(again));
      out.distances.push_back(distance);
      out.below.push_back(bit(below));
      out.lower.push_back(bit(lower));
    }
    out.ranked = slice_ranked<Target>(distances, valid, rank);
  }
};

}  // namespace

TEST_CASE("transposing a matrix of bits swaps rows and columns") {
  random_bits random{1};
  std::array<std::uint64_t, 64> m{};
  for (auto& row : m) row = random();
  auto t = m;
  transpose_bits(t);
  for (std::size_t i = 0; i != 64; ++i)
    for (std::size_t j = 0; j != 64; ++j) REQUIRE((t[j] >> i & 1U) == (m[i] >> j & 1U));
}

TEST_CASE("sliced distances are those of the definition, at every level") {
  random_bits random{2};
  std::vector<string> trains(250);
  for (string& t : trains)
    for (auto& word : t) word = random();
  const string query = trains[17];
  for (auto& word : trains[18]) word = ~word;
  for (std::size_t w = 0; w != 4; ++w) trains[19][w] = ~query[w];
  sliced expected;
  for (const string& t : trains) {
    expected.distances.push_back(hamming_distance(query, t));
    expected.below.push_back(expected.distances.back() < 125);
    expected.lower.push_back(true);
  }
  auto sorted = expected.distances;
  std::sort(sorted.begin(), sorted.end());
  expected.ranked = sorted[9];
  for (const auto level : simd::available_levels()) {
    const simd::level_limit limit{level};
    using signature = void(const string&, std::span<const string>, std::uint32_t, std::size_t, sliced&);
    sliced found;
    simd::kernel<slice_kernel, signature, simd::popcnt, simd::avx2, simd::avx512>()(query, trains, 125, 10, found);
    CHECK(found == expected);
  }
}
