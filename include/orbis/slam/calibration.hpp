// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Calibration of the camera by a map that was made with it: the intrinsic parameters that agree best with all
/// keyframes, as far as the motion of the camera determines them.
#pragma once

#include <algorithm>
#include <concepts>
#include <cstddef>
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
  /// A group of parameters (focal lengths; principal point and tangential distortion; radial distortion) is held where
  /// its standard deviation moves a pixel anywhere in the image by more than this, pixels.
  double max_effect = 2.0;
  /// The weight of a depth relative to tracking. Its errors are alike from image to image (depth that is not where its
  /// colour is, a depth camera's own distortion) and would be taken for the lens's; a small weight does to fix the size
  /// of the world.
  double depth_weight = 0.0025;
  bool keeps_aspect = true;  ///< the ratio of the focal lengths is known: pixels are square, or as they are given
  /// Made one after the other, where most was seen; the work grows with the third power of their number.
  std::size_t max_keyframes = 300;
};

/// What the map tells of a parameter.
struct calibrated_parameter {
  std::string_view name;  ///< as camera files and OpenCV call it
  double before = 0.0;
  double after = 0.0;
  double deviation = 0.0;  ///< one standard deviation; 0 where the parameter was held
  bool is_held = false;    ///< the motion does not tell; `after` is `before`
};

/// What is known of a calibration, whatever the model of its camera.
struct calibration_summary {
  std::vector<calibrated_parameter>
      parameters;  ///< those that the model has; of `radial_tangential` k3 if it is not 0, k4 to k6 never
  std::size_t keyframes = 0, landmarks = 0;  ///< that took part
  std::size_t observations = 0, outliers = 0;
  double initial_rms = 0.0;  ///< of the observations that are no outliers, in standard deviations
  double final_rms = 0.0;    ///< for the camera that was found
  [[nodiscard]] bool is_complete() const {
    return std::none_of(parameters.begin(), parameters.end(), [](const auto& p) { return p.is_held; });
  }
};

template <calibrated_camera Camera>
struct calibration : calibration_summary {
  Camera camera;
};

/// Refines the camera of a map by its keyframes and landmarks, whose poses and positions are refined with it but not
/// changed in the map. The map should be made again with the camera that was found, and that be refined in turn, until
/// nothing changes: what did not fit the first camera had been left out of the map.
///
/// `rig`: as the map was made with (`make_rig`). @pre options.depth_weight > 0. Errors: `no_data` for a map without
/// landmarks that two keyframes observe; `degenerate` if its motion determines no parameter, or nothing has depth;
/// `cancelled` by `callback`. Complexity: see `optimize::self_calibrate`, which is called up to four times.
template <feature_descriptor D, calibrated_camera Camera>
[[nodiscard]] result<calibration<Camera>> calibrate(const basic_map<D>& m, const camera_rig<Camera>& rig,
                                                    const calibration_options& options = {},
                                                    const progress& callback = {});

}  // namespace orbis::slam

#ifndef ORBIS_COMPILED
#include <orbis/slam/calibration-inl.hpp>
#endif
