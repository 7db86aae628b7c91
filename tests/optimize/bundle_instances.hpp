// SPDX-License-Identifier: BSD-3-Clause
// What the tests of bundle adjustment instantiate again and again: compiled once, by bundle_instances.cpp and its
// neighbours, unless orbis::compiled has it.
#pragma once

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/optimize/detail/compiled/bundle_adjustment.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>

#ifndef ORBIS_TEST_INSTANCES
#define ORBIS_TEST_INSTANCES extern template
#endif
#ifndef ORBIS_TEST_BAL_INSTANCES
#define ORBIS_TEST_BAL_INSTANCES extern template
#endif

namespace orbis {

ORBIS_INSTANTIATE_BUNDLE_KERNELS(ORBIS_TEST_INSTANCES, reprojection<camera::pinhole>, trivial)

// Cameras with nine numbers.
ORBIS_KERNEL_INSTANCE(ORBIS_TEST_INSTANCES, optimize::detail::panel_product_kernel<9>, optimize::detail::panel_product);
ORBIS_KERNEL_INSTANCE(ORBIS_TEST_INSTANCES, optimize::detail::panel_solve_kernel<9>, optimize::detail::panel_solve);
ORBIS_KERNEL_INSTANCE(ORBIS_TEST_INSTANCES, optimize::detail::eliminate_kernel<9, true>,
                      optimize::detail::schur_kernels<9, true>::eliminator);
ORBIS_KERNEL_INSTANCE(ORBIS_TEST_INSTANCES, optimize::detail::substitute_kernel<9, true>,
                      optimize::detail::schur_kernels<9, true>::substituter);
namespace optimize::detail {
ORBIS_TEST_INSTANCES class block_cholesky<9>;
ORBIS_TEST_INSTANCES class automatic_block_solver<9>;
}  // namespace optimize::detail
ORBIS_INSTANTIATE_BUNDLE(ORBIS_TEST_BAL_INSTANCES, bal_reprojection, huber)
ORBIS_INSTANTIATE_BUNDLE(ORBIS_TEST_BAL_INSTANCES, bal_reprojection, trivial)

}  // namespace orbis
