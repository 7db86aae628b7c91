// SPDX-License-Identifier: BSD-3-Clause
// What the tests of bundle adjustment instantiate again and again: compiled once, by bundle_instances.cpp and its
// neighbours, unless orbis::compiled has it.
#pragma once

#include <span>

#include <orbis/camera/any.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/bundle_adjustment-inl.hpp>
#include <orbis/optimize/reprojection_with_intrinsics-inl.hpp>

/// `what`: `extern template`, or `template` in the source that has it.
#define ORBIS_TEST_SOLVE(what, residual, loss, policy)                                                                \
  what bundle_summary bundle_adjuster<residual, loss>::solve(const policy&, std::span<residual::camera_state>,        \
                                                             std::span<vec3>, std::span<const residual::observation>, \
                                                             const bundle_options&, progress, detail::no_report&&);   \
  what bundle_summary bundle_adjuster<residual, loss>::solve_again(const policy&, std::span<residual::camera_state>,  \
                                                                   std::span<vec3>, const bundle_options&, progress,  \
                                                                   detail::no_report&&);
#define ORBIS_TEST_BUNDLE(what, residual, loss)             \
  what struct detail::bundle_kernels<residual, loss>;       \
  what class bundle_adjuster<residual, loss>;               \
  ORBIS_TEST_SOLVE(what, residual, loss, sequential_policy) \
  ORBIS_TEST_SOLVE(what, residual, loss, parallel_policy)
/// For cameras with `size` numbers.
#define ORBIS_TEST_BLOCKS(what, size)      \
  what struct detail::panel_kernels<size>; \
  what class detail::reduced_solver<size>;
#define ORBIS_TEST_KERNELS(what, size)           \
  what struct detail::schur_kernels<size, true>; \
  what class detail::block_cholesky<size>;

namespace orbis::optimize {

ORBIS_TEST_BLOCKS(extern template, 6)
ORBIS_TEST_KERNELS(extern template, 6)
ORBIS_TEST_BUNDLE(extern template, reprojection<camera::pinhole>, huber)
ORBIS_TEST_BUNDLE(extern template, reprojection<camera::any_camera>, huber)
extern template struct detail::bundle_kernels<reprojection<camera::pinhole>, trivial>;

ORBIS_TEST_BLOCKS(extern template, 9)
ORBIS_TEST_KERNELS(extern template, 9)
ORBIS_TEST_BUNDLE(extern template, bal_reprojection, huber)
ORBIS_TEST_BUNDLE(extern template, bal_reprojection, trivial)

}  // namespace orbis::optimize
