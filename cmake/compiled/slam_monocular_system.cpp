// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/definitions.hpp>
#include <orbis/slam/monocular_system.hpp>

namespace orbis::slam {

template class detail::front_end<camera::any_camera, detail::compiled_descriptor, orb_matchers, monocular>;
template class rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places, monocular>;

}  // namespace orbis::slam
