// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include <orbis/slam/any_system.hpp>
#include <orbis/slam/definitions.hpp>

namespace orbis::slam {

template class rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places, any_sensor>;
template track_result rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places,
                                  any_sensor>::track_images(double, const image_view<const rgb8>&,
                                                            const camera::depth_view<std::uint16_t>&);
template track_result rgbd_system<camera::any_camera, features::orb_extractor, orb_matchers, bag_of_words_places,
                                  any_sensor>::track_images(double, const image_view<const rgb8>&,
                                                            const camera::depth_view<float>&);

}  // namespace orbis::slam
