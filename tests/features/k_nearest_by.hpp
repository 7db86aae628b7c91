// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The definition of the k nearest neighbours by any distance.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/features/detail/match/nearest.hpp>

namespace orbis::test {

/// For each query its `k` nearest trains by ascending distance, then index: row `q` begins at `nearest[q * k]`.
template <class Distance, class Descriptor>
void k_nearest_by(const Distance& distance, std::span<const Descriptor> queries, std::span<const Descriptor> trains,
                  std::size_t k, std::span<features::detail::neighbor> nearest) {
  std::fill(nearest.begin(), nearest.end(), features::detail::neighbor{});
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

}  // namespace orbis::test
