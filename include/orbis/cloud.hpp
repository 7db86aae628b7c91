// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Point clouds: neighbours, outlier filters, automatic selection of filters, voxel grids.
///
/// | header                     | contents                                                                    |
/// | -------------------------- | --------------------------------------------------------------------------- |
/// | `all_knn.hpp`              | k nearest neighbours of every point, and the mean distance to them          |
/// | `cluster.hpp`              | filter: small groups of points far from the surface                         |
/// | `depth_smoothing.hpp`      | edge-preserving smoothing of depth images                                   |
/// | `extract.hpp`              | points with given indices or inside a box; treatment of non-finite points   |
/// | `filter_chain.hpp`         | a sequence of filters with their parameters                                 |
/// | `filter_choice.hpp`        | options and result of the automatic selection, with its evidence            |
/// | `flying_pixels.hpp`        | removal of flying pixels at edges in depth images                           |
/// | `log_statistical.hpp`      | filter: large mean neighbour distance relative to the median                |
/// | `nanoflann.hpp`            | neighbours of single points with a k-d tree; include it separately, needs nanoflann |
/// | `neighbors.hpp`            | result type of nearest-neighbour searches                                   |
/// | `radius.hpp`               | filter: points with too few neighbours within a radius                      |
/// | `ray_evidence.hpp`         | filter: points that the rays of depth images pass through                   |
/// | `ray_evidence_counter.hpp` | the counts for that filter, accumulated image by image                      |
/// | `select.hpp`               | automatic selection and application of filters                              |
/// | `select_by_views.hpp`      | the same, with the depth images that show the cloud                         |
/// | `sensor_origins.hpp`       | the sensor position for each point                                          |
/// | `smeared_edges.hpp`        | removal of the depth that a moving camera measures at edges                 |
/// | `statistical.hpp`          | filter: mean neighbour distance above mu + alpha sigma; also relative to range |
/// | `view_samples.hpp`         | samples of each depth image, used to compare images with each other         |
/// | `voxel_grid.hpp`           | voxel-grid downsampling: one point per occupied voxel                       |
/// | `voxel_sums.hpp`           | voxel centroids; measurements can be removed from them again                |
#pragma once

#include <orbis/cloud/all_knn.hpp>
#include <orbis/cloud/cluster.hpp>
#include <orbis/cloud/depth_smoothing.hpp>
#include <orbis/cloud/extract.hpp>
#include <orbis/cloud/filter_chain.hpp>
#include <orbis/cloud/filter_choice.hpp>
#include <orbis/cloud/flying_pixels.hpp>
#include <orbis/cloud/log_statistical.hpp>
#include <orbis/cloud/neighbors.hpp>
#include <orbis/cloud/radius.hpp>
#include <orbis/cloud/ray_evidence.hpp>
#include <orbis/cloud/ray_evidence_counter.hpp>
#include <orbis/cloud/select.hpp>
#include <orbis/cloud/select_by_views.hpp>
#include <orbis/cloud/sensor_origins.hpp>
#include <orbis/cloud/smeared_edges.hpp>
#include <orbis/cloud/statistical.hpp>
#include <orbis/cloud/view_samples.hpp>
#include <orbis/cloud/voxel_grid.hpp>
#include <orbis/cloud/voxel_sums.hpp>
