// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The parts of a bundle adjustment problem: observations, the concept of a residual, options and summary.
#pragma once

#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/types.hpp>

namespace orbis::optimize {

/// Observation of the point `point` by the camera `pose`; both are indices into the caller's arrays.
struct bundle_observation {
  std::uint32_t pose = 0;
  std::uint32_t point = 0;
  vec2 pixel = zeros<vec2>();
  double right = std::numeric_limits<double>::quiet_NaN();  ///< see `pose_observation`; NaN if there is no depth
  double information = 1.0;                                 ///< 1 / sigma^2 of the pixel, in 1 / pixel^2
  double depth_weight = 1.0;                                ///< see `pose_observation`
  vec2 smear = zeros<vec2>();                               ///< see `pose_observation`; for `reprojection` only
  [[nodiscard]] bool has_depth() const noexcept { return !std::isnan(right); }
};

/// Manifold of a camera state: the type of the state and the effect of a step. `m.retract(p, d)` is the state to
/// which the step `d` leads from `p`, with `retract(p, 0) == p`. A step has `M::dimension` entries.
template <class M>
concept camera_manifold = std::copyable<M> &&
    requires(const M& m, const typename M::point& p, const typename M::tangent& d) {
  { m.retract(p, d) } -> std::same_as<typename M::point>;
  requires std::same_as<typename M::tangent, matrix<M::dimension>>;
};

/// A Lie group whose steps are applied on the right: `T * exp(d)`. For a pose `T_world_camera`, the step is in the
/// camera frame.
template <class T>
struct lie_group {
  using point = T;
  using tangent = typename T::tangent;
  static constexpr int dimension = T::dof;
  [[nodiscard]] static point retract(const point& p, const tangent& d) { return p * T::exp(d); }
};

/// An observation refers to its camera `pose` and its `point` by index. `information` is 1 / sigma^2, the weight of its
/// squared residual.
template <class O>
concept observation_of_a_point = std::copyable<O> && requires(const O& o) {
  { o.pose } -> std::convertible_to<std::uint32_t>;
  { o.point } -> std::convertible_to<std::uint32_t>;
  { o.information } -> std::convertible_to<double>;
};

/// The residual of one observation of a point by a camera.
///
/// - `R::camera_state` is the estimated state of each camera (a pose, or a pose with intrinsics); `R::camera_manifold`
///   defines its steps;
/// - `r.prepare(state)` computes an `R::view`, the values shared by all observations by one camera; it is called once
///   per camera and linearisation;
/// - `r.is_usable(o)` is false for an observation that must be excluded, for example a non-finite one;
/// - `r.residual(view, point, o)` is a vector of `R::dimension` numbers, not yet whitened, or empty if the point has no
///   projection. `point` is in the world frame;
/// - `r.linearize(view, point, o, by_camera, by_point)` returns the same vector and writes its derivatives with respect
///   to a step of the camera and to the point.
template <class R>
concept bundle_residual = std::copyable<R> && camera_manifold<typename R::camera_manifold> &&
    observation_of_a_point<typename R::observation> &&
    std::same_as<typename R::camera_manifold::point, typename R::camera_state> &&
    requires(const R& r, const typename R::camera_state& state, const typename R::view& view, const vec3& point,
             const typename R::observation& o, matrix<R::dimension, R::camera_manifold::dimension>& by_camera,
             matrix<R::dimension, 3>& by_point) {
  { r.prepare(state) } -> std::same_as<typename R::view>;
  { r.is_usable(o) } -> std::same_as<bool>;
  { r.residual(view, point, o) } -> std::same_as<std::optional<matrix<R::dimension>>>;
  { r.linearize(view, point, o, by_camera, by_point) } -> std::same_as<std::optional<matrix<R::dimension>>>;
};

/// A residual that depends on the point only through its coordinates q in the camera frame. Its camera state is a pose
/// with steps `T_world_camera * exp(d)`, followed by `R::intrinsic_dimension` more parameters. All derivatives are then
/// products of the derivative with respect to q with R_camera_world and with (-I, hat(q)), which halves the solver's
/// arithmetic. The view has the members `rotation` (R_camera_world) and `translation`.
template <class R>
concept camera_frame_residual =
    bundle_residual<R> && R::camera_manifold::dimension ==
    6 + R::intrinsic_dimension&& requires(const R& r, const typename R::view& view, const vec3& q,
                                          const typename R::observation& o, matrix<R::dimension, 3>& by_q,
                                          matrix<R::dimension, R::intrinsic_dimension>& by_intrinsics) {
  { view.rotation } -> std::convertible_to<mat3>;
  { view.translation } -> std::convertible_to<vec3>;
  { r.residual_in_camera(view, q, o) } -> std::same_as<std::optional<matrix<R::dimension>>>;
  { r.linearize_in_camera(view, q, o, by_q, by_intrinsics) } -> std::same_as<std::optional<matrix<R::dimension>>>;
};

/// Options of bundle adjustment. The damping fixes the directions that are determined neither by the observations nor
/// by the fixed poses and points (the gauge: overall position and rotation and, without depth, scale).
struct bundle_options {
  int max_iterations = 10;
  double relative_tolerance = 1e-6;              ///< stop when a step reduces the cost by less than this fraction
  double gradient_tolerance = 0.0;               ///< stop when no gradient entry exceeds this
  std::span<const std::uint8_t> fixed_poses{};   ///< empty, or one entry per pose: nonzero keeps the pose fixed
  std::span<const std::uint8_t> fixed_points{};  ///< empty, or one entry per point: nonzero keeps the point fixed
  std::span<const std::uint8_t> ignored{};       ///< empty, or one entry per observation: nonzero excludes it
};

enum class bundle_status {
  converged,
  iteration_limit,
  cancelled,
  no_progress,       ///< no step reduces the cost, although the model predicts a decrease
  nothing_to_do,     ///< no usable observation, or every pose and point is fixed
  missing_pose,      ///< observation `where` refers to a nonexistent pose
  missing_point,     ///< observation `where` refers to a nonexistent point
  bad_pose,          ///< pose `where` has observations and is not finite
  undetermined_pose  ///< pose `where`, or a point it observes, is neither determined by the observations nor damped
};

/// Returns true if the input is invalid. The caller's arrays are then unchanged, except for steps taken before
/// `undetermined_pose` was detected.
[[nodiscard]] constexpr bool is_failure(bundle_status status) noexcept { return status >= bundle_status::missing_pose; }

/// Returns the status as text.
[[nodiscard]] constexpr std::string_view to_string(bundle_status status) noexcept {
  switch (status) {
    case bundle_status::converged: return "converged";
    case bundle_status::iteration_limit: return "iteration limit";
    case bundle_status::cancelled: return "cancelled";
    case bundle_status::no_progress: return "no progress";
    case bundle_status::nothing_to_do: return "nothing to do";
    case bundle_status::missing_pose: return "an observation refers to a nonexistent pose";
    case bundle_status::missing_point: return "an observation refers to a nonexistent point";
    case bundle_status::bad_pose: return "a pose is not finite";
    case bundle_status::undetermined_pose: return "a pose is not determined by the observations";
  }
  return "unknown";
}

/// Time spent in each stage, seconds.
struct bundle_times {
  double set_up = 0.0;           ///< checks, ordering and structure of the reduced system
  double linearize = 0.0;        ///< residuals, Jacobians, normal equations
  double schur = 0.0;            ///< elimination of the points
  double factor = 0.0;           ///< factorisation of the reduced system
  double solve = 0.0;            ///< solution of the reduced system
  double back_substitute = 0.0;  ///< steps of the points
  double evaluate = 0.0;         ///< cost of each attempted step
};

struct bundle_summary {
  bundle_status status = bundle_status::nothing_to_do;
  std::size_t where = 0;           ///< index of the observation or pose that caused a failure
  double initial_cost = 0.0;       ///< half the sum of the robust loss over the observations
  double final_cost = 0.0;         ///< never above `initial_cost`
  double gradient = 0.0;           ///< largest gradient entry at the start of the last step
  int iterations = 0;              ///< accepted steps
  int steps_tried = 0;             ///< accepted and rejected steps
  int linear_iterations = 0;       ///< iterations of an iterative solver of the reduced system
  std::size_t observations = 0;    ///< number of observations used
  std::size_t left_out = 0;        ///< number of observations that are not finite or have no projection at the start
  std::size_t first_left_out = 0;  ///< index of the first observation that was left out
  bundle_times seconds;
};

/// Returns the status as text; for a failure, with the index of the observation or pose.
[[nodiscard]] inline std::string to_string(const bundle_summary& s) {
  std::string text{to_string(s.status)};
  if (is_failure(s.status)) {
    const bool of_observation = s.status == bundle_status::missing_pose || s.status == bundle_status::missing_point;
    text += (of_observation ? ": observation " : ": pose ") + std::to_string(s.where);
  }
  return text;
}

}  // namespace orbis::optimize
