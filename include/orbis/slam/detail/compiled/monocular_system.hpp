// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the SLAM system from one camera without depth;
/// cmake/compiled/slam_monocular_system.cpp instantiates it.
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/detail/compiled/rgbd_system.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/monocular_system.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam {

extern template class rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places,
                                  monocular>;

}  // namespace orbis::slam
