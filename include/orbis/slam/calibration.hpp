// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Calibration of the camera from a map built with it: the intrinsic parameters that best fit all keyframes, as far as
/// the camera motion determines them.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
#include <limits>
#include <string_view>
#include <vector>

#include <orbis/camera/any.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam {

/// A camera that can be calibrated: `any_camera`, and the models it can hold.
template <class C>
concept calibrated_camera = std::same_as<C, camera::any_camera> || std::same_as<C, camera::pinhole> ||
    std::same_as<C, camera::radial_tangential> || std::same_as<C, camera::kannala_brandt>;

struct calibration_options {
  /// Maximum displacement of any image point, in pixels, when a group of parameters changes by one standard deviation
  /// (focal lengths; principal point and tangential distortion; radial distortion). Groups above this limit are held
  /// fixed.
  double max_effect = 2.0;
  /// Weight of the depth residuals, relative to their weight in tracking. Depth errors are correlated between images
  /// (misregistration with colour, the depth camera's own distortion) and would be attributed to the lens; a small
  /// weight is sufficient to fix the scale of the map.
  double depth_weight = 0.0025;
  bool keeps_aspect = true;  ///< keeps the given ratio of the focal lengths, for example 1 for square pixels
  /// Maximum number of consecutive keyframes; those with the most observations are chosen. The cost is cubic in this
  /// number.
  std::size_t max_keyframes = 300;
  /// Maximum number of landmarks, chosen at regular intervals from those that two keyframes observe; the cost is linear
  /// in their number. With fewer landmarks, the standard deviations of the parameters grow, and more groups exceed
  /// `max_effect`.
  std::size_t max_landmarks = std::numeric_limits<std::size_t>::max();
  /// True if a group above `max_effect` is an error (`degenerate`) instead of being held fixed.
  bool needs_all = false;
  /// The optimisation ends when a step reduces the cost by less than this fraction.
  double relative_tolerance = 1e-8;
};

/// Result for one parameter.
struct calibrated_parameter {
  std::string_view name;  ///< name in camera files and OpenCV
  double before = 0.0;
  double after = 0.0;
  double deviation = 0.0;  ///< one standard deviation; 0 if the parameter was held fixed
  bool is_held = false;    ///< true if not determined by the motion; `after` then equals `before`
};

/// Result of a calibration, independent of the camera model.
struct calibration_summary {
  /// The parameters of the model; for `radial_tangential`, they include k3 only if it is not 0, and never k4 to k6.
  std::vector<calibrated_parameter> parameters;
  std::size_t keyframes = 0, landmarks = 0;  ///< numbers of keyframes and landmarks used
  std::size_t observations = 0, outliers = 0;
  double initial_rms = 0.0;  ///< RMS of the inlier observations, in standard deviations
  double final_rms = 0.0;    ///< RMS for the refined camera
  [[nodiscard]] bool is_complete() const {
    return std::none_of(parameters.begin(), parameters.end(), [](const auto& p) { return p.is_held; });
  }
};

template <calibrated_camera Camera>
struct calibration : calibration_summary {
  Camera camera;
};

/// Refines the camera model of a map, together with the poses of its keyframes and the positions of its landmarks,
/// without changing the map. Rebuild the map with the refined camera and calibrate again until nothing changes:
/// observations that did not fit the first camera are missing from the map.
///
/// `rig`: the rig with which the map was built (`make_rig`). @pre options.depth_weight > 0. Errors: `no_data` for a map
/// without landmarks that two keyframes observe; `degenerate` if the camera motion determines no parameter (with
/// `needs_all`: not all), or no observation has depth; `cancelled` if `callback` cancels. Complexity: see
/// `optimize::self_calibrate`, which is called up to four times, with `needs_all` once.
template <feature_descriptor D, calibrated_camera Camera>
[[nodiscard]] result<calibration<Camera>> calibrate(const basic_map<D>& m, const camera_rig<Camera>& rig,
                                                    const calibration_options& options = {},
                                                    const progress& callback = {});

}  // namespace orbis::slam

#ifndef ORBIS_COMPILED
#include <orbis/slam/calibration-inl.hpp>
#endif
