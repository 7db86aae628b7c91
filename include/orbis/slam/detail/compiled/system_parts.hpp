// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the parts of SLAM systems: those of a camera whose model is known at run
/// time, with the default extractor, matchers and places. cmake/compiled/slam_*.cpp instantiate them, part by part, so
/// that none of them takes much time and memory.
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/slam/any_sensor.hpp>
#include <orbis/slam/detail/compiled/loops.hpp>
#include <orbis/slam/detail/compiled/mapping.hpp>
#include <orbis/slam/detail/system/back_end.hpp>
#include <orbis/slam/detail/tracking/front_end.hpp>
#include <orbis/slam/detail/tracking/tracker.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/monocular.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/sensor.hpp>
#include <orbis/slam/stereo.hpp>

namespace orbis::slam::detail {

extern template class tracker<camera::any_camera, compiled_descriptor, orb_matchers>;
extern template class front_end<camera::any_camera, compiled_descriptor, orb_matchers, rgbd>;
extern template class front_end<camera::any_camera, compiled_descriptor, orb_matchers, stereo>;
extern template class front_end<camera::any_camera, compiled_descriptor, orb_matchers, monocular>;
extern template class front_end<camera::any_camera, compiled_descriptor, orb_matchers, any_sensor>;
extern template class local_mapper<camera::any_camera, compiled_descriptor, bag_of_words_places>;
extern template class loop_closer<camera::any_camera, compiled_descriptor, bag_of_words_places>;
extern template class back_end<camera::any_camera, compiled_descriptor, bag_of_words_places>;

}  // namespace orbis::slam::detail
