// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The camera pose from matches between known points and pixels, most of which may be wrong.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/optimize/p3p.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::optimize {

struct pnp_options {
  double threshold = 3.0;  ///< largest reprojection error of an inlier, pixels
  double confidence = 0.9999;
  std::size_t min_iterations = 10;
  std::size_t max_iterations = 10000;
  std::size_t min_inliers = 6;  ///< fewer than this is a failure
  std::uint64_t seed = 1;
};

struct pose_estimate {
  se3 T_world_camera;
  std::vector<std::uint32_t> inliers;  ///< exactly the matches within the threshold at the pose, ascending
  double rmse = 0.0;                   ///< of the inliers' reprojection errors, pixels
  std::size_t iterations = 0;
};

namespace detail {

/// P3P with reprojection errors in pixels, as `ransac` wants it.
template <camera::camera_model Camera>
class pnp_estimator {
 public:
  /// A pose, with its inverse as scoring wants it.
  struct model {
    se3 T_world_camera;
    mat3 rotation;     ///< from the world to the camera
    vec3 translation;  ///< likewise
  };
  static constexpr std::size_t sample_size = 3;

  /// Up to four models.
  struct candidates {
    std::array<model, 4> models;
    std::size_t size = 0;
    [[nodiscard]] const model* begin() const noexcept { return models.data(); }
    [[nodiscard]] const model* end() const noexcept { return models.data() + size; }
  };

  pnp_estimator(std::span<const vec3> points, std::span<const vec2> pixels, const Camera& camera)
      : points_{points}, pixels_{pixels}, residual_{camera, 0.0}, rays_(points.size()) {
    for (std::size_t i = 0; i < points.size(); ++i)
      rays_[i] = camera.unproject(pixels[i]).value_or(vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
  }

  [[nodiscard]] std::size_t size() const noexcept { return points_.size(); }

  [[nodiscard]] candidates fit(const std::array<std::uint32_t, 3>& s) const {
    candidates all;
    for (const se3& pose : p3p({points_[s[0]], points_[s[1]], points_[s[2]]}, {rays_[s[0]], rays_[s[1]], rays_[s[2]]}))
      all.models[all.size++] = with_inverse(pose);
    return all;
  }

  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const auto pixel = residual_.camera.project(vec3(m.rotation * points_[i] + m.translation));
    return pixel ? (*pixel - pixels_[i]).squaredNorm() : std::numeric_limits<double>::infinity();
  }

  [[nodiscard]] std::optional<model> refine(const model& start, std::span<const std::uint32_t> inliers) const {
    observations_.clear();
    for (const std::uint32_t i : inliers) observations_.push_back({.point = points_[i], .pixel = pixels_[i]});
    outliers_.resize(inliers.size());
    constexpr double everything = std::numeric_limits<double>::infinity();
    const auto refined = refine_pose(std::span<const pose_observation>(observations_), residual_, start.T_world_camera,
                                     std::span<std::uint8_t>(outliers_),
                                     {.rounds = 1, .gate_mono = everything, .gate_depth = everything});
    if (!refined.ok()) return std::nullopt;
    return with_inverse(refined.T_world_camera);
  }

 private:
  [[nodiscard]] static model with_inverse(const se3& T_world_camera) {
    const se3 inverse = T_world_camera.inverse();
    return {T_world_camera, inverse.rotation_matrix(), inverse.translation()};
  }

  std::span<const vec3> points_;
  std::span<const vec2> pixels_;
  reprojection<Camera> residual_;
  std::vector<vec3> rays_;
  mutable std::vector<pose_observation> observations_;  // room that each refinement uses again
  mutable std::vector<std::uint8_t> outliers_;
};

}  // namespace detail

/// The pose from which the most of `points_world[i]` appear at `pixels[i]`: P3P in RANSAC, each new
/// best pose refined on its inliers. Matches that are not finite are outliers; a pixel that the camera cannot
/// un-project is never drawn. Deterministic by `options.seed`.
/// Errors: `invalid_argument` for spans of different length or options out of range, `no_data` below
/// three matches, `degenerate` where no pose has `min_inliers` inliers.
template <camera::camera_model Camera>
[[nodiscard]] result<pose_estimate> estimate_pose(std::span<const vec3> points_world, std::span<const vec2> pixels,
                                                  const Camera& camera, const pnp_options& options = {}) {
  if (points_world.size() != pixels.size())
    return fail(errc::invalid_argument, "pnp", "the lists of points and pixels differ in length");
  const detail::pnp_estimator<Camera> estimator(points_world, pixels, camera);
  auto found = ransac(estimator, {.threshold = options.threshold,
                                  .confidence = options.confidence,
                                  .min_iterations = options.min_iterations,
                                  .max_iterations = options.max_iterations,
                                  .min_inliers = options.min_inliers,
                                  .seed = options.seed});
  if (!found) return fail(found.error());
  double sum = 0.0;
  for (const std::uint32_t i : found->inliers) sum += estimator.squared_error(found->model, i);
  const double rmse = std::sqrt(sum / static_cast<double>(found->inliers.size()));
  return pose_estimate{found->model.T_world_camera, std::move(found->inliers), rmse, found->iterations};
}

}  // namespace orbis::optimize
