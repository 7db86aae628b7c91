// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam::detail {

template class tracker<camera::any_camera, compiled_descriptor, orb_matchers>;

}  // namespace orbis::slam::detail
