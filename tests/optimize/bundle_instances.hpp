// SPDX-License-Identifier: BSD-3-Clause
// The inner loops of bundle adjustment are most of what its tests cost to compile: compiled once, by
// bundle_instances.cpp, for all of them.
#pragma once

#include <cstddef>

#include <orbis/camera/pinhole.hpp>
#include <orbis/core/simd.hpp>
#include <orbis/optimize/detail/bundle/bundle_kernels.hpp>
#include <orbis/optimize/detail/bundle/schur_kernels.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>
#include <orbis/optimize/robust_loss.hpp>

#ifndef ORBIS_TEST_INSTANCES
#define ORBIS_TEST_INSTANCES extern template
#endif

#define ORBIS_TEST_REDUCED(RESIDUAL, LOSS, LEVEL)                                                           \
  ORBIS_TEST_INSTANCES double linearize_##LEVEL<RESIDUAL, LOSS>(const camera_work<RESIDUAL>&, const LOSS&); \
  ORBIS_TEST_INSTANCES double cost_##LEVEL<RESIDUAL, LOSS>(const camera_work<RESIDUAL>&, const LOSS&);
#define ORBIS_TEST_ELIMINATED(SIZE, LEVEL)                                      \
  ORBIS_TEST_INSTANCES std::size_t eliminate_##LEVEL<SIZE>(const elimination&); \
  ORBIS_TEST_INSTANCES void substitute_##LEVEL<SIZE>(const substitution&);
#define ORBIS_TEST_KERNELS(LEVEL)                      \
  ORBIS_TEST_REDUCED(pinhole_residual, huber, LEVEL)   \
  ORBIS_TEST_REDUCED(pinhole_residual, trivial, LEVEL) \
  ORBIS_TEST_REDUCED(bal_reprojection, huber, LEVEL)   \
  ORBIS_TEST_REDUCED(bal_reprojection, trivial, LEVEL) \
  ORBIS_TEST_ELIMINATED(6, LEVEL)                      \
  ORBIS_TEST_ELIMINATED(9, LEVEL)

namespace orbis::optimize::detail {

using pinhole_residual = reprojection<camera::pinhole>;
ORBIS_TEST_KERNELS(portable)
#if ORBIS_X86
ORBIS_TEST_KERNELS(avx2)
ORBIS_TEST_KERNELS(avx512)
#endif

}  // namespace orbis::optimize::detail

#undef ORBIS_TEST_KERNELS
#undef ORBIS_TEST_ELIMINATED
#undef ORBIS_TEST_REDUCED
