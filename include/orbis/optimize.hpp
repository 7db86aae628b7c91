// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation: camera poses, structure and transforms from measurements with noise and outliers.
///
/// | header | contents |
/// | --- | --- |
/// | alignment.hpp | rigid or similarity transform between two lists of points, in closed form or robust to outliers |
/// | bundle_adjustment.hpp | bundle adjustment: cameras and points from observations |
/// | bundle_problem.hpp | observations, residual concepts, options and summary of bundle adjustment |
/// | pnp.hpp | camera pose from known points and pixels with outliers (P3P in RANSAC) |
/// | point_to_plane.hpp | distance of a measured point from a plane, as a residual |
/// | pose_graph.hpp | pose graph optimisation |
/// | pose_graph_problem.hpp | edges, residuals, options and summary of pose graphs |
/// | pose_refinement.hpp | camera pose from known points, refined from an initial pose, with outlier rejection |
/// | ransac.hpp | RANSAC for any model |
/// | reprojection.hpp | reprojection error for any camera model |
/// | reprojection_with_intrinsics.hpp | reprojection error with unknown intrinsics; the camera of BAL files |
/// | robust_loss.hpp | robust losses (Huber, Cauchy, Tukey), chi-squared gates |
/// | self_calibration.hpp | bundle adjustment of images of one camera with unknown intrinsics |
/// | solver_policies.hpp | damping (Gauss-Newton, Levenberg-Marquardt, dogleg), solvers for the reduced system |
/// | triangulation.hpp | triangulation of points from two or more rays |
/// | two_view.hpp | essential matrix, homography and relative pose of two images; initial structure and motion |
#pragma once

#include <orbis/optimize/alignment.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/bundle_problem.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/point_to_plane.hpp>
#include <orbis/optimize/pose_graph.hpp>
#include <orbis/optimize/pose_graph_problem.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/ransac.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/reprojection_with_intrinsics.hpp>
#include <orbis/optimize/robust_loss.hpp>
#include <orbis/optimize/self_calibration.hpp>
#include <orbis/optimize/solver_policies.hpp>
#include <orbis/optimize/triangulation.hpp>
#include <orbis/optimize/two_view.hpp>
