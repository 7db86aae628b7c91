// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What a keypoint of a frame says about the point that it shows.
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/slam/detail/map/landmark_search.hpp>

namespace orbis::slam::detail {

/// The observation of `point` by keypoint `i` of a frame.
template <camera::camera_model Camera>
[[nodiscard]] optimize::pose_observation observation_of(const optimize::reprojection<Camera>& model,
                                                        const pyramid_scales& scales, const frame& f, std::size_t i,
                                                        const vec3& point) {
  optimize::pose_observation o;
  o.point = point;
  o.pixel = f.pixel(i);
  if (f.has_depth(i)) o.right = model.right(o.pixel.x(), static_cast<double>(f.depth[i]));
  o.information = scales.information(f.features.keypoints[i].octave);
  return o;
}

/// What 95 % of the true squared errors stay below, in deviations: those of two coordinates, or of three with depth.
[[nodiscard]] constexpr double error_limit(bool has_depth) noexcept {
  return optimize::chi_squared_gate(has_depth ? 3 : 2);
}

/// Notes which observations of an adjustment disagree with what it has come to. `squared` is memory for it.
template <class Adjuster>
void find_outliers(Adjuster& adjuster, std::span<const se3> poses, std::span<const vec3> points,
                   std::span<const optimize::bundle_observation> observations, std::vector<double>& squared,
                   std::vector<std::uint8_t>& outliers) {
  squared.resize(observations.size());
  outliers.resize(observations.size());
  adjuster.chi2(poses, points, observations, squared);
  for (std::size_t i = 0; i != observations.size(); ++i)
    outliers[i] = squared[i] > error_limit(!std::isnan(observations[i].right)) ? 1 : 0;
}

/// Whether keypoint `i` of a frame may show `point` (in the world): the reprojection error is one that 95 % of the true
/// ones stay below, with depth or without.
template <camera::camera_model Camera>
[[nodiscard]] bool agrees(const optimize::reprojection<Camera>& model, const pyramid_scales& scales, const frame& f,
                          const se3& T_camera_world, std::size_t i, const vec3& point) {
  const optimize::pose_observation o = observation_of(model, scales, f, i, point);
  const auto error = model.residual(T_camera_world * point, o);
  return error && error->squaredNorm() * o.information <= error_limit(o.has_depth());
}

}  // namespace orbis::slam::detail
