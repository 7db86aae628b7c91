// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Windowed source: compares every query only with the train descriptors near its predicted position.
#pragma once

#include <cassert>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <orbis/features/detail/match/search_among.hpp>
#include <orbis/features/grid.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>

namespace orbis::features {

/// The image region to search for the match of one query.
struct window {
  float x = 0.0F, y = 0.0F;  ///< predicted position, pixels; NaN: no prediction
  float radius = -1.0F;      ///< pixels, inclusive; negative: no search
  int min_octave = 0;        ///< pyramid levels to search, both inclusive
  int max_octave = std::numeric_limits<int>::max();
};

/// Finds, for each query, the nearest and second-nearest train descriptors inside its window. Created by
/// `windowed(distance)`; a chain that begins with this source is called with the windows, one per query, and optionally
/// a grid of the train keypoints:
///
/// @code
///   constexpr auto matcher = windowed(hamming{}) | ratio_test{0.8f} | max_distance{100} | unique{};
///   std::vector<match> a = matcher(landmark_descriptors, frame, windows);
///   std::vector<match> b = matcher(landmark_descriptors, frame, windows, keypoint_grid{frame.keypoints});
/// @endcode
///
/// The reverse neighbour of a train descriptor is the nearest query among those whose windows contain it.
template <class Distance>
struct windowed_source {
  using match_source_tag = void;
  Distance distance{};

  struct workspace {
    detail::search_among_workspace search;
    keypoint_grid grid;
  };

  /// Finds one candidate for each query with a train keypoint in its window.
  /// @pre one window per query; one keypoint per train descriptor; `grid` was built from these keypoints
  template <class Descriptor>
  requires descriptor_distance<Distance, Descriptor>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs, std::span<const window> windows,
              const keypoint_grid& grid) const {
    assert(windows.size() == queries.descriptors.size());
    assert(trains.keypoints.size() == trains.descriptors.size());
    detail::search_among(distance, candidates, memory.search, queries, trains, needs, [&](std::size_t q, auto&& add) {
      const window& w = windows[q];
      grid.for_each_near(w.x, w.y, w.radius, w.min_octave, w.max_octave, add);
    });
  }

  /// Finds one candidate for each query with a train keypoint in its window; builds the grid in its workspace.
  template <class Descriptor>
  requires descriptor_distance<Distance, Descriptor>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs, std::span<const window> windows) const {
    memory.grid.assign(trains.keypoints);
    search(candidates, memory, queries, trains, needs, windows, memory.grid);
  }
};

/// Creates a windowed source: `windowed(hamming{})`.
template <class Distance>
[[nodiscard]] constexpr windowed_source<Distance> windowed(Distance distance) {
  return {distance};
}

}  // namespace orbis::features

#ifndef ORBIS_COMPILED
#include <orbis/features/windowed-inl.hpp>
#endif
