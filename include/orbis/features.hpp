// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keypoints, descriptors and matching.
#pragma once

#include <orbis/features/binomial.hpp>
#include <orbis/features/box_difference.hpp>
#include <orbis/features/brute_force.hpp>
#include <orbis/features/corner.hpp>
#include <orbis/features/cover_first.hpp>
#include <orbis/features/depth.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/features/fast.hpp>
#include <orbis/features/fast_lanes.hpp>
#include <orbis/features/grey.hpp>
#include <orbis/features/grid.hpp>
#include <orbis/features/hamming.hpp>
#include <orbis/features/hamming_listed.hpp>
#include <orbis/features/hamming_nearest.hpp>
#include <orbis/features/hamming_slices.hpp>
#include <orbis/features/kept_memory.hpp>
#include <orbis/features/match.hpp>
#include <orbis/features/matcher.hpp>
#include <orbis/features/nearest.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/features/orb_pattern.hpp>
#include <orbis/features/orientation.hpp>
#include <orbis/features/pyramid.hpp>
#include <orbis/features/resize.hpp>
#include <orbis/features/search_among.hpp>
#include <orbis/features/smooth.hpp>
#include <orbis/features/spread.hpp>
#include <orbis/features/square_covering.hpp>
#include <orbis/features/stages.hpp>
#include <orbis/features/steered_brief.hpp>
#include <orbis/features/windowed.hpp>
