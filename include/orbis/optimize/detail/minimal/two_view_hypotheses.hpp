// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Hypotheses for the motion between two views, and their support among the matches.
///
/// Distances are in units of the standard deviation of the match.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/LU>

#include <orbis/core/se3.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/so3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/detail/minimal/epipolar_motion.hpp>
#include <orbis/optimize/detail/minimal/essential_estimator.hpp>
#include <orbis/optimize/detail/minimal/homography_estimator.hpp>
#include <orbis/optimize/detail/minimal/horn.hpp>
#include <orbis/optimize/detail/minimal/image_matches.hpp>

namespace orbis::optimize::detail {

/// 95 % quantiles of chi-squared, for distances from a line and from a point.
inline constexpr double line_gate = 3.841, point_gate = 5.991;

[[nodiscard]] inline double square(double x) { return x * x; }

/// Returns the weight of the Geman-McClure loss for a squared residual, given in units of the squared scale of the
/// loss.
[[nodiscard]] inline double geman_mcclure_weight(double squared) {
  const double w = 1.0 / (1.0 + squared);
  return w * w;
}

/// Returns the camera rotation with the largest support among the matches, estimated with weights that decrease with
/// the distance, at successively smaller scales. Returns the identity if there is none.
[[nodiscard]] inline so3 dominant_rotation(const std::vector<image_match>& matches) {
  so3 rotation;
  for (const double scale : {100.0, 50.0, 25.0, 12.0, 6.0, 4.0, 3.0, 3.0, 3.0}) {
    mat3 products = zeros<mat3>();
    const mat3 r = rotation.rotation_matrix();
    for (const image_match& m : matches) {
      const vec3 from = m.first.direction();
      const double weight = geman_mcclure_weight(squared_transfer(r * from, m.second) / (scale * scale));
      if (weight > 0.0) products += weight * normalized(from) * transposed(normalized(m.second.direction()));
    }
    const auto turn = find_best_rotation(products, 1e-12);
    if (!turn) break;
    rotation = so3(turn->quaternion);
  }
  return rotation;
}

/// Minimises Sampson distances by Gauss-Newton with weights that decrease with the distance, at successively smaller
/// scales.
[[nodiscard]] inline std::optional<epipolar_motion> refined_motion(const std::vector<image_match>& matches,
                                                                   epipolar_motion motion,
                                                                   std::span<const double> scales,
                                                                   std::size_t most = ~std::size_t{0}) {
  for (const double scale : scales) {
    epipolar_equations sum;
    const double inverse = 1.0 / (scale * scale);
    const std::size_t n = std::min(most, matches.size());
    for (std::size_t i = 0; i != n; ++i)
      sum.add(motion.e, matches[i], [&](double squared) { return geman_mcclure_weight(squared * inverse); });
    sum.mirror();
    const auto [h, g] = sum.by_motion(motion);
    small_cholesky<5> factors;
    if (!factors.set(h) || !(factors.factor(1e-6) > 0.0)) return std::nullopt;
    matrix<5> step = -factors.solve(g);
    if (!all_finite(step)) return std::nullopt;
    const double size = norm(step);
    if (size > 0.3) step *= 0.3 / size;
    motion = motion.moved(step);
    if (size < 1e-5 && scale == scales.back()) break;
  }
  return motion;
}

/// Agreement of a match with a motion.
enum class agreement : std::uint8_t {
  none,    ///< does not agree
  far,     ///< agrees, with a point at a distance indistinguishable from infinity
  near,    ///< agrees, with a point in front of both cameras
  behind,  ///< rays coplanar with the translation, but not intersecting in front of both cameras
};

/// Support of a motion. `score`: the sum, over the agreeing matches, of the maximum squared distance minus the actual
/// one.
struct motion_support {
  double score = 0.0;
  std::size_t far = 0, near = 0, behind = 0;
  [[nodiscard]] std::size_t inliers() const noexcept { return far + near; }
};

/// Minimum parallax, in standard deviations, at which a point is distinguished from a point at infinity.
inline constexpr double least_disparity = 4.0;

/// Returns the squared distance of the second ray of a match from its expected position for a point at infinite depth.
[[nodiscard]] inline double squared_disparity(const mat3& rotation, const image_match& m) {
  return squared_transfer(rotation * m.first.direction(), m.second);
}

[[nodiscard]] inline agreement classify_match(const mat3& rotation, const vec3& t, const mat3& e, const image_match& m,
                                              double& squared) {
  squared = squared_sampson(e, m);
  if (!(squared < 1.5 * line_gate)) return agreement::none;
  if (squared_disparity(rotation, m) < least_disparity * least_disparity) return agreement::far;
  // t + depth_1 u = depth_2 v.
  const vec3 u = rotation * m.first.direction(), v = m.second.direction();
  const vec3 normal = cross(u, v);
  return dot(cross(v, t), normal) > 0.0 && dot(cross(u, t), normal) > 0.0 ? agreement::near : agreement::behind;
}

/// Returns the contribution of a match to the score of a motion.
[[nodiscard]] inline double score_match(const mat3& rotation, const epipolar_motion& motion, const image_match& m) {
  double squared = 0.0;
  const agreement a = classify_match(rotation, motion.direction, motion.e, m, squared);
  return a == agreement::near || a == agreement::far ? 1.5 * line_gate - squared : 0.0;
}

[[nodiscard]] inline motion_support measure_support(const std::vector<image_match>& matches,
                                                    const epipolar_motion& motion) {
  motion_support sum;
  const mat3 rotation = motion.rotation.rotation_matrix();
  for (const image_match& m : matches) {
    double squared = 0.0;
    switch (classify_match(rotation, motion.direction, motion.e, m, squared)) {
      case agreement::none: continue;
      case agreement::behind: ++sum.behind; continue;
      case agreement::far: ++sum.far; break;
      case agreement::near: ++sum.near; break;
    }
    sum.score += 1.5 * line_gate - squared;
  }
  return sum;
}

/// The scores of a homography and of an essential matrix: sums over the matches in both images. A match whose squared
/// distance is below the gate of the model adds `point_gate` minus the squared distance; other matches add nothing.
/// Source: R. Mur-Artal, J. M. M. Montiel, J. D. Tardos, "ORB-SLAM", T-RO 31 (2015), equations 1 and 2.
struct model_scores {
  double homography = 0.0, essential = 0.0;
  [[nodiscard]] double ratio() const { return homography / std::max(1e-300, homography + essential); }
};
[[nodiscard]] inline model_scores score_models(const std::vector<image_match>& matches, const mat3& forward,
                                               const mat3& backward, const mat3& e) {
  model_scores sum;
  for (const image_match& m : matches) {
    const vec3 first = m.first.direction(), second = m.second.direction();
    for (const double d : {squared_transfer(forward * first, m.second), squared_transfer(backward * second, m.first)})
      if (d < point_gate) sum.homography += point_gate - d;
    const vec3 line = e * first, other = transposed(e) * second;
    const double c = dot(second, line);
    for (const double g : {squared_norm(pixel_gradient(m.second)(line.x(), line.y())),
                           squared_norm(pixel_gradient(m.first)(other.x(), other.y()))})
      if (const double d = c * c / g; d < line_gate) sum.essential += point_gate - d;
  }
  return sum;
}

/// Returns evenly distributed directions on a hemisphere (Fibonacci lattice); the other hemisphere gives the same
/// essential matrices.
template <std::size_t N>
[[nodiscard]] std::array<vec3, N> hemisphere() {
  std::array<vec3, N> out;
  for (std::size_t i = 0; i != N; ++i) {
    const double z = (static_cast<double>(i) + 0.5) / static_cast<double>(N), r = std::sqrt(1.0 - z * z);
    const double turn = static_cast<double>(i) * std::numbers::pi * (3.0 - std::sqrt(5.0));
    out[i] = {r * std::cos(turn), r * std::sin(turn), z};
  }
  return out;
}

}  // namespace orbis::optimize::detail
