// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_OPTIMIZE template
#include <orbis/optimize/detail/compiled/pose_refinement.hpp>
