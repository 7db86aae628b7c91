// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_OCTREE template
#include <orbis/octree/files.hpp>
#include <orbis/octree/occupancy_octree.hpp>
