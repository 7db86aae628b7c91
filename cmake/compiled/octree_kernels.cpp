// SPDX-License-Identifier: BSD-3-Clause
#define ORBIS_INSTANTIATE_KERNELS
#include <orbis/octree/detail/depth/depth_frame.hpp>
#include <orbis/octree/detail/points/dense_rays.hpp>
#include <orbis/octree/detail/points/organised_rays.hpp>
#include <orbis/octree/detail/points/ray_rasterizer.hpp>
#include <orbis/octree/detail/storage/update_block.hpp>
