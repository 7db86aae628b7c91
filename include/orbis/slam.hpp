// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// RGB-D SLAM, built on the other components.
///
/// | header | contents |
/// | --- | --- |
/// | `system.hpp` | the SLAM system for RGB-D, stereo and monocular cameras: tracks frames, returns poses and the map |
/// | `options.hpp` | all settings of the system |
/// | `shutter_estimate.hpp` | the shutter timing estimated from frames |
/// | `track_result.hpp` | the result of tracking a frame: state, pose, timings, counters |
/// | `events.hpp` | callbacks for new keyframes, corrections of the map and changes of state |
/// | `ids.hpp` | the ids of landmarks, keyframes and maps |
/// | `extractor.hpp` | requirements for extractors and descriptors |
/// | `frame.hpp` | frames and keyframes: features, depth and the observed landmarks |
/// | `landmark.hpp` | a 3D point of the map and its observations |
/// | `map.hpp` | keyframes, landmarks, observations, covisibility graph and spanning tree |
/// | `covisibility_graph.hpp` | the graph of keyframes that observe the same landmarks |
/// | `spanning_tree.hpp` | the tree of keyframes, and the loops closed between them |
/// | `atlas.hpp` | several maps, one of them active |
/// | `map_file.hpp` | saving and loading a map |
/// | `measure.hpp` | features with depth from a depth image, a stereo pair, or one image |
/// | `calibration.hpp` | calibration of a camera from a map built with it |
/// | `camera_rig.hpp` | the camera with its image pyramid and depth weight |
/// | `pyramid_scales.hpp` | the scales of an image pyramid |
/// | `matchers.hpp` | the feature matchers for tracking (replaceable) |
/// | `place_recognition.hpp` | search for similar keyframes (replaceable) |
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
