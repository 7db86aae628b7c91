// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Brute-force source: compares every query descriptor with every train descriptor.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/features/detail/match/hamming_search.hpp>
#include <orbis/features/detail/match/nearest.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>

namespace orbis::features {

/// Finds the nearest and second-nearest train descriptor for each query and, on request, the nearest query for each
/// train descriptor, in one pass over all pairs. Created by `brute_force(distance)`.
template <class Distance>
struct brute_force_source {
  using match_source_tag = void;
  Distance distance{};

  struct workspace {
    std::vector<detail::nearest_two> nearest;
    std::vector<std::uint32_t> reverse;
    detail::hamming_workspace search;
  };

  /// Finds one candidate per query; none if there are no train descriptors. O(queries x trains).
  template <class Descriptor>
  requires descriptor_distance<Distance, Descriptor>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs) const {
    const std::size_t query_count = queries.descriptors.size();
    const std::size_t train_count = trains.descriptors.size();
    candidates.clear();
    if (query_count == 0 || train_count == 0) return;

    memory.nearest.resize(query_count);
    memory.reverse.resize(needs.reverse ? train_count : 0);
    if constexpr (std::same_as<Distance, hamming>) {
      detail::hamming_nearest(queries.descriptors, trains.descriptors, std::span{memory.nearest},
                              std::span{memory.reverse}, memory.search);
    } else {
      detail::nearest_by(distance, queries.descriptors, trains.descriptors, std::span{memory.nearest},
                         std::span{memory.reverse}, memory.search.reverse_distance);
    }

    candidates.resize(query_count);
    for (std::size_t i = 0; i != query_count; ++i) {
      const detail::nearest_two& n = memory.nearest[i];
      candidates[i] = {static_cast<std::uint32_t>(i), n.index, n.distance, n.second_distance,
                       needs.reverse ? memory.reverse[n.index] : none};
    }
  }
};

/// Creates a brute-force source: `brute_force(hamming{})`.
template <class Distance>
[[nodiscard]] constexpr brute_force_source<Distance> brute_force(Distance distance) {
  return {distance};
}

}  // namespace orbis::features

#ifndef ORBIS_COMPILED
#include <orbis/features/brute_force-inl.hpp>
#endif
