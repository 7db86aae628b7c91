// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>

#include <orbis/slam/definitions.hpp>
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam {

template class detail::back_end<camera::any_camera, detail::compiled_descriptor, bag_of_words_places>;
template class rgbd_system<camera::any_camera>;
template track_result rgbd_system<camera::any_camera>::track_images(double, const image_view<const rgb8>&,
                                                                    const camera::depth_view<std::uint16_t>&);
template track_result rgbd_system<camera::any_camera>::track_images(double, const image_view<const rgb8>&,
                                                                    const camera::depth_view<float>&);

}  // namespace orbis::slam
