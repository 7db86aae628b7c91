// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The two nearest neighbours of many binary descriptors at once, by run-time dispatched kernels.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include <orbis/core/simd.hpp>
#include <orbis/features/hamming.hpp>

namespace orbis::features {

/// The nearest of a set, the lowest index on ties, and the distance of the second nearest.
struct nearest_two {
  std::uint32_t index = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t distance = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t second_distance = std::numeric_limits<std::uint32_t>::max();  ///< the maximum: there is none
  friend constexpr bool operator==(const nearest_two&, const nearest_two&) = default;
};

/// Descriptors that `hamming_nearest` knows.
template <class Descriptor>
concept has_hamming_kernel = std::same_as<Descriptor, binary_descriptor<256>>;

namespace detail {

/// The plain definition, for any distance. `reverse[t]`: the query nearest to train t; empty if
/// not wanted.
template <class Distance, class Descriptor>
void nearest_by(const Distance& distance, std::span<const Descriptor> queries, std::span<const Descriptor> trains,
                std::span<nearest_two> nearest, std::span<std::uint32_t> reverse) {
  std::vector<std::uint32_t> reverse_distance(reverse.size(), std::numeric_limits<std::uint32_t>::max());
  for (std::size_t q = 0; q != queries.size(); ++q) {
    nearest_two best;
    for (std::size_t t = 0; t != trains.size(); ++t) {
      const auto d = static_cast<std::uint32_t>(distance(queries[q], trains[t]));
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

}  // namespace detail

/// For each query its nearest and second nearest train; if `reverse` is not empty, for each train
/// its nearest query. Every level gives the same answer. O(queries x trains), nothing more than
/// O(queries + trains) memory.
/// @pre nearest.size() == queries.size(); reverse is empty or of the size of trains; trains not empty
inline void hamming_nearest(simd::level, std::span<const binary_descriptor<256>> queries,
                            std::span<const binary_descriptor<256>> trains, std::span<nearest_two> nearest,
                            std::span<std::uint32_t> reverse) {
  detail::nearest_by(hamming{}, queries, trains, nearest, reverse);
}

}  // namespace orbis::features
