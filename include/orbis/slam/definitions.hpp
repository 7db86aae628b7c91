// SPDX-License-Identifier: BSD-3-Clause
/// @file
/// The functions of `rgbd_system` and `calibrate`, for programs that link `orbis::compiled` and use one of them with
/// types that it does not hold: another camera than `any_camera`, an extractor, matchers, places or a sensor of their
/// own. Every source that does includes it. Header-only programs have them by `rgbd_system.hpp` and `calibration.hpp`.
#pragma once

#include <orbis/slam/detail/mapping/calibration_functions.hpp>
#include <orbis/slam/detail/system/rgbd_system_functions.hpp>
