// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of shutter_estimation.hpp that no camera enters: inline, or, with ORBIS_COMPILED, compiled once, by
/// cmake/compiled/slam_motion.cpp.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

#include <Eigen/LU>

#include <orbis/camera/shutter.hpp>
#include <orbis/core/compiled_once.hpp>
#include <orbis/core/types.hpp>
#include <orbis/slam/detail/shutter/shutter_estimation.hpp>
#include <orbis/slam/shutter_estimate.hpp>

namespace orbis::slam::detail {

ORBIS_COMPILED_ONCE bool eliminate_pose(shutter_equations& e, vec2& gradient, const mat6& pose,
                                        const matrix<6, 2>& mixed, const vec6& pose_gradient) {
  const matrix<6, 2> solved = inverse(pose) * mixed;
  if (!all_finite(solved)) return false;
  e.h -= transposed(mixed) * solved;
  gradient -= transposed(solved) * pose_gradient;
  return true;
}

ORBIS_COMPILED_ONCE shutter_estimate shutter_estimator::estimate(const camera::shutter& assumed) const {
  constexpr std::size_t enough = 8;
  shutter_estimate result;
  if (blocks_.size() < enough) return result;
  shutter_equations sum;
  for (const auto& [id, e] : blocks_) {
    sum.h += e.h;
    sum.c += e.c;
  }
  if (!(sum.h(0, 0) > 0.0)) return result;
  const bool tells_delay = sum.h(1, 1) > 0.0 && determinant(sum.h) > 0.0;
  matrix<2, 2> inverse = zeros<matrix<2, 2>>();
  if (tells_delay)
    inverse = orbis::inverse(sum.h);
  else
    inverse(0, 0) = 1.0 / sum.h(0, 0);
  const vec2 found = inverse * sum.c;
  matrix<2, 2> spread = zeros<matrix<2, 2>>();
  for (const auto& [id, e] : blocks_) {
    const vec2 apart = e.h * found - e.c;
    spread += apart * transposed(apart);
  }
  const auto n = static_cast<double>(blocks_.size());
  const matrix<2, 2> covariance = n / (n - 1.0) * (inverse * spread * inverse);
  if (!all_finite(found) || !all_finite(covariance)) return result;
  result.read_out = found[0];
  result.read_out_deviation = std::sqrt(std::max(0.0, covariance(0, 0)));
  if (tells_delay) {
    result.delay = found[1];
    result.delay_deviation = std::sqrt(std::max(0.0, covariance(1, 1)));
  }
  const auto holds = [](double value, double deviation, double before, double least, double most) {
    const double sigmas = before == 0.0 ? 5.0 : 2.5;
    return std::abs(value) > sigmas * deviation && std::abs(value) >= least && std::abs(value) <= most;
  };
  // A shorter read-out does no harm worth the trouble, and no camera needs longer for an image.
  if (result.read_out > 0.0 && holds(result.read_out, result.read_out_deviation, assumed.color_read_out, 0.003, 0.07))
    result.shutter.color_read_out = result.shutter.depth_read_out = result.read_out;
  if (holds(result.delay, result.delay_deviation, assumed.depth_delay, 0.003, 0.05))
    result.shutter.depth_delay = result.delay;
  return result;
}

}  // namespace orbis::slam::detail
