// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera as the SLAM system uses it: its model, its image pyramid, and the weight of its depth.
#pragma once

#include <cmath>
#include <utility>

#include <orbis/camera/model.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/pyramid_scales.hpp>

namespace orbis::slam {

/// A camera with the settings that affect observations.
template <camera::camera_model Camera>
struct camera_rig {
  optimize::reprojection<Camera> model;  ///< the camera, and `bf`, which weights depth (see `options::bf`)
  pyramid_scales scales{};               ///< scales of the extractor's image pyramid
  double min_depth = 0.1;                ///< metres; depth outside [min_depth, max_depth] is not used
  double max_depth = 10.0;               ///< metres
  bool scale_is_known = true;            ///< false if no depth is measured: each map has an arbitrary unit of length

  [[nodiscard]] const Camera& camera() const noexcept { return model.camera; }
  /// Returns the standard deviation, in metres, of a depth (metres) measured at a keypoint on a pyramid level.
  [[nodiscard]] double depth_deviation(double depth, int octave) const {
    return depth * depth / model.bf * scales.scale(octave);
  }
};

template <class Camera>
camera_rig(optimize::reprojection<Camera>, pyramid_scales) -> camera_rig<Camera>;

/// Creates the rig of a camera from the settings of a system.
template <camera::camera_model Camera>
[[nodiscard]] camera_rig<Camera> make_rig(Camera camera, const options& settings) {
  return {{std::move(camera), settings.bf},
          {settings.features.levels, static_cast<double>(settings.features.scale_factor)},
          settings.min_depth,
          settings.max_depth,
          settings.scale_is_measured};
}

/// Returns the focal length at the image centre, pixels per radian; 0 if the camera cannot project there.
template <camera::camera_model Camera>
[[nodiscard]] double focal_length(const Camera& camera) {
  matrix<2, 3> j = zeros<matrix<2, 3>>();
  return camera.project(vec3(0.0, 0.0, 1.0), j) ? std::sqrt(std::abs(j(0, 0) * j(1, 1))) : 0.0;
}

}  // namespace orbis::slam
