// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Options of the automatic filter selection, and its result with the evidence: numbers and enumerators, no text.
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include <orbis/cloud/extract.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/core/types.hpp>

namespace orbis::cloud {

class view_samples;

struct select_options {
  std::size_t neighbors = 8;            ///< number of neighbours over which a point's spacing is averaged; > 0
  std::optional<vec3> sensor_origin{};  ///< position from which all points were measured, metres
  /// Distance of each point from the sensor that measured it, metres; overrides sensor_origin. Points with a non-finite
  /// range are not tested by range.
  std::span<const float> ranges{};
  /// Samples of the views, in the order of the views, drawn earlier with the default options. They save one pass over
  /// each view.
  const view_samples* samples = nullptr;
  cloud::non_finite non_finite = cloud::non_finite::drop;
};

/// Finding that determines the threshold of a density test.
enum class threshold_source {
  none,      ///< there is no second population, without which the test removes nothing
  bulk,      ///< a multiple of the width of the bulk
  valley,    ///< the valley before a second population
  shoulder,  ///< the start of a shoulder of the bulk, such as flying pixels form
};

/// Results of one density test. Spacings are natural logarithms relative to the usual spacing.
struct density_evidence {
  filter_mode mode = filter_mode::none;
  threshold_source source = threshold_source::none;
  double left_scale = 0;       ///< width of the bulk below its median
  double right_scale = 0;      ///< width of the bulk above its median
  double surface_end = 0;      ///< beyond this log spacing, most points do not lie on surfaces
  double valley_position = 0;  ///< position of the deepest valley before a later peak
  double valley_ratio = 0;     ///< ratio of the later peak to the valley; 1.6 or more indicates two populations
  double shoulder = 0;         ///< share of points in a shoulder: above the bulk, below the valley, off surfaces
  double threshold = 0;        ///< threshold that was chosen; infinite if the source is `none`
  double removed = 0;          ///< share of the points that the test removes; 0: the test is not part of the chain
  friend bool operator==(const density_evidence&, const density_evidence&) = default;
};

/// Measurements on which a choice is based. Lengths in metres; shares are of all finite points; widths are natural
/// logarithms of ratios of spacings.
struct filter_evidence {
  std::size_t points = 0;                   ///< number of points
  std::size_t finite = 0;                   ///< number of finite points
  std::size_t judged = 0;                   ///< number of points with spacing > 0 and, if any range is known, a range
  double median_spacing = 0;                ///< median over the points of the mean neighbour distance
  double range_exponent = 0;                ///< power of the range with which the usual spacing grows; 0 if unknown
  double left_scale = 0;                    ///< width of the bulk below its median, with the chosen reference
  double right_scale = 0;                   ///< width of the bulk above its median, with the chosen reference
  double global_scale = 0;                  ///< width of the bulk with one reference for all points
  std::optional<double> range_scale{};      ///< width of the bulk with a reference for each range, if ranges are known
  double local_scale = 0;                   ///< width of the bulk with the surroundings as the reference
  std::vector<density_evidence> density{};  ///< one entry per test performed
  double isolated = 0;                      ///< share of points removed as isolated groups
  double clustered = 0;                     ///< share of points removed as small clusters
  std::size_t views = 0;                    ///< number of depth images usable as evidence
  double worst_conflict = 0;                ///< largest conflict of a view with the other views, 0 to 1
  double usual_conflict = 0;                ///< median conflict of a trusted view with the other views, 0 to 1
  double passed_through = 0;                ///< share of points that rays pass through
  double unsupported = 0;                   ///< share of points at which no trusted view measured a surface
  friend bool operator==(const filter_evidence&, const filter_evidence&) = default;
};

/// Extent of the analysis on which a choice is based.
enum class choice_status {
  complete,        ///< all tests were run
  too_few_points,  ///< fewer than 50 points have a spacing (`filter_evidence::judged`): only the views were evaluated
  cancelled,       ///< the progress callback cancelled: the chain is empty
};

/// The chosen filters with their parameters, and the measurements on which the choice is based. For each step of the
/// chain, the evidence has the share of the points that it removes: `passed_through` and `unsupported` for a
/// `ray_step`, the entries of `density` with `removed` > 0, in this order, for the density steps, and `isolated` and
/// `clustered` for an `isolation_step` and `cluster_options`.
struct filter_choice {
  filter_chain chain{};  ///< empty: all (finite) points are kept
  filter_evidence evidence{};
  choice_status status = choice_status::complete;
};

}  // namespace orbis::cloud
