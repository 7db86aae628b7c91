// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Refinement of a frame's pose together with the camera motion during its read-out.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>

#include <orbis/camera/model.hpp>
#include <orbis/camera/shutter.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/small_cholesky.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/map/point_observation.hpp>
#include <orbis/slam/detail/shutter/row_equations.hpp>
#include <orbis/slam/detail/shutter/row_times.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

/// The pose of the camera at a time, and its twist at that time.
struct moving_pose {
  se3 T_world_camera;
  vec6 twist = zeros<vec6>();  ///< twist of the camera in its own frame, per second, translation first
};

/// The prior of the twist, independent of the frame's measurements: the mean motion since a previous pose, extrapolated
/// by part of its change, with a standard deviation that allows for the acceleration of a hand-held camera. Without a
/// previous pose, the prior only limits the twist to that of a hand-held camera.
struct twist_prior {
  std::optional<se3> T_world_before{};  ///< the previous pose, if any
  double interval = 0.0;                ///< time since the previous pose, seconds
  double trend = 0.0;                   ///< share of the change since `twist_before` that is added to the mean motion
  vec6 twist_before = zeros<vec6>();    ///< twist at the previous pose; without a previous pose, the expected twist
  double translation_deviation = 0.5;   ///< metres per second
  double rotation_deviation = 1.0;      ///< radians per second

  /// Returns the prior for a time `interval` seconds after a frame. With constant acceleration, a trend of 1 is exact,
  /// but errors in the twist would oscillate indefinitely; a trend of one half damps them. @pre interval > 0
  [[nodiscard]] static twist_prior after(const moving_pose& before, double interval, bool twist_is_known) {
    constexpr double acceleration = 6.0;  // metres or radians per second squared
    const twist_prior unknown;
    const double deviation = 0.5 * acceleration * interval;
    return {before.T_world_camera,
            interval,
            twist_is_known ? 0.5 : 0.0,
            before.twist,
            std::min(deviation, unknown.translation_deviation),
            std::min(deviation, unknown.rotation_deviation)};
  }

  /// Returns the expected twist at a pose.
  [[nodiscard]] vec6 expected(const se3& T_camera_world) const {
    if (!T_world_before) return twist_before;
    const vec6 mean = (T_camera_world * *T_world_before).inverse().log() / interval;
    return mean + trend * (mean - twist_before);
  }
};

/// Returns the mean twist of the camera from one frame to a later one; zero if the second frame is not later.
template <feature_descriptor D>
[[nodiscard]] vec6 motion_between(const basic_frame<D>& before, const basic_frame<D>& after) {
  const double interval = after.timestamp - before.timestamp;
  if (!(interval > 0.0)) return zeros<vec6>();
  return (before.T_world_camera.inverse() * after.T_world_camera).log() / interval;
}

/// Collects a frame's observations of landmarks, using the keypoints as read by the rolling shutter, if available.
/// O(features).
template <feature_descriptor D, camera::camera_model Camera>
void find_row_observations(const basic_frame<D>& f, const basic_map<D>& m, const camera_rig<Camera>& rig,
                           row_lanes& to) {
  to.clear();
  for (std::size_t i = 0; i != f.size(); ++i) {
    if (f.landmarks[i] == no_id) continue;
    const vec3& position = m.landmark_at(f.landmarks[i]).position;
    if (f.as_read.empty()) {
      to.add({landmark_observation(rig, f, i, position)}, rig.model);
      continue;
    }
    const keypoint_as_read& read = f.as_read[i];
    row_observation o;
    o.seen.point = position;
    o.seen.pixel = {static_cast<double>(read.x), static_cast<double>(read.y)};
    if (read.depth > 0.0F) o.seen.right = rig.model.right(o.seen.pixel.x(), static_cast<double>(read.depth));
    o.seen.information = rig.scales.information(f.features.keypoints[i].octave);
    set_spread(o.seen, f.spread(i));
    o.time = f.shutter.color_time(o.seen.pixel.y(), rig.camera().height());
    to.add(o, rig.model);
  }
}

/// Returns the depth of the landmark that keypoint `i` of a frame observes, metres; 0 if there is none.
template <feature_descriptor D>
[[nodiscard]] double landmark_depth(const basic_frame<D>& f, std::size_t i, const basic_map<D>& m) {
  return f.landmarks[i] == no_id ? 0.0 : (f.T_world_camera.inverse() * m.landmark_at(f.landmarks[i]).position).z();
}

