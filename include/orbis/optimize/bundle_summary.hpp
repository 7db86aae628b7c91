// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What bundle adjustment is asked, and what it answers.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>

#include <orbis/core/types.hpp>

namespace orbis::optimize {

/// Point `point` seen by camera `pose`, both as indices into the caller's arrays.
struct bundle_observation {
  std::uint32_t pose = 0;
  std::uint32_t point = 0;
  vec2 pixel = vec2::Zero();
  double right = std::numeric_limits<double>::quiet_NaN();  ///< as in `pose_observation`; NaN: there is none
  double information = 1.0;                                 ///< 1 / sigma^2 of the pixel, 1 / pixel^2
};

/// What holds directions that no observation determines: where the whole is in the world, how it is
/// turned and, without depth, how large it is.
enum class bundle_gauge {
  damped,       ///< the fixed poses; what they leave undetermined, the damping of the steps
  first_camera  ///< the fixed poses; without any, the first camera that has observations, with its intrinsics
};

struct bundle_options {
  int max_iterations = 10;
  double relative_tolerance = 1e-6;              ///< ends when a step lowers the cost by less than this share
  double gradient_tolerance = 0.0;               ///< ends where no entry of the gradient is larger
  std::span<const std::uint8_t> fixed_poses{};   ///< empty, or one for each pose: not 0 keeps it where it is
  std::span<const std::uint8_t> fixed_points{};  ///< empty, or one for each point, likewise
  std::span<const std::uint8_t> ignored{};       ///< empty, or one for each observation: not 0 leaves it out
  bundle_gauge hold = bundle_gauge::damped;
};

enum class bundle_status {
  converged,
  iteration_limit,
  cancelled,
  no_progress,       ///< no step lowers the cost any further, though the model promises it
  nothing_to_do,     ///< no usable observation, or nothing that may move
  missing_pose,      ///< observation `where` names a pose that there is not
  missing_point,     ///< observation `where` names a point that there is not
  bad_pose,          ///< pose `where` has observations and is not finite
  undetermined_pose  ///< the observations do not determine pose `where`, or its points, and nothing damps them
};

/// Whether the input kept the problem from being solved. The caller's arrays are untouched then, but for steps
/// that were taken before a pose turned out `undetermined_pose`.
[[nodiscard]] constexpr bool is_failure(bundle_status status) noexcept { return status >= bundle_status::missing_pose; }

[[nodiscard]] constexpr std::string_view to_string(bundle_status status) noexcept {
  switch (status) {
    case bundle_status::converged: return "converged";
    case bundle_status::iteration_limit: return "iteration limit";
    case bundle_status::cancelled: return "cancelled";
    case bundle_status::no_progress: return "no progress";
    case bundle_status::nothing_to_do: return "nothing to do";
    case bundle_status::missing_pose: return "an observation names a pose that there is not";
    case bundle_status::missing_point: return "an observation names a point that there is not";
    case bundle_status::bad_pose: return "a pose is not finite";
    case bundle_status::undetermined_pose: return "a pose is not determined by the observations";
  }
  return "unknown";
}

/// Seconds.
struct bundle_times {
  double set_up = 0.0;           ///< checks, orders, structure of the reduced system
  double linearize = 0.0;        ///< residuals, Jacobians, normal equations
  double schur = 0.0;            ///< elimination of the points
  double factor = 0.0;           ///< of the reduced system
  double solve = 0.0;            ///< of the reduced system
  double back_substitute = 0.0;  ///< steps of the points
  double evaluate = 0.0;         ///< costs of steps tried
};

struct bundle_summary {
  bundle_status status = bundle_status::nothing_to_do;
  std::size_t where = 0;           ///< the observation or pose that a failure is about
  double initial_cost = 0.0;       ///< half the sum of the robust loss over the observations
  double final_cost = 0.0;         ///< never above `initial_cost`
  double gradient = 0.0;           ///< largest entry, where the last step began
  int iterations = 0;              ///< steps taken
  int steps_tried = 0;             ///< those not taken included
  int linear_iterations = 0;       ///< of the iterative solver of the reduced system
  std::size_t observations = 0;    ///< that took part
  std::size_t left_out = 0;        ///< observations not ignored that are not finite or have no projection at the start
  std::size_t first_left_out = 0;  ///< the first of these
  bundle_times seconds;
};

[[nodiscard]] inline std::string to_string(const bundle_summary& s) {
  std::string text{to_string(s.status)};
  if (is_failure(s.status)) {
    const bool of_observation = s.status == bundle_status::missing_pose || s.status == bundle_status::missing_point;
    text += (of_observation ? ": observation " : ": pose ") + std::to_string(s.where);
  }
  return text;
}

}  // namespace orbis::optimize
