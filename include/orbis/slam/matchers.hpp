// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Feature matchers for tracking.
#pragma once

#include <concepts>
#include <cstdint>
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
#include <orbis/slam/extractor.hpp>

namespace orbis::slam {

namespace detail {

/// True unless the matchers declare a distance `M::distance` other than the one with which a map compares descriptors.
template <class M, class D>
concept compares_as_map = !requires {
  typename M::distance;
}
|| requires { requires std::same_as<typename M::distance, distance_of_t<D>>; };

}  // namespace detail

/// The matchers for tracking with descriptors of type `D`: `motion` matches the features of the last frame near their
/// predicted positions; `landmarks` matches landmarks near their projections; `appearance` matches two images without a
/// prediction. Each is a matcher chain (see `features/matcher.hpp`). If `M` declares a type `distance`, it must be the
/// distance with which a map compares these descriptors: many descriptor types compile with a bitwise distance,
/// which is meaningful for few of them.
template <class M, class D>
concept tracking_matchers = feature_descriptor<D> && detail::compares_as_map<M, D> &&
    requires(const features::basic_features<D>& image, const features::feature_view<D>& seen,
             const std::vector<D>& descriptors, const std::vector<features::window>& windows,
             const features::keypoint_grid& grid) {
  { M::motion(seen, image, windows, grid) } -> std::convertible_to<std::span<const features::match>>;
  { M::landmarks(descriptors, image, windows, grid) } -> std::convertible_to<std::span<const features::match>>;
  { M::appearance(image, image) } -> std::convertible_to<std::span<const features::match>>;
};

/// Matchers with maximum descriptor distances `Motion`, `Landmarks` and `Appearance`.
/// Source of the default values: R. Mur-Artal, J. D. Tardos, "ORB-SLAM2", T-RO 33 (2017), with descriptors of 256 bits.
template <class Distance, std::uint32_t Motion = 100, std::uint32_t Landmarks = 80, std::uint32_t Appearance = 80>
struct distance_matchers {
  using distance = Distance;
  static constexpr auto motion = features::windowed(Distance{}) | features::max_distance{Motion} | features::unique{} |
                                 features::rotation_consistency{};
  static constexpr auto landmarks =
      features::windowed(Distance{}) | features::max_distance{Landmarks} | features::unique{};
  static constexpr auto appearance = features::brute_force(Distance{}) | features::ratio_test{0.8F} |
                                     features::cross_check{} | features::max_distance{Appearance};
};

/// The default matchers, for ORB descriptors.
using orb_matchers = distance_matchers<features::hamming>;

}  // namespace orbis::slam
