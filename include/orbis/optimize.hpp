// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation: manifolds, robust losses, closed-form and minimal solvers, RANSAC, pose refinement, bundle adjustment,
/// sparse factorisation, pose graphs.
#pragma once

#include <orbis/optimize/absolute_orientation.hpp>
#include <orbis/optimize/alignment.hpp>
#include <orbis/optimize/automatic.hpp>
#include <orbis/optimize/bal_reprojection.hpp>
#include <orbis/optimize/between_factor.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_covariance.hpp>
#include <orbis/optimize/bundle_gauge.hpp>
#include <orbis/optimize/bundle_summary.hpp>
#include <orbis/optimize/chordal_initialization.hpp>
#include <orbis/optimize/damping.hpp>
#include <orbis/optimize/dual.hpp>
#include <orbis/optimize/essential.hpp>
#include <orbis/optimize/graduated.hpp>
#include <orbis/optimize/homography.hpp>
#include <orbis/optimize/linear_solver.hpp>
#include <orbis/optimize/manifold.hpp>
#include <orbis/optimize/minimize.hpp>
#include <orbis/optimize/p3p.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/optimize/pose_from_points.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/optimize/pose_graph_summary.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/prior.hpp>
#include <orbis/optimize/ransac.hpp>
#include <orbis/optimize/ransac_policies.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>
#include <orbis/optimize/residual.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/triangulation.hpp>
