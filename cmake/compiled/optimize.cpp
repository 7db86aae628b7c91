// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_OPTIMIZE template
#include <orbis/optimize/detail/compiled/bundle_adjustment.hpp>
#include <orbis/optimize/detail/compiled/dense_cholesky_functions.hpp>
