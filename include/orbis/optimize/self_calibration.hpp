// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Bundle adjustment of images that one camera has taken, with the intrinsic parameters of that camera among the
/// unknowns, and how well they are determined.
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
  double bf = 40.0;            ///< that `bundle_observation::right` was computed with, pixel metres
  std::uint32_t free = ~0U;    ///< bit i: parameter i, in the order of `camera::parameters_of`, is estimated
  bool keeps_aspect = true;    ///< parameters 0 and 1, if both are estimated, change in proportion: fx / fy is known
  int robust_iterations = 20;  ///< with all observations, at most
  int iterations = 20;         ///< without the outliers, at most
  double relative_tolerance = 1e-8;  ///< either ends when a step lowers the cost by less than this share
};

/// A camera as the images tell of it.
template <camera::parametric_camera Camera>
struct self_calibrated {
  using parameter_matrix = matrix<camera::parameters_of<Camera>::count, camera::parameters_of<Camera>::count>;
  Camera camera;
  /// Of the parameters, in the order of `camera::parameters_of`; 0 for those that were not estimated.
  parameter_matrix covariance = zeros<parameter_matrix>();
  std::size_t observations = 0;  ///< that took part
  std::size_t outliers = 0;      ///< of these, left out in the end
  double initial_rms = 0.0;      ///< of the observations that are no outliers, in standard deviations, before ...
  double final_rms = 0.0;        ///< ... and after
  int iterations = 0;
};

/// The camera, poses and points that together best explain all observations. `poses` (`T_world_camera`) and `points`
/// (world, metres) come in as estimates for the camera `start` and are brought to those of the result. The pose of the
/// first image with observations is held.
///
/// Observations with depth (`right`) fix the size of the world. A wrong scale of all depths changes nothing but that
/// size, so that images alone do not tell of it. Points with fewer than two observations take no part, nor do images
/// with fewer than ten, nor those that no common points join to the most; their poses stay.
///
/// Errors, which leave `poses` and `points` as they were: `invalid_argument` for observations of images or points that
/// there are not; `no_data` without an observation that can be used; `degenerate` if the motion of the camera does not
/// determine the parameters, or no observation has depth; `cancelled` if `callback(iteration, iterations)`, which is
/// asked before each step, says so.
///
/// The covariance does not take the errors of a point's observations for independent of each other, nor their size for
/// known: it is made of the points' own contributions to the gradient ("sandwich" of the normal equations).
///
/// O(observations + sum over the points of the squared number of images that see them) for one step, and
/// O(images^3): choose some hundred images at most.
///
/// Sources: B. Triggs, P. McLauchlan, R. Hartley, A. Fitzgibbon, "Bundle adjustment - a modern synthesis", Vision
/// Algorithms 2000; K.-Y. Liang, S. L. Zeger, "Longitudinal data analysis using generalized linear models", Biometrika
/// 73 (1986), for the covariance.
/// The library orbis::compiled holds it for the camera models of the library; for others, its users include
/// self_calibration-inl.hpp.
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
