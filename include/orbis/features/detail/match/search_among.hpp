// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Search for sources that compare each query with a subset of the train descriptors.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <tuple>
#include <vector>

#include <orbis/features/detail/match/hamming_search.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>

namespace orbis::features::detail {

/// Reusable memory for `search_among`.
struct search_among_workspace {
  struct nearest_query {
    std::uint32_t distance = none;
    std::uint32_t query = none;
  };
  std::vector<std::uint32_t> indices, distances;  ///< of the train descriptors compared with the current query
  std::vector<nearest_query> reverse;             ///< indexed by train descriptor
};

/// Finds one candidate for each query with at least one listed train descriptor. `list(q, add)` calls `add(t)` once
/// for every train descriptor `t` to compare with query `q`, in any order; the result does not depend on the order. The
/// reverse neighbour of a train descriptor is the nearest query that was compared with it. For use by sources; accepts
/// any distance, and is fast for the Hamming distance, which it computes for a whole list at once.
template <class Distance, class Descriptor, class List>
requires descriptor_distance<Distance, Descriptor>
void search_among(const Distance& distance, std::vector<candidate>& candidates, search_among_workspace& memory,
                  const feature_view<Descriptor>& queries, const feature_view<Descriptor>& trains, search_needs needs,
                  List&& list) {
  auto& [indices, distances, reverse] = memory;
  reverse.assign(needs.reverse ? trains.descriptors.size() : 0, {});
  candidates.clear();
  candidates.reserve(queries.descriptors.size());
  // The lists are short and vary in length; reserve the maximum once.
  indices.reserve(trains.descriptors.size());
  distances.resize(trains.descriptors.size());
  for (std::size_t q = 0; q != queries.descriptors.size(); ++q) {
    indices.clear();
    list(q, [&indices = indices](std::uint32_t t) { indices.push_back(t); });
    const auto found = std::span{distances}.first(indices.size());
    if constexpr (std::same_as<Distance, hamming>) {
      hamming_listed(queries.descriptors[q], trains.descriptors, indices, found);
    } else {
      for (std::size_t i = 0; i != indices.size(); ++i)
        found[i] = static_cast<std::uint32_t>(distance(queries.descriptors[q], trains.descriptors[indices[i]]));
    }
    candidate best{static_cast<std::uint32_t>(q), none, none, none, none};
    for (std::size_t i = 0; i != indices.size(); ++i) {
      const std::uint32_t t = indices[i];
      const std::uint32_t d = found[i];
      if (std::tie(d, t) < std::tie(best.distance, best.train)) {
        best.second_distance = best.distance;
        best.distance = d;
        best.train = t;
      } else if (d < best.second_distance) {
        best.second_distance = d;
      }
      if (needs.reverse && d < reverse[t].distance) reverse[t] = {d, best.query};
    }
    if (best.train != none) candidates.push_back(best);
  }
  if (needs.reverse)
    for (candidate& c : candidates) c.reverse_query = reverse[c.train].query;
}

}  // namespace orbis::features::detail
