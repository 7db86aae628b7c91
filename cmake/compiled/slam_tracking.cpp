// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/camera/any.hpp>
#include <orbis/slam/detail/compiled/mapping.hpp>
#include <orbis/slam/detail/tracking/front_end.hpp>

namespace orbis::slam::detail {

template class tracker<camera::any_camera, compiled_descriptor, orb_matchers>;
template class front_end<camera::any_camera, compiled_descriptor, orb_matchers, rgbd>;

}  // namespace orbis::slam::detail
