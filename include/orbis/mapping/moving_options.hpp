// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Thresholds for detecting moved objects.
#pragma once

#include <cstddef>

#include <orbis/core/rounded.hpp>

namespace orbis::mapping {

struct moving_filter_options {
  /// Number of most recent keyframes that are compared with each other, > 0; older ones do not change.
  std::size_t keyframes = 8;
  /// Two depths z count as equal if they differ by less than margin + margin_growth z^2, which covers noise and small
  /// pose errors. Units: metres, 1 / metres.
  float margin = 0.03F;
  float margin_growth = 0.0075F;
  /// A ray passes through a point only if the end of the ray is farther away by the margin plus this factor times the
  /// range of depths around that end: rays that graze a surface are not evidence.
  float slant = 1.0F;
  int min_through = 1;  ///< minimum number of keyframes whose rays pass through a removed cell, > 0
  double ratio = 1.0;   ///< minimum ratio (exclusive) of keyframes with rays through a cell to keyframes that show it
  /// Distance in cells up to which neighbours of a removed cell are removed too, if they belong to the same surface and
  /// the keyframes that show them do not outnumber those whose rays pass through them. If rays of any keyframe pass
  /// through a cell, the number of keyframes that show it may exceed theirs by one, because two keyframes in succession
  /// show a moving object at one place. `min_through` and `ratio` do not apply. >= 0
  int grow = 8;
  /// Share of a keyframe's cells whose verdict has to change before the keyframe is marked again in the map; ignored
  /// when the keyframe leaves the window.
  double least_change = 0.002;
};

namespace detail {

/// Difference below which two depths near z count as equal, metres.
[[nodiscard]] inline float depth_margin(const moving_filter_options& options, float z) noexcept {
  return options.margin + rounded_product(options.margin_growth, rounded_product(z, z));
}

}  // namespace detail

}  // namespace orbis::mapping
