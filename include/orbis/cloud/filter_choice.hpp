// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a cloud is judged by, and what was chosen.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <orbis/cloud/extract.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

class view_samples;

struct select_options {
  std::size_t neighbors = 8;            ///< over which a point's spacing is averaged; > 0
  std::optional<vec3> sensor_origin{};  ///< where all points were seen from, metres
  /// Per point, metres from the sensor that saw it; wins over sensor_origin. A point whose range is not
  /// finite is not judged by range.
  std::span<const float> ranges{};
  /// Of the views, in their order, drawn with the default options while these were at hand: then each view is looked at
  /// once less.
  const view_samples* samples = nullptr;
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// What one test of density saw. Natural logarithms of spacing, relative to what is usual.
struct density_evidence {
  filter_mode mode = filter_mode::none;
  double left_scale = 0;       ///< width of the bulk below its median
  double right_scale = 0;      ///< and above
  double surface_end = 0;      ///< sparser than this, most points do not lie on surfaces
  double valley_position = 0;  ///< of the deepest valley before a later peak
  double valley_ratio = 0;     ///< later peak over valley; 1.6 and more counts as two populations
  double shoulder = 0;         ///< share of the points between the bulk and the valley's threshold
  double threshold = 0;        ///< as chosen
  double removed = 0;          ///< share of the points that the test removes; 0: it is not part of the chain
};

/// The numbers behind a choice. Lengths in metres; shares are of all finite points.
struct filter_evidence {
  std::size_t points = 0;             ///< all
  std::size_t finite = 0;             ///< of these
  std::size_t judged = 0;             ///< finite, as is their range if any is, and not identical to all neighbours
  double median_spacing = 0;          ///< median over the points of the mean neighbour distance
  double left_scale = 0;              ///< width of the bulk below its median with the chosen reference, log
  double right_scale = 0;             ///< and above
  double global_scale = 0;            ///< width with one reference for all points, log
  std::optional<double> range_scale;  ///< width with the reference over range, where ranges are known
  double local_scale = 0;             ///< width with the surroundings as the reference
  std::vector<density_evidence> density{};  ///< of each test that was made
  double isolated = 0;                      ///< share removed as groups of a few points
  double clustered = 0;                     ///< share removed as small clusters
  std::size_t views = 0;                    ///< depth images that could testify
  double worst_conflict = 0;                ///< share by which the worst view contradicts the others
  double usual_conflict = 0;                ///< and the usual one
  double passed_through = 0;                ///< share that rays pass through
  double unsupported = 0;                   ///< share that no trusted view measured
};

/// What was chosen, with which parameters, and why.
struct filter_choice {
  filter_chain chain{};  ///< empty: everything (finite) stays
  filter_evidence evidence{};
  std::string reason{};  ///< what was seen and what follows, in words
};

}  // namespace orbis::cloud
