// SPDX-License-Identifier: BSD-3-Clause
#include <cstdint>
#include <optional>

#include <orbis/slam/system-inl.hpp>

namespace orbis::slam {

template class system<camera::any_camera>;
template track_result system<camera::any_camera>::track(double, image_view<const rgb8>,
                                                        const camera::depth_view<std::uint16_t>&,
                                                        std::optional<double>);
template track_result system<camera::any_camera>::track(double, image_view<const rgb8>,
                                                        const camera::depth_view<float>&, std::optional<double>);

}  // namespace orbis::slam
