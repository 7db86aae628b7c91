// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Nearest neighbours under any distance: the reference implementation.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/features/match.hpp>

namespace orbis::features::detail {

/// The nearest element of a set (the lowest index on ties), and the distance of the second-nearest.
struct nearest_two {
  std::uint32_t index = none;
  std::uint32_t distance = none;
  std::uint32_t second_distance = none;
  friend constexpr bool operator==(const nearest_two&, const nearest_two&) = default;
};

/// Finds the nearest and second-nearest train descriptors for each query; if `reverse` is not empty, also the nearest
/// query for each train descriptor (the lowest on ties). O(queries x trains).
/// @pre nearest.size() == queries.size(); reverse is empty or has the size of trains
template <class Distance, class Descriptor>
void nearest_by(const Distance& distance, std::span<const Descriptor> queries, std::span<const Descriptor> trains,
                std::span<nearest_two> nearest, std::span<std::uint32_t> reverse,
                std::vector<std::uint32_t>& reverse_distance) {
  assert(nearest.size() == queries.size() && (reverse.empty() || reverse.size() == trains.size()));
  reverse_distance.assign(reverse.size(), none);
  const Descriptor* const train = trains.data();
  const std::size_t train_count = trains.size();
  for (std::size_t q = 0; q != queries.size(); ++q) {
    const Descriptor& query = queries[q];
    nearest_two best;
    for (std::size_t t = 0; t != train_count; ++t) {
      const auto d = static_cast<std::uint32_t>(distance(query, train[t]));
      if (d < best.distance) {
        best = {static_cast<std::uint32_t>(t), d, best.distance};
      } else if (d < best.second_distance) {
        best.second_distance = d;
      }
      if (!reverse.empty() && d < reverse_distance[t]) {
        reverse_distance[t] = d;
        reverse[t] = static_cast<std::uint32_t>(q);
      }
    }
    nearest[q] = best;
  }
}

}  // namespace orbis::features::detail
