// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// How tracking matches features.
#pragma once

#include <concepts>
#include <span>
#include <vector>

#include <orbis/features/brute_force.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/grid.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>

namespace orbis::slam {

/// How features are matched: near where the last frame's should be by now, near where landmarks should be, and
/// anywhere. Any of them can be replaced by another chain of the same kind (see features/matcher.hpp).
struct orb_matchers {
  static constexpr auto motion = features::windowed(features::hamming{}) | features::max_distance{100} |
                                 features::unique{} | features::rotation_consistency{};
  static constexpr auto landmarks =
      features::windowed(features::hamming{}) | features::max_distance{80} | features::unique{};
  static constexpr auto appearance = features::brute_force(features::hamming{}) | features::ratio_test{0.8F} |
                                     features::cross_check{} | features::max_distance{80};
};

template <class M>
concept tracking_matchers = requires(const features::features& a,
                                     const features::feature_view<features::binary_descriptor<256>>& seen,
                                     const std::vector<features::binary_descriptor<256>>& descriptors,
                                     const std::vector<features::window>& windows,
                                     const features::keypoint_grid& grid) {
  { M::motion(seen, a, windows, grid) } -> std::convertible_to<std::span<const features::match>>;
  { M::landmarks(descriptors, a, windows, grid) } -> std::convertible_to<std::span<const features::match>>;
  { M::appearance(a, a) } -> std::convertible_to<std::span<const features::match>>;
};

}  // namespace orbis::slam
