// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_KERNELS
#include <orbis/features/orb.hpp>
#include <orbis/features/stereo.hpp>
