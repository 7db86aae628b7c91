// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation of a camera's read-out time, and of the delay of its depth image, from the frames.
///
/// A point observed by a keyframe and a frame is projected from one into the other; its error depends on read-out and
/// delay in a known way, because the motion of the camera is known from the poses before and after each frame. For each
/// pair, the relative pose, which would explain part of the error, is eliminated; two linear equations remain, which
/// are summed over all pairs. The standard deviation of the solution is estimated from the variation of the sums per
/// keyframe, because the errors of pairs with a common keyframe are not independent.
///
/// Sources: read-out from motion: P.-E. Forssen, E. Ringaby, "Rectifying rolling shutter video from hand-held devices",
/// CVPR 2010; standard deviations from sums over clusters: K.-Y. Liang, S. L. Zeger, "Longitudinal data analysis using
/// generalized linear models", Biometrika 73 (1986).
#pragma once

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/shutter_estimate.hpp>

namespace orbis::slam::detail {

/// The keypoints of a frame that observe landmarks, as read, with the frame's motion estimated from the neighbouring
/// frames.
struct row_view {
  se3 T_world_camera;
  camera::shutter shutter{};
  vec6 twist = zeros<vec6>();
  std::vector<keypoint_as_read> read;
  std::vector<landmark_id> landmarks;  ///< landmark of each keypoint, in ascending order
  std::vector<double> information;     ///< for each keypoint: 1 / variance of the pixel
};

/// Linear equations `h * (read-out, delay) = c`.
struct shutter_equations {
  matrix<2, 2> h = zeros<matrix<2, 2>>();
  vec2 c = zeros<vec2>();
};

/// The sum of `w J^T J` over points `q` in the camera frame. `J = [B, -B hat(q)]` is the derivative of a residual with
/// respect to a motion of that frame (`exp(step) * q`), and `B` that with respect to the point.
struct motion_sums {
  mat3 translation = zeros<mat3>();  ///< w B^T B
  mat3 mixed = zeros<mat3>();        ///< w B^T B hat(q)
  mat3 rotation = zeros<mat3>();     ///< w hat(q)^T B^T B hat(q)

