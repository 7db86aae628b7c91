// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_KERNELS
#include <orbis/nav/detail/compiled/squared_distances_functions.hpp>
#include <orbis/nav/detail/floor/plane_sums.hpp>
