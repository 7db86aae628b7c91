// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// Keyframe-based SLAM for programs that learn at run time what camera they have.
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/any_sensor.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam {

/// A system whose sensor, as its camera, is known at run time only.
using any_system =
    rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places, any_sensor>;

}  // namespace orbis::slam

#ifdef ORBIS_COMPILED
#include <orbis/slam/detail/compiled/any_system.hpp>
#endif