/// A cost of measurements other than keypoints, as a quadratic function of pose and twist around `at`. A step consists
/// of a motion of the camera frame (`exp(step) * T_camera_world`) and a change of the twist.
struct pose_quadratic {
  moving_pose at;
  matrix<12, 12> h = zeros<matrix<12, 12>>();
  matrix<12, 1> g = zeros<matrix<12, 1>>();
  double cost = 0.0;

  /// Treats the twist as known, so that the cost no longer depends on it.
  void hold_twist() {
    for (int i = 0; i != 12; ++i)
      for (int k = 6; k != 12; ++k) h(i, k) = h(k, i) = 0.0;
    for (int i = 6; i != 12; ++i) g[i] = 0.0;
  }
};

/// Inputs of pose refinement other than the keypoints.
struct refinement_terms {
  const pose_quadratic* other = nullptr;  ///< an additional cost, or null
  bool moves = true;                      ///< true if the camera moves during read-out; otherwise the twist is fixed
};

/// The normal equations of pose and twist.
struct moving_pose_equations {
  matrix<12, 12> h;
  matrix<12, 1> g;
  double cost = 0.0;  ///< half the robust cost
};

/// Assembles the normal equations of a pose and its twist (`to.h`, `to.g`) from sums: the terms of `h[k]` and `g[k]`
/// are weighted by the k-th power of the negated row time.
template <class Equations>
void set_parts(Equations& to, const std::array<mat6, 3>& h, const std::array<vec6, 2>& g) {
  set_block(to.h, 0, 0, h[0]);
  set_block(to.h, 0, 6, h[1]);
  set_block(to.h, 6, 0, h[1]);
  set_block(to.h, 6, 6, h[2]);
  to.g = stacked(g[0], g[1]);
}

/// Adds the other constraints on pose and twist to the equations of the keypoints, given as sums for each power of the
/// row times (`h`, `g`).
inline void add_terms(moving_pose_equations& e, const std::array<mat6, 3>& h, const std::array<vec6, 2>& g,
                      const se3& T_camera_world, const vec6& twist, const twist_prior& prior,
                      const refinement_terms& terms) {
  set_parts(e, h, g);
  if (terms.other != nullptr) {
    const pose_quadratic& q = *terms.other;
    const matrix<12, 1> step = stacked((T_camera_world * q.at.T_world_camera).log(), twist - q.at.twist);
    const matrix<12, 1> slope = q.h * step;
    e.h += q.h;
    e.g += q.g + slope;
    e.cost += q.cost + dot(step, q.g + 0.5 * slope);
  }
  if (!terms.moves) return;

  const vec6 error = twist - prior.expected(T_camera_world);
  const double by_pose = prior.T_world_before ? (1.0 + prior.trend) / prior.interval : 0.0;  // to first order
  for (int i = 0; i != 6; ++i) {
    const double deviation = i < 3 ? prior.translation_deviation : prior.rotation_deviation;
    const double weight = 1.0 / (deviation * deviation);
    e.cost += 0.5 * weight * error[i] * error[i];
    e.h(i, i) += weight * by_pose * by_pose;
    e.h(i, 6 + i) += weight * by_pose;
    e.h(6 + i, i) += weight * by_pose;
    e.h(6 + i, 6 + i) += weight;
    e.g[i] += weight * by_pose * error[i];
    e.g[6 + i] += weight * error[i];
  }
}

/// Returns the Gauss-Newton step: the motion of the camera frame, then the change of the twist, which is zero unless
/// `moves`.
[[nodiscard]] inline matrix<12, 1> newton_step(const moving_pose_equations& e, bool moves) {
  if (moves) return solve_semidefinite(e.h, matrix<12>(-e.g)).value_or(zeros<matrix<12>>());
  const auto pose = solve_semidefinite(block<6, 6>(e.h, 0, 0), vec6(-head<6>(e.g)));
  return stacked(pose.value_or(zeros<vec6>()), zeros<vec6>());
}

/// Returns the normal equations of pose and twist at a pose. O(observations).
template <camera::camera_model Camera>
[[nodiscard]] moving_pose_equations linearize(const row_lanes& observations,
                                              const optimize::reprojection<Camera>& model, const se3& T_camera_world,
                                              const vec6& twist, const twist_prior& prior,
                                              const refinement_terms& terms = {}) {
  const row_sums sums = sum_rows(observations, model, T_camera_world, twist);
  moving_pose_equations e;
  e.cost = sums.cost;
  add_terms(e, {sums.matrix(0), sums.matrix(1), sums.matrix(2)}, {sums.gradient(0), sums.gradient(1)}, T_camera_world,
            twist, prior, terms);
  return e;
}

