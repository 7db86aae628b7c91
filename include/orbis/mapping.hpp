// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Mapping: keyframes to dense clouds, filtered clouds and octrees.
#pragma once

#include <orbis/mapping/batch.hpp>
#include <orbis/mapping/dense_cloud.hpp>
#include <orbis/mapping/filter.hpp>
#include <orbis/mapping/keyframe.hpp>
#include <orbis/mapping/keyframe_points.hpp>
