// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Everything in orbis::nav: what a robot needs to plan on a map.
///
/// | header | what it is for |
/// | --- | --- |
/// | distance_field.hpp | how far it is to the nearest obstacle of a map, and in which direction; follows the map |
/// | floor_map.hpp | where a robot that drives can go: free, occupied and unknown cells of the floor |
/// | floor_cost.hpp | costs near obstacles, as Nav2's costmaps have them |
/// | floor_file.hpp | floor maps as files for the map servers of ROS and Nav2 |
/// | floor_view.hpp | where a round robot fits on a floor, for paths in two dimensions |
/// | frontiers.hpp | where known space ends and unknown space begins; follows the map |
/// | view_gain.hpp | how much unknown space a camera would see |
/// | next_view.hpp | where a robot that explores should look next |
/// | robot_shape.hpp | a ball, a vertical capsule, a vertical cylinder |
/// | planning_view.hpp | whether a robot fits, at rest or along a segment; exact |
/// | planning_space.hpp | what a path can be searched in, and what going costs |
/// | path_search.hpp | cheapest ways of a robot through a map or over a floor |
/// | replanning.hpp | whether changes of the map touch a path; a new path only then |
/// | robot_trajectory.hpp | paths over time, within bounds on speed and acceleration |
/// | squared_distances.hpp | the same without a map: exact squared distances in voxels |
/// | map_access.hpp | how planning reads a map, also one of another library |
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