/// Returns the diagonal matrix of the squared standard deviations times the square of `factor`.
[[nodiscard]] inline mat6 prior_covariance(const twist_prior& prior, double factor) {
  const double t = factor * prior.translation_deviation, r = factor * prior.rotation_deviation;
  return diagonal_matrix(stacked(filled<vec3>(t * t), filled<vec3>(r * r)));
}

/// The twist used to correct a depth image captured before its frame to the frame's time.
///
/// A twist depends on the poses before and after it, and the pose of the frame depends on depth that was corrected by
/// the twist. If the depth image is captured after the frame, an error of the pose feeds back with the opposite sign
/// and decays; if the depth image is captured before the frame, the pose would oscillate from frame to frame with
/// growing amplitude in directions that pixels hardly determine. Such a depth image is therefore corrected by the
/// refined twist only as far as pixels alone determine it, and otherwise by the previous twist, with the gain of R. E.
/// Kalman, "A new approach to linear filtering and prediction problems", J. Basic Engineering 82 (1960).
class early_depth_twist {
 public:
  /// Computes the gain from the pixels of a frame's observations. Must be called before `between`. O(observations).
  template <camera::camera_model Camera>
  void update(const row_lanes& observations, const optimize::reprojection<Camera>& model, const moving_pose& at,
              const twist_prior& prior) {
    constexpr double share = 0.25;  // share of the information: errors of nearby landmarks are correlated
    const row_sums sums = sum_rows(observations, model, at.T_world_camera.inverse(), at.twist, false);
    // Without observations, the standard deviations are a metre and a radian.
    determine({identity<mat6>() + share * sums.matrix(0), share * sums.matrix(1), share * sums.matrix(2)}, prior);
  }

  /// Returns a twist between those of the previous and the current frame.
  [[nodiscard]] vec6 between(const twist_prior& prior, const vec6& refined) const {
    if (!prior.T_world_before || !all_finite(gain_)) return refined;
    return prior.twist_before + gain_ * (refined - prior.twist_before);
  }

  /// Makes the current frame the previous one.
  void advance() { former_covariance_ = pose_covariance_; }

 private:
  /// Computes the gain from the information of the pixels, given as sums for each power of the row times.
  void determine(const std::array<mat6, 3>& h, const twist_prior& prior) {
    pose_covariance_ = inverse(h[0]);
    if (!prior.T_world_before) return;
    // The prior relates the twist to both poses, and the previous pose is also uncertain.
    const double by_pose = (1.0 + prior.trend) / prior.interval;
    const mat6 tie = inverse(prior_covariance(prior, 1.0) + by_pose * by_pose * former_covariance_);
    const mat6 mixed = h[1] + by_pose * tie;
    const mat6 of_twist = h[2] + tie - transposed(mixed) * inverse(h[0] + by_pose * by_pose * tie) * mixed;
    // The standard deviation of the prior is relative to the mean twist between two frames; from one frame to the next,
    // the twist changes by twice that.
    const mat6 change = prior_covariance(prior, 2.0);
    gain_ = change * inverse(change + inverse(of_twist));
  }

  mat6 pose_covariance_ = zeros<mat6>(), former_covariance_ = zeros<mat6>();  ///< pose covariances from pixels alone
  mat6 gain_ = identity<mat6>();
};

/// Refines pose and twist, or only the pose, by Gauss-Newton steps as long as they reduce the cost. The observations
/// should contain few outliers. O(observations) per step.
template <camera::camera_model Camera>
[[nodiscard]] moving_pose refine_moving_pose(const row_lanes& observations, const optimize::reprojection<Camera>& model,
                                             const moving_pose& start, const twist_prior& prior, int iterations = 5,
                                             const refinement_terms& terms = {}) {
  constexpr double least_gain = 1e-5;  // fraction of the cost
  se3 T_camera_world = start.T_world_camera.inverse();
  vec6 twist = start.twist;
  moving_pose_equations now = linearize(observations, model, T_camera_world, twist, prior, terms);
  for (int k = 0; k != iterations; ++k) {
    const matrix<12, 1> step = newton_step(now, terms.moves);
    if (!all_finite(step)) break;
    const se3 there = se3::exp(head<6>(step)) * T_camera_world;
    const vec6 moving = twist + tail<6>(step);
    const moving_pose_equations then = linearize(observations, model, there, moving, prior, terms);
    if (!(then.cost < now.cost)) break;
    T_camera_world = there;
    twist = moving;
    if (now.cost - then.cost < least_gain * then.cost) break;
    now = then;
  }
  return {T_camera_world.inverse(), twist};
}

}  // namespace orbis::slam::detail
