// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/calibration-inl.hpp>
#include <orbis/slam/map-inl.hpp>
#include <orbis/slam/map_file-inl.hpp>

namespace orbis::slam {

template class basic_map<features::binary_descriptor<256>>;
template result<calibration<camera::any_camera>> calibrate(const map&, const camera_rig<camera::any_camera>&,
                                                           const calibration_options&, const progress&);

}  // namespace orbis::slam
