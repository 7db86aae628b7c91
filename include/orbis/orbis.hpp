// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// All of orbis except the interop headers. Include individual headers instead if compile time matters.
#pragma once

#include <orbis/camera.hpp>
#include <orbis/cloud.hpp>
#include <orbis/core.hpp>
#include <orbis/eval.hpp>
#include <orbis/features.hpp>
#include <orbis/io.hpp>
#include <orbis/mapping.hpp>
#include <orbis/nav.hpp>
#include <orbis/octree.hpp>
#include <orbis/optimize.hpp>
#include <orbis/places.hpp>
#include <orbis/slam.hpp>
