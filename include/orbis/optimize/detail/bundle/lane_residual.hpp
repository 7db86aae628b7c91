// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Residuals that the bundle adjustment kernels evaluate for eight observations at a time.
#pragma once

#include <concepts>

#include <orbis/core/simd/vec.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/reprojection-inl.hpp>
#include <orbis/optimize/reprojection_with_intrinsics-inl.hpp>

namespace orbis::optimize::detail {

using portable_lanes = simd::vec<double, 8, simd::portable>;

/// A `camera_frame_residual` that evaluates eight observations by one camera at a time. `measure(o, to)` writes the
/// required values of an observation to `to[8 * i]`, i < `R::measured`. `lanes_in_camera<Derive>(view, measurements, q,
/// r, by_q, by_intrinsics)` is equivalent to `linearize_in_camera` (without `Derive`: `residual_in_camera`) for all
/// eight and returns the mask of observations with a projection.
template <class R>
concept lane_residual = camera_frame_residual<R> &&
    requires(const R& r, const typename R::observation& o, const typename R::view& view, double* to,
             portable_lanes* lanes, portable_lanes (*by_q)[3],
             portable_lanes (*by_intrinsics)[R::intrinsic_dimension == 0 ? 1 : R::intrinsic_dimension]) {
  {r.measure(o, to)};
  {
    r.template lanes_in_camera<true>(view, to, lanes, lanes, by_q, by_intrinsics)
    } -> std::same_as<portable_lanes::mask_type>;
};

}  // namespace orbis::optimize::detail
