// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The nearest neighbours by any distance: the plain definition.
#pragma once

#include <algorithm>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace orbis::features::detail {

/// In place of an index or a distance that does not exist.
inline constexpr std::uint32_t no_neighbor = std::numeric_limits<std::uint32_t>::max();

/// One of the nearest.
struct neighbor {
  std::uint32_t index = no_neighbor;
  std::uint32_t distance = no_neighbor;
  friend constexpr bool operator==(const neighbor&, const neighbor&) = default;
};

/// The nearest of a set, the lowest index on ties, and the distance of the second nearest.
struct nearest_two {
  std::uint32_t index = no_neighbor;
  std::uint32_t distance = no_neighbor;
  std::uint32_t second_distance = no_neighbor;
  friend constexpr bool operator==(const nearest_two&, const nearest_two&) = default;
};

/// For each query its nearest and second nearest train; if `reverse` is not empty, for each train
/// its nearest query (the lowest on ties). O(queries x trains).
/// @pre nearest.size() == queries.size(); reverse is empty or of the size of trains
template <class Distance, class Descriptor>
void nearest_by(const Distance& distance, std::span<const Descriptor> queries, std::span<const Descriptor> trains,
                std::span<nearest_two> nearest, std::span<std::uint32_t> reverse,
                std::vector<std::uint32_t>& reverse_distance) {
  assert(nearest.size() == queries.size() && (reverse.empty() || reverse.size() == trains.size()));
  reverse_distance.assign(reverse.size(), no_neighbor);
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

/// For each query its `k` nearest trains by ascending distance, then index: row `q` begins at
/// `nearest[q * k]`, and what there are too few trains for is left at the default.
/// O(queries x trains) distances.
/// @pre k > 0; nearest.size() == queries.size() * k
template <class Distance, class Descriptor>
void k_nearest_by(const Distance& distance, std::span<const Descriptor> queries, std::span<const Descriptor> trains,
                  std::size_t k, std::span<neighbor> nearest) {
  assert(k > 0 && nearest.size() == queries.size() * k);
  std::fill(nearest.begin(), nearest.end(), neighbor{});
  for (std::size_t q = 0; q != queries.size(); ++q) {
    const auto row = nearest.subspan(q * k, k);
    for (std::size_t t = 0; t != trains.size(); ++t) {
      const auto d = static_cast<std::uint32_t>(distance(queries[q], trains[t]));
      if (d >= row.back().distance) continue;
      std::size_t at = k - 1;
      for (; at != 0 && row[at - 1].distance > d; --at) row[at] = row[at - 1];
      row[at] = {static_cast<std::uint32_t>(t), d};
    }
  }
}

}  // namespace orbis::features::detail