  /// The terms of one point. `information`: `w B^T B`.
  [[nodiscard]] static motion_sums of_point(const mat3& information, const vec3& q) {
    const mat3 turn = hat<double>(q), mixed = information * turn;
    return {information, mixed, mat3(-turn * mixed)};
  }
  motion_sums& operator+=(const motion_sums& other) {
    translation += other.translation, mixed += other.mixed, rotation += other.rotation;
    return *this;
  }
  [[nodiscard]] mat6 matrix() const {
    mat6 out;
    set_block(out, 0, 0, translation);
    set_block(out, 0, 3, mat3(-mixed));
    set_block(out, 3, 0, mat3(-transposed(mixed)));
    set_block(out, 3, 3, rotation);
    return out;
  }
};

/// The gradient `w J^T r` for the `J` of `motion_sums`. `by_point`: `w B^T r`.
[[nodiscard]] inline vec6 by_motion(const vec3& by_point, const vec3& q) {
  return stacked(by_point, cross(q, by_point));
}

/// Eliminates the relative pose from the equations and the gradient; returns false if the points do not determine it.
[[nodiscard]] inline bool eliminate_pose(shutter_equations& e, vec2& gradient, const mat6& pose,
                                         const matrix<6, 2>& mixed, const vec6& pose_gradient) {
  const matrix<6, 2> solved = inverse(pose) * mixed;
  if (!all_finite(solved)) return false;
  e.h -= transposed(mixed) * solved;
  gradient -= transposed(solved) * pose_gradient;
  return true;
}

/// Returns the equations of the points that two views share; empty if there are too few. `shutter`: the shutter assumed
/// when `depth` of the keypoints was read; the equations are linearised around it. O(keypoints).
/// @pre the landmarks of both views are in ascending order
template <camera::camera_model Camera>
[[nodiscard]] std::optional<shutter_equations> build_shutter_equations(const row_view& from, const row_view& to,
                                                                       const camera_rig<Camera>& rig,
                                                                       const camera::shutter& shutter) {
  assert(std::is_sorted(from.landmarks.begin(), from.landmarks.end()) &&
         std::is_sorted(to.landmarks.begin(), to.landmarks.end()));
  constexpr std::size_t enough = 30;
  constexpr double width = 3.5;  // of the Huber loss: both keypoints have errors
  const int height = rig.camera().height();
  const auto share = [&](float v) {
    return camera::shutter{.color_read_out = 1.0}.color_time(static_cast<double>(v), height);
  };
  const auto speed = [](const vec6& twist, const vec3& p) {
    return vec3(cross(vec3(twist[3], twist[4], twist[5]), p) + vec3(twist[0], twist[1], twist[2]));
  };
  const se3 T_to_from = to.T_world_camera.inverse() * from.T_world_camera;
  motion_sums pose;
  matrix<6, 2> mixed = zeros<matrix<6, 2>>();
  vec6 pose_gradient = zeros<vec6>();
  shutter_equations e;
  vec2 gradient = zeros<vec2>();
  std::size_t count = 0;
  for (std::size_t i = 0, j = 0; i != to.read.size(); ++i) {
    while (j != from.read.size() && from.landmarks[j] < to.landmarks[i]) ++j;
    if (j == from.read.size()) break;
    if (from.landmarks[j] != to.landmarks[i] || !(from.read[j].depth > 0.0F)) continue;
    const keypoint_as_read& a = from.read[j];
    const keypoint_as_read& b = to.read[i];
    const vec3 ray(a.ray_x, a.ray_y, 1.0);
    const vec3 there = moved_by(from.twist, shutter.color_read_out * share(a.y), static_cast<double>(a.depth) * ray);
    const vec3 q = moved_by(to.twist, -shutter.color_read_out * share(b.y), T_to_from * there);
    optimize::pose_observation o;
    o.pixel = {static_cast<double>(b.x), static_cast<double>(b.y)};
    if (b.depth > 0.0F) o.right = rig.model.right(o.pixel.x(), static_cast<double>(b.depth));
    mat3 by_point;
    const auto r = rig.model.residual(q, o, by_point);
    if (!r) continue;
    const double information = std::min(from.information[j], to.information[i]);
    const double error = std::sqrt(squared_norm(*r) * information);
    const double weight = information * (error <= width ? 1.0 : width / error);
    const depth_change change_a = a.change.if_even(a.depth), change_b = b.change.if_even(b.depth);
    matrix<3, 2> by_shutter;
    set_column(
        by_shutter, 0,
        by_point * (T_to_from.rotation() * (share(a.y) * speed(from.twist, there)) - share(b.y) * speed(to.twist, q)));
    set_column(by_shutter, 1, by_point * (T_to_from.rotation() * (change_a.rate() * ray)));
    const double z = static_cast<double>(b.depth);
    const double by_depth = o.has_depth() ? rig.model.bf / (z * z) : 0.0;  // derivative of the measured depth
    by_shutter(2, 1) -= by_depth * change_b.rate();
    const mat3 weighted = weight * transposed(by_point);
    const matrix<3, 2> by_both = weighted * by_shutter;
    pose += motion_sums::of_point(weighted * by_point, q);
    for (int k = 0; k != 2; ++k) set_column(mixed, k, vec6(column_of(mixed, k) + by_motion(column_of(by_both, k), q)));
    pose_gradient += by_motion(weighted * *r, q);
    e.h += weight * (transposed(by_shutter) * by_shutter);
    gradient += weight * (transposed(by_shutter) * *r);
    ++count;
    // Depth is noisy, and so is its rate: the square of the rate would be biased upwards, and the delay underestimated.
    // The parabola through the squared errors of three readings with equal noise does not have this bias.
    const auto moved = [&](float in_a, float in_b) {
      const vec3 row = row_of(by_point, 2);
      return (*r)[2] + dot(row, T_to_from.rotation() * vec3(static_cast<double>(in_a) * ray)) -
             by_depth * static_cast<double>(in_b);
    };
    const auto squared = [](double x) { return x * x; };
    const double now = squared((*r)[2]), later = squared(moved(change_a.later, change_b.later)),
                 earlier = squared(moved(change_a.earlier, change_b.earlier));
    constexpr double step = depth_change::step;
    e.h(1, 1) += weight * ((later + earlier - 2.0 * now) / (2.0 * step * step) - squared(by_shutter(2, 1)));
    gradient[1] += weight * ((later - earlier) / (4.0 * step) - by_shutter(2, 1) * (*r)[2]);
  }
  if (count < enough) return std::nullopt;
  if (!eliminate_pose(e, gradient, pose.matrix(), mixed, pose_gradient)) return std::nullopt;
  e.c = e.h * vec2(shutter.color_read_out, shutter.depth_delay) - gradient;
  return e;
}

/// Sums the equations of a run and decides which components are significant.
template <class = void>
class basic_shutter_estimator {
 public:
  /// Adds the equations of a pair with a keyframe. O(keyframes added since).
  void add(map_keyframe keyframe, const shutter_equations& e) {
    auto at = std::find_if(blocks_.rbegin(), blocks_.rend(), [&](const auto& b) { return b.first == keyframe; });
    if (at == blocks_.rend()) {
      blocks_.emplace_back(keyframe, shutter_equations{});
      at = blocks_.rbegin();
    }
    at->second.h += e.h;
    at->second.c += e.c;
  }
  /// Discards all equations, after a change of the shutter for which they were built.
  void clear() { blocks_.clear(); }

  /// Returns the current estimate. The threshold for revising an assumed value is lower than that for adopting a new
  /// one; an assumed value that agrees with an insignificant estimate is kept. O(keyframes).
  [[nodiscard]] shutter_estimate estimate(const camera::shutter& assumed = {}) const {
    constexpr std::size_t enough = 8;
    // Errors of the velocity bias the estimates by up to these shares, as simulations show.
    constexpr double read_out_bias = 0.02, delay_bias = 0.1;
    shutter_estimate result{.shutter = assumed};
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
    const auto deviation = [](double variance, double bias) {
      return std::sqrt(std::max(0.0, variance) + bias * bias);
    };
    result.read_out_deviation = deviation(covariance(0, 0), read_out_bias * found[0]);
    if (tells_delay) {
      result.delay = found[1];
      result.delay_deviation = deviation(covariance(1, 1), delay_bias * found[1]);
    }
    const auto choose = [](double value, double deviation, double before, double least, double most) {
      constexpr double adopting = 5.0, revising = 2.5;  // standard deviations
      const double sigmas = before == 0.0 ? adopting : revising;
      if (std::abs(value) > sigmas * deviation)
        return std::abs(value) >= least && std::abs(value) <= most ? value : 0.0;
      return std::abs(value - before) <= revising * deviation ? before : 0.0;
    };
    // Shorter read-out times have no relevant effect, and no camera has longer ones.
    result.shutter.color_read_out = result.shutter.depth_read_out =
        std::max(0.0, choose(result.read_out, result.read_out_deviation, assumed.color_read_out, 0.003, 0.07));
    result.shutter.depth_delay = choose(result.delay, result.delay_deviation, assumed.depth_delay, 0.003, 0.05);
    return result;
  }

 private:
  std::vector<std::pair<map_keyframe, shutter_equations>> blocks_;
};
using shutter_estimator = basic_shutter_estimator<>;

}  // namespace orbis::slam::detail
