// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation: manifolds, robust losses, closed-form and minimal solvers, RANSAC, pose refinement, bundle adjustment,
/// sparse factorisation, pose graphs.
#pragma once

#include <orbis/optimize/absolute_orientation.hpp>
#include <orbis/optimize/between_factor.hpp>
#include <orbis/optimize/block_cholesky.hpp>
#include <orbis/optimize/block_ordering.hpp>
#include <orbis/optimize/block_symbolic.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/chordal_initialization.hpp>
#include <orbis/optimize/damping.hpp>
#include <orbis/optimize/manifold.hpp>
#include <orbis/optimize/p3p.hpp>
#include <orbis/optimize/panel_kernels.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/optimize/pose_graph_structure.hpp>
#include <orbis/optimize/pose_graph_summary.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/ransac.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
