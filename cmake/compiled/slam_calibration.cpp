// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/definitions.hpp>

namespace orbis::slam::detail {

template result<calibration<camera::any_camera>> calibrate_by_map(const basic_map<features::binary_descriptor<256>>&,
                                                                  const camera_rig<camera::any_camera>&,
                                                                  const calibration_options&, const progress&);
template result<calibration<camera::pinhole>> calibrate_by_map(const basic_map<features::binary_descriptor<256>>&,
                                                               const camera_rig<camera::pinhole>&,
                                                               const calibration_options&, const progress&);
template result<calibration<camera::radial_tangential>> calibrate_by_map(
    const basic_map<features::binary_descriptor<256>>&, const camera_rig<camera::radial_tangential>&,
    const calibration_options&, const progress&);
template result<calibration<camera::kannala_brandt>> calibrate_by_map(
    const basic_map<features::binary_descriptor<256>>&, const camera_rig<camera::kannala_brandt>&,
    const calibration_options&, const progress&);

}  // namespace orbis::slam::detail
