// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds: neighbours, filters, automatic selection, voxel grids.
#pragma once

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/decision.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_mode.hpp>
#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/cloud/leaf_search.hpp>
#include <orbis/cloud/log_statistical.hpp>
#include <orbis/cloud/mean_knn_distance.hpp>
#include <orbis/cloud/nanoflann.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/cloud/pass_through.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/range_statistical.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/cloud/voxel_sums.hpp>
