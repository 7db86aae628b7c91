// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RGB-D SLAM, assembled from the other components.
#pragma once

#include <orbis/slam/atlas.hpp>
#include <orbis/slam/correction.hpp>
#include <orbis/slam/covisibility_graph.hpp>
#include <orbis/slam/essential_graph.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/keyframe_culling.hpp>
#include <orbis/slam/keyframe_decision.hpp>
#include <orbis/slam/landmark.hpp>
#include <orbis/slam/landmark_culling.hpp>
#include <orbis/slam/landmark_fusion.hpp>
#include <orbis/slam/landmark_search.hpp>
#include <orbis/slam/local_adjustment.hpp>
#include <orbis/slam/local_map.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/map_content.hpp>
#include <orbis/slam/map_file.hpp>
#include <orbis/slam/map_reader.hpp>
#include <orbis/slam/map_sections.hpp>
#include <orbis/slam/mapping.hpp>
#include <orbis/slam/numbered.hpp>
#include <orbis/slam/observed_point.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/pose_tracker.hpp>
#include <orbis/slam/rgbd_system.hpp>
#include <orbis/slam/spanning_tree.hpp>
#include <orbis/slam/tally.hpp>
#include <orbis/slam/track_result.hpp>
#include <orbis/slam/validate.hpp>
