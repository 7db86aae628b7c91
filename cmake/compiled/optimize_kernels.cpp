// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/optimize/detail/bundle/schur_kernels.hpp>
#include <orbis/optimize/detail/sparse/block_cholesky.hpp>

namespace orbis::optimize::detail {

// Unknowns of a camera: a pose (6), a pose and a scale (7), a pose and three parameters (9).
template struct schur_kernels<6, true>;
template struct schur_kernels<9, true>;
template class block_cholesky<6>;
template class block_cholesky<7>;
template class block_cholesky<9>;

}  // namespace orbis::optimize::detail
