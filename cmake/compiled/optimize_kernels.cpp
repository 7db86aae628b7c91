// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_KERNELS
#include <orbis/optimize/detail/minimal/pnp_matches.hpp>
