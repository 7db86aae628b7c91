// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframe-based SLAM from a single camera without depth.
///
/// @code
///   orbis::slam::monocular_system slam{camera, orbis::slam::monocular_options()};
///   slam.track(time, image);
///   auto trajectory = slam.trajectory();  // in a unit of length of its own
/// @endcode
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/monocular.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam {

/// The system of `rgbd_system` with the sensor `monocular`: the same tracking, mapping, loops, maps and map files.
/// Frames until a map has begun are not tracked. Lengths are in a unit of the map's own, the median depth of the scene
/// where it began; a merged map takes on the unit of the other one. `options` are to come from `monocular_options`.
using monocular_system =
    rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places, monocular>;

}  // namespace orbis::slam

#ifdef ORBIS_COMPILED
#include <orbis/slam/detail/compiled/monocular_system.hpp>
#endif
