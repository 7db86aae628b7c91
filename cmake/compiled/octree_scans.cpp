// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_OCTREE template
#include <orbis/octree/scan_voxels.hpp>
