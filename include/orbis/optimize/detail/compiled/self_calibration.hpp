// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// What the library orbis::compiled holds of self_calibration.hpp: the camera models of the library.
/// cmake/compiled/optimize_calibration_*.cpp instantiate it, one model each, so that none takes much time and memory.
#pragma once

#include <span>

#include <orbis/camera/kannala_brandt.hpp>
#include <orbis/camera/pinhole.hpp>
#include <orbis/camera/radial_tangential.hpp>
#include <orbis/core/execution.hpp>
#include <orbis/core/result.hpp>
#include <orbis/core/se3.hpp>
#include <orbis/core/types.hpp>
#include <orbis/optimize/self_calibration.hpp>

/// `ORBIS_SELF_CALIBRATION(extern, model);`
#define ORBIS_SELF_CALIBRATION(is_extern, model)                                                              \
  is_extern template orbis::result<orbis::optimize::self_calibrated<orbis::camera::model>>                    \
  orbis::optimize::self_calibrate(const orbis::camera::model&, std::span<orbis::se3>, std::span<orbis::vec3>, \
                                  std::span<const bundle_observation>, const self_calibration_options&,       \
                                  const orbis::progress&)

ORBIS_SELF_CALIBRATION(extern, pinhole);
ORBIS_SELF_CALIBRATION(extern, radial_tangential);
ORBIS_SELF_CALIBRATION(extern, kannala_brandt);
