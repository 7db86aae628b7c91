// SPDX-License-Identifier: BSD-3-Clause
// The inner loops of bundle adjustment are most of what its tests cost to compile: compiled once, by
// bundle_instances.cpp, for all of them.
#pragma once

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/simd/dispatch.hpp>
#include <orbis/optimize/detail/bundle/bundle_kernels.hpp>
#include <orbis/optimize/detail/bundle/schur_kernels.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>
#include <orbis/optimize/robust_loss.hpp>

#ifndef ORBIS_TEST_INSTANCES
#define ORBIS_TEST_INSTANCES extern template
#endif

namespace orbis::optimize::detail {
using pinhole_residual = reprojection<camera::pinhole>;
}

#define ORBIS_TEST_REDUCED(RESIDUAL, LOSS)                                                                            \
  ORBIS_TEST_INSTANCES struct compiled<optimize::detail::linearize_kernel<optimize::RESIDUAL, optimize::LOSS>,        \
                                       optimize::detail::bundle_kernels<optimize::RESIDUAL, optimize::LOSS>::reduce>; \
  ORBIS_TEST_INSTANCES struct compiled<optimize::detail::cost_kernel<optimize::RESIDUAL, optimize::LOSS>,             \
                                       optimize::detail::bundle_kernels<optimize::RESIDUAL, optimize::LOSS>::reduce>;
#define ORBIS_TEST_ELIMINATED(SIZE)                                                        \
  ORBIS_TEST_INSTANCES struct compiled<optimize::detail::eliminate_kernel<SIZE>,           \
                                       optimize::detail::schur_kernels<SIZE>::eliminator>; \
  ORBIS_TEST_INSTANCES struct compiled<optimize::detail::substitute_kernel<SIZE>,          \
                                       optimize::detail::schur_kernels<SIZE>::substituter>;

namespace orbis::simd::detail {

ORBIS_TEST_REDUCED(detail::pinhole_residual, huber)
ORBIS_TEST_REDUCED(detail::pinhole_residual, trivial)
ORBIS_TEST_REDUCED(bal_reprojection, huber)
ORBIS_TEST_REDUCED(bal_reprojection, trivial)
ORBIS_TEST_ELIMINATED(6)
ORBIS_TEST_ELIMINATED(9)

}  // namespace orbis::simd::detail

#undef ORBIS_TEST_ELIMINATED
#undef ORBIS_TEST_REDUCED
