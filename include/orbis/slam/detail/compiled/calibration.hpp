// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of the calibration by a map; cmake/compiled/slam_calibration.cpp instantiates
/// it.
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/features/descriptor.hpp>
#include <orbis/slam/calibration.hpp>
#include <orbis/slam/camera_rig.hpp>
#include <orbis/slam/detail/system/definitions_check.hpp>
#include <orbis/slam/map.hpp>

namespace orbis::slam::detail {

template <calibrated_camera Camera>
inline constexpr bool is_compiled<of_calibration, features::binary_descriptor<256>, Camera> = true;

extern template result<calibration<camera::any_camera>> calibrate_by_map(
    const basic_map<features::binary_descriptor<256>>&, const camera_rig<camera::any_camera>&,
    const calibration_options&, const progress&);
extern template result<calibration<camera::pinhole>> calibrate_by_map(
    const basic_map<features::binary_descriptor<256>>&, const camera_rig<camera::pinhole>&, const calibration_options&,
    const progress&);
extern template result<calibration<camera::radial_tangential>> calibrate_by_map(
    const basic_map<features::binary_descriptor<256>>&, const camera_rig<camera::radial_tangential>&,
    const calibration_options&, const progress&);
extern template result<calibration<camera::kannala_brandt>> calibrate_by_map(
    const basic_map<features::binary_descriptor<256>>&, const camera_rig<camera::kannala_brandt>&,
    const calibration_options&, const progress&);

}  // namespace orbis::slam::detail
