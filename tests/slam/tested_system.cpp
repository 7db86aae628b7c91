// SPDX-License-Identifier: BSD-3-Clause
#include "slam/tested_system.hpp"

template class orbis::slam::rgbd_system<orbis::camera::any_camera>;
