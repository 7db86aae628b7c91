// SPDX-License-Identifier: BSD-3-Clause
#include <algorithm>
#include <vector>

#include <orbis/core/random.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/detail/match/search_among.hpp>

#include "support/catch.hpp"

using namespace orbis;
using namespace orbis::features;

namespace {

/// Small numbers, of which many are equally far apart.
struct step_distance {
  std::uint32_t operator()(int a, int b) const { return static_cast<std::uint32_t>(a < b ? b - a : a - b); }
};

using lists = std::vector<std::vector<std::uint32_t>>;

/// By definition.
template <class Distance, class Descriptor>
std::vector<candidate> plain_search(const Distance& distance, const std::vector<Descriptor>& queries,
                                    const std::vector<Descriptor>& trains, bool reverse, const lists& compared) {
  std::vector<candidate> out;
  for (std::uint32_t q = 0; q != queries.size(); ++q) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> near;  // distance, train
    for (const std::uint32_t t : compared[q]) near.emplace_back(distance(queries[q], trains[t]), t);
    std::sort(near.begin(), near.end());
    if (near.empty()) continue;
    candidate c{q, near[0].second, near[0].first, near.size() > 1 ? near[1].first : none, none};
    std::uint32_t least = none;
    for (std::uint32_t other = 0; reverse && other != queries.size(); ++other) {
      const auto& list = compared[other];
      if (std::find(list.begin(), list.end(), c.train) == list.end()) continue;
      if (const std::uint32_t d = distance(queries[other], trains[c.train]); d < least) {
        least = d;
        c.reverse_query = other;
      }
    }
    out.push_back(c);
  }
  return out;
}

template <class Distance, class Descriptor>
void check_search(const std::vector<Descriptor>& queries, const std::vector<Descriptor>& trains, random_bits& random) {
  lists compared(queries.size());
  for (auto& list : compared) {
    const std::uint32_t share = random.below(4);  // none, some, most
    for (std::uint32_t t = 0; t != trains.size(); ++t)
      if (random.below(4) < share) list.push_back(t);
    shuffle(list, random);
  }
  orbis::features::detail::search_among_workspace memory;
  std::vector<candidate> found{{7, 7, 7}};
  for (const bool reverse : {true, false, true}) {
    orbis::features::detail::search_among(Distance{}, found, memory, as_view(queries), as_view(trains),
                                          {.reverse = reverse}, [&](std::size_t q, const auto& add) {
                                            for (const std::uint32_t t : compared[q]) add(t);
                                          });
    CHECK(found == plain_search(Distance{}, queries, trains, reverse, compared));
  }
}

}  // namespace

TEST_CASE("each query finds the nearest of its list, the second nearest, and the query nearest to it") {
  random_bits random{1};
  for (int round = 0; round != 30; ++round) {
    std::vector<int> queries(random.below(30)), trains(random.below(40));
    for (int& x : queries) x = static_cast<int>(random.below(12));
    for (int& x : trains) x = static_cast<int>(random.below(12));
    check_search<step_distance>(queries, trains, random);
  }
}

TEST_CASE("lists are searched by the Hamming distance as by any other") {
  random_bits random{2};
  for (const simd::level l : simd::available_levels()) {
    const simd::level_limit limit{l};
    for (int round = 0; round != 10; ++round) {
      std::vector<bit_words<256>> queries(20), trains(1 + random.below(60));
      for (auto* all : {&queries, &trains})
        for (auto& d : *all)
          for (auto& word : d) word = random() & random() & random() & random() & 0x11111111;
      check_search<hamming>(queries, trains, random);
    }
  }
}
