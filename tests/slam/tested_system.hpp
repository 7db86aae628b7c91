// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The SLAM system that the tests run, compiled once for all of them (tested_system.cpp).
#pragma once

#include <orbis/camera/any.hpp>
#include <orbis/slam/rgbd_system.hpp>

extern template class orbis::slam::rgbd_system<orbis::camera::any_camera>;

namespace orbis::test {
using slam_system = slam::rgbd_system<camera::any_camera>;
}
