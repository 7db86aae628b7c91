// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/rgbd_system.hpp>

namespace orbis::slam::detail {

template class loop_closer<camera::any_camera, compiled_descriptor, bag_of_words_places>;
template std::optional<loop_correction::solution> loop_correction::solve(
    const loop_correction::snapshot<compiled_descriptor>&, const compiled_rig&, const loop_correction_options&,
    const progress&);

}  // namespace orbis::slam::detail
