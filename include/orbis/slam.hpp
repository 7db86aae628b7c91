// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RGB-D SLAM, assembled from the other components.
#pragma once

#include <orbis/slam/frame.hpp>
#include <orbis/slam/keyframe_decision.hpp>
#include <orbis/slam/landmark_search.hpp>
#include <orbis/slam/local_adjustment.hpp>
#include <orbis/slam/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/mapping.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/pose_tracker.hpp>
#include <orbis/slam/rgbd_system.hpp>
#include <orbis/slam/track_result.hpp>
