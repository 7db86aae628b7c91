// SPDX-License-Identifier: BSD-3-Clause
//
// Rooms of known geometry, and what a depth camera that walks through them measures.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/image.hpp>
#include <orbis/core/random.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/io/detail/synthetic/solid.hpp>

namespace orbis::bench {

enum class room_kind {
  furnished,  ///< the furnished room of the synthetic recordings
  clutter,    ///< boxes, cylinders and balls anywhere
  corridor,   ///< long, with pillars: the range varies by a factor of ten
  table_top,  ///< small things on a table, from close by
  hall        ///< large and nearly bare, seen from afar
};

/// A room is a list of solids; the first is its hull, seen from inside.
struct room {
  room_kind kind;
  std::vector<io::detail::synthetic::solid> solids;

  /// Metres from a point to the nearest surface.
  [[nodiscard]] double distance(const vec3& p) const;
  /// The depth along a ray whose direction has depth 1; 0 where nothing is met.
  [[nodiscard]] double cast(const vec3& origin, const vec3& direction) const;
};
[[nodiscard]] room make_room(room_kind kind, std::uint64_t seed);

/// The places from which a room is seen, neighbours overlapping by more than half.
[[nodiscard]] std::vector<se3> make_path(const room& r, int views, std::uint64_t seed);

/// A depth camera. Its noise has the deviation `noise_floor + noise_square * z^2` metres.
struct depth_sensor {
  int width = 192, height = 144;  ///< pixels
  double focal = 158;             ///< pixels
  double noise_floor = 0.001, noise_square = 0.002;
  double disparity_step = 0;   ///< pixels; 0: depth is not quantised
  double focal_baseline = 43;  ///< pixel metres: disparity = focal_baseline / depth
  double max_depth = 4.5;      ///< metres
  double dropouts = 0.01;      ///< share of pixels without a measurement

  [[nodiscard]] camera::pinhole camera() const {
    return camera::pinhole{width, height, focal, focal, 0.5 * (width - 1), 0.5 * (height - 1)};
  }
  [[nodiscard]] double deviation(double z) const { return noise_floor + noise_square * z * z; }
  /// What is measured at the true depth `z`, 0: nothing.
  [[nodiscard]] float measure(double z, random_bits& random) const;
};

/// A solid somewhere in the path of the camera, as somebody walking by.
[[nodiscard]] io::detail::synthetic::solid walker(const room& r, const std::vector<se3>& path, double progress,
                                          std::uint64_t seed);

}  // namespace orbis::bench
