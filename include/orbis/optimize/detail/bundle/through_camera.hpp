// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Derivatives of a `camera_frame_residual` with respect to the camera and to the point in the world frame.
#pragma once

#include <optional>

#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_problem.hpp>

namespace orbis::optimize::detail {

/// Implements `linearize` by `linearize_in_camera`.
template <class R>
[[nodiscard]] std::optional<matrix<R::dimension>> linearize_through_camera(
    const R& residual, const typename R::view& view, const vec3& point, const typename R::observation& o,
    matrix<R::dimension, 6 + R::intrinsic_dimension>& by_camera, matrix<R::dimension, 3>& by_point) {
  const vec3 q = view.rotation * point + view.translation;
  matrix<R::dimension, 3> by_q;
  matrix<R::dimension, R::intrinsic_dimension> by_intrinsics;
  const auto r = residual.linearize_in_camera(view, q, o, by_q, by_intrinsics);
  if (!r) return r;
  set_block(by_camera, 0, 0, -by_q);
  set_block(by_camera, 0, 3, by_q * hat<double>(q));
  if constexpr (R::intrinsic_dimension != 0) set_block(by_camera, 0, 6, by_intrinsics);
  by_point = by_q * view.rotation;
  return r;
}

}  // namespace orbis::optimize::detail
