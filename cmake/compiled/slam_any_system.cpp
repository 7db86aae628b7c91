// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/any_system.hpp>

template class orbis::slam::rgbd_system<orbis::camera::any_camera, orbis::features::orb_extractor,
                                        orbis::slam::orb_matchers, orbis::slam::bag_of_words_places,
                                        orbis::slam::any_sensor>;
