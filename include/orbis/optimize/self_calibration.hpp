// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment of images from a single camera whose intrinsic parameters are also estimated, with their
/// covariance.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include <orbis/camera/parameters.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>

namespace orbis::optimize {

struct self_calibration_options {
  double bf = 40.0;            ///< value with which `bundle_observation::right` was computed, pixel metres
  std::uint32_t free = ~0U;    ///< bit i is set if parameter i is estimated, in the order of `camera::parameters_of`
  bool keeps_aspect = true;    ///< keeps fx / fy constant if parameters 0 and 1 are both estimated
  int robust_iterations = 20;  ///< maximum number of iterations with all observations
  int iterations = 20;         ///< maximum number of iterations after exclusion of the outliers
  double relative_tolerance = 1e-8;  ///< either stage ends when a step reduces the cost by less than this fraction
};

/// A camera estimated from its images.
template <camera::parametric_camera Camera>
struct self_calibrated {
  using parameter_matrix = matrix<camera::parameters_of<Camera>::count, camera::parameters_of<Camera>::count>;
  Camera camera;
  /// Covariance of the parameters, in the order of `camera::parameters_of`; 0 for those that were not estimated.
  parameter_matrix covariance = zeros<parameter_matrix>();
  std::size_t observations = 0;  ///< number of observations used
  std::size_t outliers = 0;      ///< number of used observations that were excluded at the end
  double initial_rms = 0.0;      ///< RMS residual of the inliers before the adjustment, standard deviations
  double final_rms = 0.0;        ///< RMS residual of the inliers after the adjustment, standard deviations
  int iterations = 0;
};

/// Estimates the camera, poses and points that jointly minimise the reprojection errors of all observations. `poses`
/// (`T_world_camera`) and `points` (world, metres) are initial estimates for the camera `start` and are replaced by the
/// result. The pose of the first image with observations is fixed.
///
/// Observations with depth (`right`) determine the scale of the world. A common scale error of all depths changes only
/// that scale, so it cannot be detected from the images. Points with fewer than two observations, images with fewer
/// than ten, and images not connected to the largest group by common points are excluded and keep their values.
///
/// Errors, all of which leave `poses` and `points` unchanged: `invalid_argument` for observations of nonexistent images
/// or points; `no_data` if there is no usable observation; `degenerate` if the motion of the camera does not determine
/// the parameters, or no observation has depth; `cancelled` if `callback(iteration, iterations)`, which is called
/// before each step, returns false.
///
/// The covariance assumes neither that the errors of a point's observations are independent nor that their size is
/// known: it is computed from the points' contributions to the gradient (a "sandwich" estimator).
///
/// One step takes O(observations + sum over the points of the squared number of images that observe them), plus
/// O(images^3): use at most a few hundred images.
///
/// Sources: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern synthesis", Vision
/// Algorithms 2000; K.-Y. Liang, S. L. Zeger, "Longitudinal data analysis using generalized linear models", Biometrika
/// 73 (1986), for the covariance. The library orbis::compiled contains this function for the library's camera models;
/// for others include self_calibration-inl.hpp.
/// @pre options.bf > 0
template <camera::parametric_camera Camera>
[[nodiscard]] result<self_calibrated<Camera>> self_calibrate(const Camera& start, std::span<se3> poses,
                                                             std::span<vec3> points,
                                                             std::span<const bundle_observation> observations,
                                                             const self_calibration_options& options = {},
                                                             const progress& callback = {});

}  // namespace orbis::optimize

#ifndef ORBIS_COMPILED
#include <orbis/optimize/self_calibration-inl.hpp>
#endif
