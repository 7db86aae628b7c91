// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RGB-D SLAM, assembled from the other components.
///
/// | header | what it is for |
/// | --- | --- |
/// | `rgbd_system.hpp` | the SLAM system: give it frames, ask it for poses and the map |
/// | `stereo_system.hpp` | the same from a stereo camera |
/// | `monocular_system.hpp` | the same from one camera without depth |
/// | `any_system.hpp` | the same for programs that learn at run time which of these they have |
/// | `options.hpp` | all settings of the system |
/// | `shutter_estimate.hpp` | what the frames tell of the shutter |
/// | `track_result.hpp` | what tracking a frame returns: state, pose, timings, counters |
/// | `events.hpp` | callbacks for new keyframes, corrections of the map and changes of state |
/// | `ids.hpp` | the ids of landmarks, keyframes and maps |
/// | `extractor.hpp` | requirements on extractors and descriptors, replaceable |
/// | `frame.hpp` | a frame and a keyframe: features, depth and the landmarks they show |
/// | `landmark.hpp` | a point of the map and its observations |
/// | `map.hpp` | keyframes, landmarks, who observes what, and the graphs that follow |
/// | `covisibility_graph.hpp` | which keyframes observe the same landmarks |
/// | `spanning_tree.hpp` | the tree of keyframes, and the loops closed between them |
/// | `atlas.hpp` | several maps, one of them active |
/// | `map_file.hpp` | saving and loading a map |
/// | `sensor.hpp` | what a frame measures for each feature: RGB-D |
/// | `stereo.hpp` | the same for a stereo camera, and the options that suit it |
/// | `monocular.hpp` | the same for one camera without depth, and the options that suit it |
/// | `any_sensor.hpp` | the same for any of these |
/// | `calibration.hpp` | the camera refined by the map that was made with it |
/// | `definitions.hpp` | not included here: for `orbis::compiled` and a system of types of your own |
/// | `camera_rig.hpp` | the camera with its image pyramid and the weight of depth |
/// | `pyramid_scales.hpp` | the scales of an image pyramid |
/// | `matchers.hpp` | how tracking matches features, replaceable |
/// | `place_recognition.hpp` | how similar keyframes are found, replaceable |
#pragma once

#include <orbis/slam/any_sensor.hpp>
#include <orbis/slam/any_system.hpp>
#include <orbis/slam/atlas.hpp>
#include <orbis/slam/calibration.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/covisibility_graph.hpp>
#include <orbis/slam/events.hpp>
#include <orbis/slam/extractor.hpp>
#include <orbis/slam/frame.hpp>
#include <orbis/slam/ids.hpp>
#include <orbis/slam/landmark.hpp>
#include <orbis/slam/map.hpp>
#include <orbis/slam/map_file.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/monocular.hpp>
#include <orbis/slam/monocular_system.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/pyramid_scales.hpp>
#include <orbis/slam/rgbd_system.hpp>
#include <orbis/slam/sensor.hpp>
#include <orbis/slam/shutter_estimate.hpp>
#include <orbis/slam/spanning_tree.hpp>
#include <orbis/slam/stereo.hpp>
#include <orbis/slam/stereo_system.hpp>
#include <orbis/slam/track_result.hpp>
