// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the solvers of block systems, for poses with six degrees of freedom.
#pragma once

#include <orbis/core/simd/dispatch.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>
#include <orbis/optimize/detail/sparse/panel_kernels.hpp>
#include <orbis/optimize/detail/sparse/reduced_solvers.hpp>

#ifndef ORBIS_INSTANTIATE_OPTIMIZE
#define ORBIS_INSTANTIATE_OPTIMIZE extern template
#endif

namespace orbis {

ORBIS_KERNEL_INSTANCE(ORBIS_INSTANTIATE_OPTIMIZE, optimize::detail::panel_product_kernel<6>,
                      optimize::detail::panel_product);
ORBIS_KERNEL_INSTANCE(ORBIS_INSTANTIATE_OPTIMIZE, optimize::detail::panel_product_kernel<8>,
                      optimize::detail::panel_product);
ORBIS_KERNEL_INSTANCE(ORBIS_INSTANTIATE_OPTIMIZE, optimize::detail::panel_solve_kernel<6>,
                      optimize::detail::panel_solve);
ORBIS_KERNEL_INSTANCE(ORBIS_INSTANTIATE_OPTIMIZE, optimize::detail::panel_solve_kernel<8>,
                      optimize::detail::panel_solve);

namespace optimize::detail {
ORBIS_INSTANTIATE_OPTIMIZE class block_cholesky<6>;
ORBIS_INSTANTIATE_OPTIMIZE class automatic_block_solver<6>;
}  // namespace optimize::detail

}  // namespace orbis
