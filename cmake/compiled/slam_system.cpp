// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam {

template class detail::back_end<camera::any_camera, detail::compiled_descriptor, bag_of_words_places>;
template class rgbd_system<camera::any_camera>;

}  // namespace orbis::slam
