// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How what has moved away is told from what is there.
#pragma once

#include <cstddef>

#include <orbis/core/rounded.hpp>

namespace orbis::mapping {

struct moving_filter_options {
  std::size_t keyframes = 8;  ///< so many of the last ones judge each other, > 0; older ones stay as they are
  /// Two depths z are the same if they differ by less than margin + margin_growth z^2, which covers noise and small
  /// errors of poses. Metres; 1 / metres.
  float margin = 0.03F;
  float margin_growth = 0.0075F;
  /// A ray passes through a point only if what it ends at is farther away by the margin and by this many times the
  /// range of depths around that end: rays that graze a surface prove nothing.
  float slant = 1.0F;
  int min_through = 1;  ///< a cell is taken out if the rays of at least so many keyframes pass through it, > 0,
  double ratio = 1.0;   ///< and of more than this many times as many as show it
  /// Cells up to this far from one that is taken out go too, if they are of the same surface and no more keyframes show
  /// them than look through them. >= 0
  int grow = 4;
  /// A keyframe that is in the map already is marked again only where so much of its image has got another verdict, or
  /// when it leaves the last keyframes.
  double least_change = 0.002;
};

namespace detail {

/// Two depths near z that differ by no more are the same, metres.
[[nodiscard]] inline float depth_margin(const moving_filter_options& options, float z) noexcept {
  return options.margin + rounded_product(options.margin_growth, rounded_product(z, z));
}

}  // namespace detail

}  // namespace orbis::mapping
