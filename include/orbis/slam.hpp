// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RGB-D SLAM, assembled from the other components.
///
/// | header | what it is for |
/// | --- | --- |
/// | `system.hpp` | the SLAM system, from depth images, stereo pairs or one camera: give it frames, ask it for poses and the map |
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
/// | `measure.hpp` | what a frame measures: from a depth image, a stereo pair, or one image |
/// | `calibration.hpp` | the camera refined by the map that was made with it |
/// | `camera_rig.hpp` | the camera with its image pyramid and the weight of depth |
/// | `pyramid_scales.hpp` | the scales of an image pyramid |
/// | `matchers.hpp` | how tracking matches features, replaceable |
/// | `place_recognition.hpp` | how similar keyframes are found, replaceable |
#pragma once

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
#include <orbis/slam/measure.hpp>
#include <orbis/slam/options.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/pyramid_scales.hpp>
#include <orbis/slam/shutter_estimate.hpp>
#include <orbis/slam/spanning_tree.hpp>
#include <orbis/slam/system.hpp>
#include <orbis/slam/track_result.hpp>
