// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The source that compares every query only with the trains near its predicted position.
#pragma once

#include <cassert>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <tuple>
#include <vector>

#include <orbis/features/grid.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>

namespace orbis::features {

/// Where to look for one query.
struct window {
  float x = 0.0F, y = 0.0F;  ///< predicted position, pixels; NaN: there is none
  float radius = -1.0F;      ///< pixels, inclusive; negative: do not look at all
  int min_octave = 0;        ///< pyramid levels to look at, both inclusive
  int max_octave = std::numeric_limits<int>::max();
};

/// Finds for each query the nearest and the second nearest train inside its window. Made by
/// `windowed(distance)`; a chain that begins with it is called with the windows, one for each query,
/// and if one is at hand with the grid over the trains' keypoints:
///
/// @code
///   constexpr auto matcher = windowed(hamming{}) | ratio_test{0.8f} | max_distance{100} | unique{};
///   std::vector<match> a = matcher(landmark_descriptors, frame, windows);
///   std::vector<match> b = matcher(landmark_descriptors, frame, windows, keypoint_grid{frame.keypoints});
/// @endcode
///
/// The reverse neighbour of a train is the nearest of the queries in whose window it lies.
template <class Distance>
struct windowed_source {
  using match_source_tag = void;
  Distance distance{};

  /// One candidate for each query that has a train in its window.
  /// @pre one window for each query; one keypoint for each train; `grid` is made of these keypoints
  template <class Descriptor>
  requires descriptor_distance<Distance, Descriptor>
  [[nodiscard]] std::vector<candidate> search(const feature_view<Descriptor>& queries,
                                              const feature_view<Descriptor>& trains, search_needs needs,
                                              std::span<const window> windows, const keypoint_grid& grid) const {
    assert(windows.size() == queries.descriptors.size());
    assert(trains.keypoints.size() == trains.descriptors.size());
    struct nearest_query {
      std::uint32_t distance = none;
      std::uint32_t query = none;
    };
    std::vector<nearest_query> reverse(needs.reverse ? trains.descriptors.size() : 0);
    std::vector<candidate> candidates;
    candidates.reserve(queries.descriptors.size());
    for (std::size_t q = 0; q != queries.descriptors.size(); ++q) {
      const window& w = windows[q];
      candidate best{static_cast<std::uint32_t>(q), none, none, none, none};
      grid.for_each_near(w.x, w.y, w.radius, w.min_octave, w.max_octave, [&](std::uint32_t t) {
        const auto d = static_cast<std::uint32_t>(distance(queries.descriptors[q], trains.descriptors[t]));
        // The grid does not visit in the order of the indices: ties are told apart here.
        if (std::tie(d, t) < std::tie(best.distance, best.train)) {
          best.second_distance = best.distance;
          best.distance = d;
          best.train = t;
        } else if (d < best.second_distance) {
          best.second_distance = d;
        }
        if (needs.reverse && d < reverse[t].distance) reverse[t] = {d, best.query};
      });
      if (best.train != none) candidates.push_back(best);
    }
    if (needs.reverse)
      for (candidate& c : candidates) c.reverse_query = reverse[c.train].query;
    return candidates;
  }

  /// The same, with a grid made for this one search.
  template <class Descriptor>
  requires descriptor_distance<Distance, Descriptor>
  [[nodiscard]] std::vector<candidate> search(const feature_view<Descriptor>& queries,
                                              const feature_view<Descriptor>& trains, search_needs needs,
                                              std::span<const window> windows) const {
    return search(queries, trains, needs, windows, keypoint_grid{trains.keypoints});
  }
};

/// A source that compares within windows: `windowed(hamming{})`.
template <class Distance>
[[nodiscard]] constexpr windowed_source<Distance> windowed(Distance distance) {
  return {distance};
}

}  // namespace orbis::features
