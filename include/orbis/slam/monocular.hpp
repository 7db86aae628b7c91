// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The sensor of a single camera without depth, and the options that suit it.
#pragma once

#include <concepts>
#include <cstddef>
#include <cstdint>
#include <numbers>

#include <orbis/camera/model.hpp>
#include <orbis/core/image.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/sensor.hpp>

namespace orbis::slam {

/// One image, in colour or, if the extractor takes it, in grey. Depth is never measured: features become landmarks by
/// parallax. A map begins with two frames between which the camera has moved far enough for the scene to be certain
/// (`optimize::reconstruct_two_views`); their distance is unknown, and the unit of length is the median depth of the
/// scene in the first of them. The unit may drift along the way, which loops correct.
struct monocular {
  static constexpr scale_source scale = scale_source::free;

  /// @pre the image has the size of the camera
  template <camera::camera_model Camera, feature_extractor Extractor>
  [[nodiscard]] static basic_frame<descriptor_of_t<Extractor>> measure(const camera_rig<Camera>& rig,
                                                                       const Extractor& extract,
                                                                       image_view<const rgb8> color) {
    return detail::frame_of(rig, extract(color), sensor_kind::monocular);
  }
  template <camera::camera_model Camera, feature_extractor Extractor>
  requires std::invocable<const Extractor&, image_view<const std::uint8_t>>
  [[nodiscard]] static basic_frame<descriptor_of_t<Extractor>> measure(const camera_rig<Camera>& rig,
                                                                       const Extractor& extract,
                                                                       image_view<const std::uint8_t> grey) {
    return detail::frame_of(rig, extract(grey), sensor_kind::monocular);
  }

  /// The number of features, if there are `settings.min_start_points` or more, otherwise 0.
  template <feature_descriptor D>
  [[nodiscard]] static std::size_t begins_map(const basic_frame<D>& f, const options& settings) {
    return f.size() < settings.min_start_points ? 0 : f.size();
  }
};

/// The settings of a camera without depth, on top of others. Lengths of `keyframes.moved` and
/// `triangulation.min_baseline` are then shares of the median depth of the landmarks in view. More keyframes are made,
/// for landmarks to be triangulated by, and landmarks need three of them. The figures are those of R. Mur-Artal, J. M.
/// M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), where it gives them.
[[nodiscard]] inline options monocular_options(options settings = {}) {
  settings.scale_is_measured = false;
  settings.keyframes.moved = 0.03;
  settings.keyframes.inlier_ratio = settings.keyframes.inlier_ratio_start = 0.9;
  settings.culling.min_support = 3;
  settings.culling.least_support = 2;
  settings.triangulation.neighbors = 20;
  settings.triangulation.min_baseline = 0.01;
  settings.triangulation.min_parallax = 0.02;
  settings.fusion.neighbors = 20;
  settings.recovery.min_map_keyframes = 5;
  settings.moving.enabled = false;
  settings.depth_term.enabled = settings.depth_term.recovers = false;
  settings.places.loop.max_rotation = 60.0 * std::numbers::pi / 180.0;
  return settings;
}

}  // namespace orbis::slam
