// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keypoints, descriptors and matching.
#pragma once

#include <orbis/features/brute_force.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/epipolar.hpp>
#include <orbis/features/epipolar_geometry.hpp>
#include <orbis/features/grid.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/motion_statistics.hpp>
#include <orbis/features/node_guided.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/project_points.hpp>
#include <orbis/features/projected.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/windowed.hpp>
