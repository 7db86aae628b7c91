// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The similarity transform between two cameras, each with its own unit of length, that observe common points.
///
/// Without a depth sensor, the accuracy of a point's depth depends on its parallax: the error of a pair is therefore
/// its reprojection error, not the distance between its points.
///
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM: a versatile and accurate monocular SLAM system",
/// T-RO 31 (2015), section VII.B.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/core/sim3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/alignment.hpp>
#include <orbis/optimize/ransac.hpp>

namespace orbis::slam::detail {

/// A point with its observation by a camera.
struct known_point {
  vec3 position = zeros<vec3>();  ///< in the camera frame, in that camera's unit of length
  vec2 pixel = zeros<vec2>();     ///< observed position
  double information = 1.0;       ///< 1 / sigma^2 of the pixel, in 1 / pixel^2
};

/// The RANSAC estimator of the similarity that transforms points from one camera to another. The error of a pair is the
/// larger reprojection error of its two points in the other image, in standard deviations of a pixel.
template <camera::camera_model Camera>
class scaled_alignment {
 public:
  struct pair {
    known_point from, to;
    double weight = 1.0;  ///< 1 / variance of the distance between the aligned points
  };
  struct model {
    sim3 T_to_from, T_from_to;
  };
  static constexpr std::size_t sample_size = 3;

  /// @pre the pairs are in random order
  scaled_alignment(const Camera& camera, std::vector<pair> pairs) : camera_{camera}, pairs_{std::move(pairs)} {}

  [[nodiscard]] std::size_t size() const noexcept { return pairs_.size(); }
  [[nodiscard]] optimize::one_or_none<model> fit(const std::array<std::uint32_t, sample_size>& sample) const {
    return {fit_to(sample)};
  }
  [[nodiscard]] std::optional<model> refine(const model&, std::span<const std::uint32_t> inliers) const {
    return fit_to(inliers);
  }
  [[nodiscard]] double squared_error(const model& m, std::size_t i) const {
    const pair& p = pairs_[i];
    return std::max(reprojected(m.T_to_from * p.from.position, p.to), reprojected(m.T_from_to * p.to.position, p.from));
  }

 private:
  [[nodiscard]] double reprojected(const vec3& point, const known_point& seen) const {
    const auto pixel = point.z() > 0.0 ? camera_.project(point) : std::nullopt;
    return pixel ? seen.information * squared_norm(*pixel - seen.pixel) : std::numeric_limits<double>::infinity();
  }
  [[nodiscard]] std::optional<model> fit_to(std::span<const std::uint32_t> indices) const {
    std::vector<vec3> from, to;
    std::vector<double> weights;
    for (const std::uint32_t i : indices) {
      from.push_back(pairs_[i].from.position);
      to.push_back(pairs_[i].to.position);
      weights.push_back(pairs_[i].weight);
    }
    const auto found = optimize::absolute_orientation_with_scale(from, to, weights);
    if (!found || !(found->scale() > 0.0)) return std::nullopt;
    return model{*found, found->inverse()};
  }

  const Camera& camera_;
  std::vector<pair> pairs_;
};

}  // namespace orbis::slam::detail
