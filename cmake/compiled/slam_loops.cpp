// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam::detail {

template class loop_closer<camera::any_camera, compiled_descriptor, bag_of_words_places>;

}  // namespace orbis::slam::detail
