// SPDX-License-Identifier: BSD-3-Clause
// The solvers of block systems are in optimize.cpp.
#include <orbis/optimize/detail/compiled/block_solvers.hpp>
#undef ORBIS_INSTANTIATE_OPTIMIZE
#define ORBIS_INSTANTIATE_OPTIMIZE template
#include <orbis/optimize/detail/compiled/pnp.hpp>
#include <orbis/optimize/detail/compiled/pnp_functions.hpp>
#include <orbis/optimize/detail/compiled/pose_graph.hpp>
