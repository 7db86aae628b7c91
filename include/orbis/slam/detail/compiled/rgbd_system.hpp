// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the SLAM system from RGB-D: that of a camera whose model is known at run
/// time, with the default extractor, matchers and places. cmake/compiled/slam_system.cpp instantiates it.
#pragma once

#include <concepts>
#include <cstdint>

#include <orbis/camera/any.hpp>
#include <orbis/camera/depth.hpp>
#include <orbis/core/image.hpp>
#include <orbis/features/orb.hpp>
#include <orbis/slam/detail/system/definitions_check.hpp>
#include <orbis/slam/matchers.hpp>
#include <orbis/slam/place_recognition.hpp>
#include <orbis/slam/rgbd_system.hpp>
#include <orbis/slam/sensor.hpp>
#include <orbis/slam/track_result.hpp>

namespace orbis::slam {

struct stereo;
struct monocular;
struct any_sensor;

namespace detail {

template <class Sensor>
concept library_sensor = std::same_as<Sensor, rgbd> || std::same_as<Sensor, stereo> ||
    std::same_as<Sensor, monocular> || std::same_as<Sensor, any_sensor>;

template <library_sensor Sensor>
inline constexpr bool
    is_compiled<of_system, camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places, Sensor> =
        true;
template <library_sensor Sensor, class T>
inline constexpr bool is_compiled<
    of_system, rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places, Sensor>,
    camera::depth_view<T>> = true;

}  // namespace detail

extern template class rgbd_system<camera::any_camera>;
extern template track_result rgbd_system<camera::any_camera>::track_images(double, const image_view<const rgb8>&,
                                                                           const camera::depth_view<std::uint16_t>&);
extern template track_result rgbd_system<camera::any_camera>::track_images(double, const image_view<const rgb8>&,
                                                                           const camera::depth_view<float>&);

}  // namespace orbis::slam
