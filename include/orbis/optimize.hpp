// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Estimation: robust losses, closed-form and minimal solvers, RANSAC, pose refinement.
#pragma once

#include <orbis/optimize/absolute_orientation.hpp>
#include <orbis/optimize/bundle_adjustment.hpp>
#include <orbis/optimize/p3p.hpp>
#include <orbis/optimize/pnp.hpp>
#include <orbis/optimize/pose_refinement.hpp>
#include <orbis/optimize/ransac.hpp>
#include <orbis/optimize/reprojection.hpp>
#include <orbis/optimize/robust_loss.hpp>
