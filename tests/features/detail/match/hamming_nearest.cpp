// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/detail/match/hamming_nearest.hpp>
#include <orbis/features/hamming.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;
using namespace orbis::features::detail;

namespace {

using descriptor = binary_descriptor<256>;

/// `variety` bits of every descriptor are random; few of them make many ties.
std::vector<descriptor> random_descriptors(std::size_t count, std::uint64_t seed, int variety) {
  random_bits random{seed};
  std::vector<descriptor> descriptors(count);
  for (descriptor& d : descriptors)
    for (int i = 0; i != variety; ++i) {
      const std::size_t bit = variety == 256 ? static_cast<std::size_t>(i) : random.below(256);
      if (random() & 1U) d.words[bit / 64] |= std::uint64_t{1} << (bit % 64);
    }
  return descriptors;
}

std::uint32_t naive_distance(const descriptor& a, const descriptor& b) {
  std::uint32_t sum = 0;
  for (std::size_t i = 0; i != 256; ++i) sum += a.bit(i) != b.bit(i) ? 1 : 0;
  return sum;
}

struct answer {
  std::vector<nearest_two> nearest;
  std::vector<std::uint32_t> reverse;
  friend bool operator==(const answer&, const answer&) = default;
};

/// Sorting all distances, stably: no shared idea with the kernels.
answer naive(const std::vector<descriptor>& queries, const std::vector<descriptor>& trains) {
  std::vector<std::vector<std::uint32_t>> distances(queries.size(), std::vector<std::uint32_t>(trains.size()));
  for (std::size_t q = 0; q != queries.size(); ++q)
    for (std::size_t t = 0; t != trains.size(); ++t) distances[q][t] = naive_distance(queries[q], trains[t]);
  answer a;
  for (const auto& row : distances) {
    nearest_two n;
    if (!row.empty()) {
      const auto best = std::min_element(row.begin(), row.end());
      n.index = static_cast<std::uint32_t>(best - row.begin());
      n.distance = *best;
      auto rest = row;
      rest.erase(rest.begin() + n.index);
      if (!rest.empty()) n.second_distance = *std::min_element(rest.begin(), rest.end());
    }
    a.nearest.push_back(n);
  }
  for (std::size_t t = 0; t != trains.size() && !queries.empty(); ++t) {
    std::size_t best = 0;
    for (std::size_t q = 1; q != queries.size(); ++q)
      if (distances[q][t] < distances[best][t]) best = q;
    a.reverse.push_back(static_cast<std::uint32_t>(best));
  }
  return a;
}

template <class Kernel>
answer run(Kernel&& kernel, const std::vector<descriptor>& queries, const std::vector<descriptor>& trains,
           bool reverse) {
  answer a;
  a.nearest.resize(queries.size());
  if (reverse && !queries.empty()) a.reverse.resize(trains.size());
  kernel(std::span<const descriptor>{queries}, std::span<const descriptor>{trains}, std::span{a.nearest},
         std::span{a.reverse});
  return a;
}

}  // namespace

TEST_CASE("the Hamming distance counts differing bits") {
  const auto a = random_descriptors(50, 1, 256);
  for (const descriptor& x : a)
    for (const descriptor& y : a) REQUIRE(hamming{}(x, y) == naive_distance(x, y));
  binary_descriptor<512> all;
  all.words.fill(~std::uint64_t{0});
  CHECK(hamming{}(all, binary_descriptor<512>{}) == 512);
}

TEST_CASE("every SIMD level finds the two nearest and the reverse nearest of the definition") {
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  const int variety = GENERATE(256, 12, 2);  // 2: nearly everything is a tie
  // Few are compared pair by pair, more in blocks of 256 or 512 trains.
  for (const std::size_t queries : {0U, 1U, 3U, 15U, 16U, 40U})
    for (const std::size_t trains : {0U, 1U, 2U, 63U, 64U, 65U, 255U, 256U, 257U, 511U, 512U, 513U, 1030U}) {
      INFO("level " << static_cast<int>(level) << ", " << queries << " x " << trains);
      const auto q = random_descriptors(queries, 10 + queries, variety);
      const auto t = random_descriptors(trains, 1000 + trains, variety);
      answer expected = naive(q, t);
      hamming_workspace memory;
      const auto kernel = [&](auto... spans) { hamming_nearest(spans..., memory); };
      REQUIRE(run(kernel, q, t, true) == expected);
      expected.reverse.clear();
      REQUIRE(run(kernel, q, t, false) == expected);
    }
}

TEST_CASE("queries whose nearest lie at very different distances do not mislead each other") {
  // Groups of queries with near and with far trains in turn: the first block's limit is guessed from the last query.
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  const auto t = random_descriptors(400, 77, 256);
  auto q = random_descriptors(90, 78, 256);
  for (std::size_t i = 0; i < q.size(); i += 3) q[i] = t[(i * 37) % t.size()];
  for (std::size_t i = 1; i < q.size(); i += 3)
    for (std::size_t w = 0; w != 4; ++w) q[i].words[w] = ~t[i].words[w];
  hamming_workspace memory;
  CHECK(run([&](auto... spans) { hamming_nearest(spans..., memory); }, q, t, true) == naive(q, t));
}

TEST_CASE("distances of 0 and 256 come out of every SIMD level") {
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  descriptor zeros;
  descriptor ones;
  ones.words.fill(~std::uint64_t{0});
  const std::vector<descriptor> q{zeros, ones};
  const std::vector<descriptor> t{ones, ones};
  hamming_workspace memory;
  const answer a = run([&](auto... spans) { hamming_nearest(spans..., memory); }, q, t, true);
  CHECK(a.nearest[0] == nearest_two{0, 256, 256});
  CHECK(a.nearest[1] == nearest_two{0, 0, 0});
  CHECK(a.reverse == std::vector<std::uint32_t>{1, 1});

  std::vector<descriptor> many_q(20, zeros), many_t(300, ones);
  many_q[7] = ones;
  many_t[299] = zeros;
  CHECK(run([&](auto... spans) { hamming_nearest(spans..., memory); }, many_q, many_t, true) == naive(many_q, many_t));
}

TEST_CASE("descriptors of other lengths have the neighbours of the definition, at every level") {
  const auto level = GENERATE(from_range(simd::available_levels()));
  const simd::level_limit limit{level};
  const auto check = [&]<std::size_t Bits>(std::integral_constant<std::size_t, Bits>) {
    using other = binary_descriptor<Bits>;
    random_bits random{Bits};
    std::vector<other> q(33), t(129);
    for (auto* all : {&q, &t})
      for (other& d : *all)
        for (std::uint64_t& word : d.words) word = random() & random() & random();
    std::vector<nearest_two> nearest(q.size()), expected(q.size());
    std::vector<std::uint32_t> reverse(t.size()), expected_reverse(t.size()), distances;
    hamming_workspace memory;
    hamming_nearest(std::span<const other>{q}, std::span<const other>{t}, nearest, reverse, memory);
    nearest_by(hamming{}, std::span<const other>{q}, std::span<const other>{t}, std::span{expected},
               std::span{expected_reverse}, distances);
    CHECK(nearest == expected);
    CHECK(reverse == expected_reverse);
  };
  check(std::integral_constant<std::size_t, 64>{});
  check(std::integral_constant<std::size_t, 128>{});
  check(std::integral_constant<std::size_t, 512>{});
}
