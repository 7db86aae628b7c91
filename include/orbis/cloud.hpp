// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds: neighbours, filters, automatic selection, voxel grids.
#pragma once

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/all_knn_avx2.hpp>
#include <orbis/cloud/all_knn_avx512.hpp>
#include <orbis/cloud/all_knn_bracket.hpp>
#include <orbis/cloud/all_knn_kernels.hpp>
#include <orbis/cloud/all_knn_leaves.hpp>
#include <orbis/cloud/all_knn_search.hpp>
#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/curve_order.hpp>
#include <orbis/cloud/decision.hpp>
#include <orbis/cloud/depth_windows.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/cloud/log_density.hpp>
#include <orbis/cloud/log_statistical.hpp>
#include <orbis/cloud/mean_knn_distance.hpp>
#include <orbis/cloud/nanoflann.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/cloud/pass_through.hpp>
#include <orbis/cloud/point_blocks.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/range_statistical.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/cloud/ray_evidence_kernels.hpp>
#include <orbis/cloud/ray_evidence_simd.hpp>
#include <orbis/cloud/ray_view.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/cloud/squared_distance.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/cloud/voxel_hash.hpp>
