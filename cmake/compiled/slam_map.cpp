// SPDX-License-Identifier: BSD-3-Clause
#include <orbis/slam/calibration-inl.hpp>
#include <orbis/slam/map-inl.hpp>
#include <orbis/slam/map_file-inl.hpp>

namespace orbis::slam {

template class basic_map<features::binary_descriptor<256>>;
#define ORBIS_CALIBRATE(model)                                                                        \
  template result<calibration<camera::model>> calibrate(const map&, const camera_rig<camera::model>&, \
                                                        const calibration_options&, const progress&)
ORBIS_CALIBRATE(any_camera);
ORBIS_CALIBRATE(pinhole);
ORBIS_CALIBRATE(radial_tangential);
ORBIS_CALIBRATE(kannala_brandt);

}  // namespace orbis::slam
