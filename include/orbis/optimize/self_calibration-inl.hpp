// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Implementation of self_calibration.hpp.
#pragma once

#include <cassert>
#include <string>

#include <orbis/optimize/detail/bundle/shared_intrinsics.hpp>
#include <orbis/optimize/self_calibration.hpp>

namespace orbis::optimize {

template <camera::parametric_camera Camera>
result<self_calibrated<Camera>> self_calibrate(const Camera& start, std::span<se3> poses, std::span<vec3> points,
                                               std::span<const bundle_observation> observations,
                                               const self_calibration_options& options, const progress& callback) {
  constexpr const char* where = "self-calibration";
  assert(options.bf > 0.0);
  for (std::size_t k = 0; k != observations.size(); ++k)
    if (observations[k].pose >= poses.size() || observations[k].point >= points.size())
      return fail(errc::invalid_argument, where,
                  "observation " + std::to_string(k) + " refers to a nonexistent image or point");
  detail::shared_intrinsics<Camera> problem{start, options.bf, options.free, options.keeps_aspect,
                                            poses, points,     observations};
  if (problem.observations() == 0)
    return fail(errc::no_data, where, "no point is observed by two images: the camera has hardly moved");
  if (!problem.has_depth()) return fail(errc::degenerate, where, "no observation has depth");
  self_calibrated<Camera> found{start};
  const int total = options.robust_iterations + options.iterations;
  const auto go_on = [&] {
    return callback(static_cast<std::size_t>(found.iterations), static_cast<std::size_t>(total));
  };
  for (const int limit : {options.robust_iterations, options.iterations}) {
    if (!problem.descend(limit, options.relative_tolerance, found.iterations, go_on))
      return fail(errc::cancelled, where, "cancelled");
    problem.update_outliers();
    if (!problem.has_depth()) return fail(errc::degenerate, where, "no observation with depth agrees with the others");
  }
  if (!problem.covariance(found.covariance))
    return fail(errc::degenerate, where, "the motion of the camera does not determine its parameters");
  found.camera = problem.camera();
  found.observations = problem.observations();
  found.outliers = problem.outliers();
  found.final_rms = problem.rms();
  found.initial_rms = problem.residual_rms(start, poses, points);
  problem.write(poses, points);
  return found;
}

}  // namespace orbis::optimize
