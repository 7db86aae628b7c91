// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Epipolar source: searches along epipolar lines.
#pragma once

#include <array>
#include <cassert>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include <orbis/core/types.hpp>
#include <orbis/features/detail/match/search_among.hpp>
#include <orbis/features/epipolar_geometry.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>

namespace orbis::features {

/// Limits on the distance between a match and its epipolar line.
struct epipolar_rule {
  float distance = 1.96F;       ///< maximum at the finest level, pixels; accepts 95 % of matches if sigma is one pixel
  float scale_factor = 1.2F;    ///< scale factor of the pyramid, applied to the limit per level of the train keypoint
  float epipole_radius = 0.0F;  ///< exclusion radius around the epipole (no parallax), pixels; scales like `distance`
};

/// Finds, for each query, the nearest and second-nearest train descriptors among those close to its epipolar line. Used
/// to find new landmarks to triangulate from two images with known poses. Created by `epipolar(distance, rule)`; a
/// chain that begins with this source is called with the geometry of the two images:
///
/// @code
///   constexpr auto matcher = epipolar(hamming{}, {.epipole_radius = 10.0F}) | ratio_test{0.8f} | cross_check{};
///   std::vector<match> found = matcher(f1, f2, ray_geometry{rays1, rays2, T_camera2_camera1, focal});
/// @endcode
///
/// The reverse neighbour of a train descriptor is the nearest query among those whose epipolar lines pass close to its
/// keypoint.
template <class Distance>
struct epipolar_source {
  using match_source_tag = void;
  Distance distance{};
  epipolar_rule rule{};

  struct workspace {
    detail::search_among_workspace search;
    std::vector<float> x, y, limit;  ///< positions and limits of the train keypoints, padded to whole blocks
  };

  /// Reports invalid arguments with a single compiler error.
  template <class Descriptor, class Other>
  requires descriptor_distance<Distance, Descriptor> &&
      (!epipolar_geometry<Other>)void search(std::vector<candidate>& /*candidates*/, workspace& /*memory*/,
                                             const feature_view<Descriptor>& /*queries*/,
                                             const feature_view<Descriptor>& /*trains*/, search_needs /*needs*/,
                                             const Other& /*geometry*/) const {
    static_assert(epipolar_geometry<Other>, "orbis: epipolar(...) requires an epipolar_geometry, such as ray_geometry");
  }

  /// Finds one candidate for each query with a train keypoint close to its line. Computes O(queries x trains)
  /// distances to lines.
  /// @pre one keypoint for each descriptor on both sides
  template <class Descriptor, epipolar_geometry Geometry>
  requires descriptor_distance<Distance, Descriptor>
  void search(std::vector<candidate>& candidates, workspace& memory, const feature_view<Descriptor>& queries,
              const feature_view<Descriptor>& trains, search_needs needs, const Geometry& geometry) const {
    assert(queries.keypoints.size() == queries.descriptors.size());
    assert(trains.keypoints.size() == trains.descriptors.size());
    place_trains(memory, trains.keypoints, geometry);
    detail::search_among(distance, candidates, memory.search, queries, trains, needs, [&](std::size_t q, auto&& add) {
      const std::optional<epipolar_line> line = geometry.line(q, queries.keypoints[q]);
      if (!line) return;
      for (std::size_t begin = 0; begin < memory.x.size(); begin += block) {
        std::array<std::uint32_t, block> close;
        if (!any_close(*line, memory.x.data() + begin, memory.y.data() + begin, memory.limit.data() + begin, close))
          continue;
        for (std::size_t i = 0; i != block; ++i)
          if (close[i] != 0) add(static_cast<std::uint32_t>(begin + i));
      }
    });
  }

 private:
  static constexpr std::size_t block = 16;

  /// Computes the limit on the distance to the line for each train keypoint; a NaN or negative limit matches no line.
  template <class Geometry>
  void place_trains(workspace& memory, std::span<const keypoint> keypoints, const Geometry& geometry) const {
    constexpr float nowhere = std::numeric_limits<float>::quiet_NaN();
    const std::size_t size = (keypoints.size() + block - 1) / block * block;
    memory.x.assign(size, nowhere);
    memory.y.assign(size, nowhere);
    memory.limit.assign(size, nowhere);
    const std::optional<vec2f> epipole = geometry.epipole();
    for (std::size_t t = 0; t != keypoints.size(); ++t) {
      const vec2f p = geometry.point(t, keypoints[t]);
      const float scale = std::pow(rule.scale_factor, static_cast<float>(keypoints[t].octave));
      if (epipole && norm(p - *epipole) < rule.epipole_radius * scale) continue;
      memory.x[t] = p.x();
      memory.y[t] = p.y();
      memory.limit[t] = rule.distance * scale;
    }
  }

  /// A branch-free loop of fixed length, so that the compiler vectorises it.
  [[nodiscard]] static bool any_close(const epipolar_line& line, const float* x, const float* y, const float* limit,
                                      std::array<std::uint32_t, block>& close) noexcept {
    std::uint32_t any = 0;
    for (std::size_t i = 0; i != block; ++i) {
      close[i] = std::abs(line.a * x[i] + line.b * y[i] + line.c) <= limit[i] ? 1U : 0U;
      any |= close[i];
    }
    return any != 0;
  }
};

/// Creates an epipolar source: `epipolar(hamming{})`.
template <class Distance>
[[nodiscard]] constexpr epipolar_source<Distance> epipolar(Distance distance, epipolar_rule rule = {}) {
  return {distance, rule};
}

}  // namespace orbis::features

#ifndef ORBIS_COMPILED
#include <orbis/features/epipolar-inl.hpp>
#endif
