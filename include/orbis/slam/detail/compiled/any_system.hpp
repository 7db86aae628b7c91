// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the SLAM system besides that of RGB-D: the one whose sensor is known at
/// run time only. Tracking, mapping and loops are those of `rgbd_system`.
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/slam/any_system.hpp>
#include <orbis/slam/detail/compiled/rgbd_system.hpp>
#include <orbis/slam/detail/tracking/front_end.hpp>

namespace orbis::slam {

extern template class detail::front_end<camera::any_camera, detail::compiled_descriptor, orb_matchers, any_sensor>;
extern template class rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places,
                                  any_sensor>;

}  // namespace orbis::slam
