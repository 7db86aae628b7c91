// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/detail/compiled/system_parts.hpp>

template class orbis::slam::detail::front_end<orbis::camera::any_camera, orbis::slam::detail::compiled_descriptor,
                                              orbis::slam::orb_matchers, orbis::slam::any_sensor>;
