// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the SLAM system whose sensor is known at run time only;
/// cmake/compiled/slam_any_system.cpp instantiates it.
#pragma once

#include <cstdint>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/any_system.hpp>
#include <orbis/slam/detail/compiled/rgbd_system.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/rgbd_system.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {

extern template class rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places,
                                  any_sensor>;
extern template track_result rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places,
                                         any_sensor>::track_images(double, const image_view<const rgb8>&,
                                                                   const camera::depth_view<std::uint16_t>&);
extern template track_result rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places,
                                         any_sensor>::track_images(double, const image_view<const rgb8>&,
                                                                   const camera::depth_view<float>&);

}  // namespace orbis::slam
