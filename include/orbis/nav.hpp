// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Planning and exploration on a map.
///
/// | header | contents |
/// | --- | --- |
/// | distance_field.hpp | distance and direction to the nearest obstacle; updated when the map changes |
/// | floor_map.hpp | free, occupied and unknown cells of the floor for a ground robot |
/// | floor_cost.hpp | costs near obstacles, as in Nav2's costmaps |
/// | floor_file.hpp | floor map files for the map servers of ROS and Nav2 |
/// | floor_view.hpp | planning space of a round robot on a floor, in two dimensions |
/// | frontiers.hpp | boundary between known free and unknown space; updated when the map changes |
/// | view_gain.hpp | amount of unknown space that a camera would see |
/// | next_view.hpp | next best view of an exploring robot |
/// | robot_shape.hpp | robot shapes: ball, vertical capsule, vertical cylinder |
/// | planning_view.hpp | exact test of whether a robot fits at a position or along a segment |
/// | planning_space.hpp | the space of a path search, and the cost of moving in it |
/// | path_search.hpp | cheapest paths of a robot through a map or over a floor |
/// | replanning.hpp | checks a path after map changes, and replans only if it is blocked |
/// | robot_trajectory.hpp | conversion of paths to timed trajectories within bounds on speed and acceleration |
/// | squared_distances.hpp | the distance field of a set of voxels, without a map: exact squared distances |
/// | map_access.hpp | read access to a map for planning, including maps of other libraries |
#pragma once

#include <orbis/nav/distance_field.hpp>
#include <orbis/nav/floor_cost.hpp>
#include <orbis/nav/floor_file.hpp>
#include <orbis/nav/floor_map.hpp>
#include <orbis/nav/floor_view.hpp>
#include <orbis/nav/frontiers.hpp>
#include <orbis/nav/map_access.hpp>
#include <orbis/nav/next_view.hpp>
#include <orbis/nav/path_search.hpp>
#include <orbis/nav/planning_space.hpp>
#include <orbis/nav/planning_view.hpp>
#include <orbis/nav/replanning.hpp>
#include <orbis/nav/robot_shape.hpp>
#include <orbis/nav/robot_trajectory.hpp>
#include <orbis/nav/squared_distances.hpp>
#include <orbis/nav/view_gain.hpp>
