// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframe-based SLAM from a stereo camera.
///
/// @code
///   const auto rig = orbis::camera::rectify(stereo_rig).value();
///   orbis::slam::stereo_system slam{rig.camera(), orbis::slam::stereo_options(rig.camera().k().fx, rig.baseline())};
///   slam.track(time, left, right);  // rectified images
///   auto trajectory = slam.trajectory();
/// @endcode
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/rgbd_system.hpp>
#include <orbis/slam/stereo.hpp>

namespace orbis::slam {

/// The system of `rgbd_system` with the sensor `stereo`: the same tracking, mapping, loops, maps and map files. Poses
/// are those of the rectified left camera. `options` are to come from `stereo_options`.
using stereo_system =
    rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places, stereo>;

}  // namespace orbis::slam

#ifdef ORBIS_COMPILED
#include <orbis/slam/detail/compiled/stereo_system.hpp>
#endif
