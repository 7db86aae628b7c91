// SPDX-License-Identifier: BSD-3-Clause
#include <span>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/self_calibration-inl.hpp>

namespace orbis::optimize {

template result<self_calibrated<camera::pinhole>> self_calibrate(const camera::pinhole&, std::span<se3>,
                                                                 std::span<vec3>, std::span<const bundle_observation>,
                                                                 const self_calibration_options&, const progress&);
template result<self_calibrated<camera::radial_tangential>> self_calibrate(const camera::radial_tangential&,
                                                                           std::span<se3>, std::span<vec3>,
                                                                           std::span<const bundle_observation>,
                                                                           const self_calibration_options&,
                                                                           const progress&);
template result<self_calibrated<camera::kannala_brandt>> self_calibrate(const camera::kannala_brandt&, std::span<se3>,
                                                                        std::span<vec3>,
                                                                        std::span<const bundle_observation>,
                                                                        const self_calibration_options&,
                                                                        const progress&);

}  // namespace orbis::optimize
